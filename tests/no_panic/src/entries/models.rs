//! Entry points for texture models: reading them, classifying, and labels.

use wstac_core::learned::{self, Center, Lesson};
use wstac_core::model::boosted::Boosted;
use wstac_core::model::file::{self, ModelError, Task};
use wstac_core::model::forest::Forest;
use wstac_core::model::labels::{Label, Labels};
use wstac_core::model::linear_svm::LinearSvm;
use wstac_core::model::network::Network;
use wstac_core::model::place::Place;
use wstac_core::model::{Classification, Model};
use wstac_core::texture;

entries! {
    model:
    new<'a>(words: &'a [u32]) -> Result<Model<'a>, ModelError> { Model::from_words(words) }
    new_of_bytes<'a>(bytes: &'a [u8]) -> Result<Model<'a>, ModelError> { Model::from_bytes(bytes) }
    new_svm<'a>(words: &'a [u32]) -> Result<LinearSvm<'a>, ModelError> { LinearSvm::from_words(words) }
    new_forest<'a>(words: &'a [u32]) -> Result<Forest<'a>, ModelError> { Forest::from_words(words) }
    new_boosted<'a>(words: &'a [u32]) -> Result<Boosted<'a>, ModelError> { Boosted::from_words(words) }
    new_network<'a>(words: &'a [u32]) -> Result<Network<'a>, ModelError> { Network::from_words(words) }
    svm_classify(model: &LinearSvm<'_>, sample: &[i16; 700]) -> u8 { model.classify(sample) }
    forest_classify(model: &Forest<'_>, sample: &[i16; 700]) -> u8 { model.classify(sample) }
    boosted_classify(model: &Boosted<'_>, sample: &[i16; 700]) -> u8 { model.classify(sample) }
    svm_classification(model: &LinearSvm<'_>, sample: &[i16; 700]) -> Classification { model.classification(sample) }
    forest_classification(model: &Forest<'_>, sample: &[i16; 700]) -> Classification { model.classification(sample) }
    boosted_classification(model: &Boosted<'_>, sample: &[i16; 700]) -> Classification { model.classification(sample) }
    calibrated(model: &Model<'_>) -> [bool; 2] { [model.is_calibrated(), model.tells_unknown()] }
    place(model: &Model<'_>, sample: &[i16; 700]) -> Option<Place> { model.place(sample) }
    svm_place(model: &LinearSvm<'_>, sample: &[i16; 700]) -> Option<Place> { model.place(sample) }
    mean_place(model: &Model<'_>, class: u8) -> Option<Place> { model.mean_place(class) }
    checksum(model: &Model<'_>) -> u32 { model.checksum() }
    place_of_numbers(numbers: &[i16]) -> Option<Place> { Place::new(numbers) }
    place_numbers<'a>(place: &'a Place) -> &'a [i16] { place.numbers() }
    place_distance(one: &Place, other: &Place) -> u32 { one.squared_distance(other) }
    place_mean(places: &[Place], without: Option<usize>) -> Place { Place::mean(places, without) }
    expected_far(dimensions: usize, slides: usize) -> u32 { learned::expected_far(dimensions, slides) }
    center(places: &[Place]) -> Center { Center::of(places) }
    center_parts(center: &Center) -> (Place, u32) {
        let same = Center::new(*center.place(), center.far());
        (*same.place(), same.far())
    }
    new_lesson() -> Lesson { Lesson::new() }
    lesson(lesson: &mut Lesson, place: Place) -> (Option<Center>, usize) { (lesson.push(place), lesson.slides()) }
    nearest(place: &Place, rival: Option<u32>, centers: &[Center]) -> Option<usize> {
        learned::nearest(place, rival, centers.iter().enumerate())
    }
    texture_of_svm(sample: &[i16; 700], model: &LinearSvm<'static>) -> u8 { texture::texture(sample, model).class }
    texture_of_forest(sample: &[i16; 700], model: &Forest<'static>) -> u8 { texture::texture(sample, model).class }
    texture_of_boosted(sample: &[i16; 700], model: &Boosted<'static>) -> u8 { texture::texture(sample, model).class }
    task(model: &Model<'_>) -> Task { model.task() }
    crc(words: &[u32]) -> u32 { file::crc(words) }
    crc_of_bytes(bytes: &[u8]) -> u32 { wstac_core::crc::crc32(bytes.iter().copied()) }
    labels(labels: Labels<'_>) -> usize { if labels.is_empty() { 0 } else { labels.len() } }
    frames(model: &Model<'_>) -> u8 { model.frames() }
    label<'a>(labels: Labels<'a>, class: usize) -> Option<Label<'a>> { labels.get(class) }
    training<'a>(labels: Labels<'a>) -> Label<'a> { labels.training() }
    label_letters(label: Label<'_>) -> u32 { label.chars().map(u32::from).fold(0, u32::wrapping_add) }
}

entries! {
    any_model:
    network_classify(model: &Network<'_>, sample: &[i16; 700]) -> u8 { model.classify(sample) }
    network_classification(model: &Network<'_>, sample: &[i16; 700]) -> Classification { model.classification(sample) }
    probabilities(model: &Model<'_>, sample: &[i16; 700]) -> Option<[u16; 64]> { model.probabilities(sample) }
    texture_of_model(sample: &[i16; 700], model: &Model<'static>) -> u8 { texture::texture(sample, model).class }
    classification(model: &Model<'_>, sample: &[i16; 700]) -> Classification { model.classification(sample) }
    classify(model: &Model<'_>, sample: &[i16; 700]) -> u8 { model.classify(sample) }
    of_taxels(model: &Model<'_>, sample: &[i16; 1750]) -> Classification { model.classification(sample) }
    scores(model: &Model<'_>, sample: &[i16; 700]) -> i64 {
        let mut sum = 0_i64;
        model.each_score(sample, |_, score| sum = sum.wrapping_add(score));
        sum
    }
}
