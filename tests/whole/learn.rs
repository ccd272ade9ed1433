//! Tests that new textures are learned from a few slides, with the embedding that is shipped.

use wstac_core::learned::{Center, Lesson, nearest};
use wstac_core::model::Model;
use wstac_core::model::file::{Input, Task};
use wstac_host::model_file::ModelFile;
use wstac_scene::specimen::Specimen;
use wstac_tests::textures::NEW;
use wstac_train::dataset::path::{PathSlide, RandomSlides};
use wstac_train::model::calibrate::{LabeledSamples, Quality};
use wstac_train::model::learn::learn;
use wstac_train::model::trained::padded;

/// Returns slides of the ten new textures on one sensor.
fn slides(seed: u64, count: u32) -> Vec<PathSlide> {
    let wanted =
        RandomSlides { specimens: NEW.to_vec(), slides: count, seed, sensors: [700_000, 1], ..RandomSlides::default() };
    wanted.all().unwrap()
}

/// Returns slides as samples of a model of this input. Each label has a name.
fn samples(
    slides: &[PathSlide],
    input: Input,
    names: &[String],
    label: impl Fn(&PathSlide) -> usize,
) -> LabeledSamples {
    let mut samples = LabeledSamples { names: names.to_vec(), ..LabeledSamples::default() };
    for slide in slides {
        if let Some(path) = if input == Input::Path { slide.path } else { slide.taxel_path } {
            samples.numbers.push(path.numbers().to_vec());
            samples.labels.push(label(slide) as u16);
        }
    }
    samples
}

/// Returns slides of the new textures as samples of a model of this input.
fn of_new(slides: &[PathSlide], input: Input) -> LabeledSamples {
    let names: Vec<_> = (0..10).map(|k| format!("new {k}")).collect();
    let is_it = |new: &Specimen, slide: &Specimen| Specimen { length_mm: slide.length_mm, ..*new } == *slide;
    samples(slides, input, &names, |found| NEW.iter().position(|new| is_it(new, &found.slide.specimen)).unwrap())
}

/// Returns five samples of each label, and all others.
fn five(samples: &LabeledSamples) -> (LabeledSamples, LabeledSamples) {
    let (mut few, mut rest) =
        (LabeledSamples { names: samples.names.clone(), ..LabeledSamples::default() }, LabeledSamples::default());
    for (numbers, &label) in samples.numbers.iter().zip(&samples.labels) {
        let is_few = few.labels.iter().filter(|&&other| other == label).count() < 5;
        let to = if is_few { &mut few } else { &mut rest };
        to.numbers.push(numbers.clone());
        to.labels.push(label);
    }
    (few, rest)
}

#[test]
fn ten_new_textures_are_learned_from_five_slides_of_each() {
    let file = ModelFile::open("builtin:embedding".as_ref()).unwrap();
    let (few, rest) = five(&of_new(&slides(41, 180), Input::Path));
    assert_eq!(few.labels.len(), 50);
    let learned = learn(file.words(), &few, "{}").unwrap();
    assert!(learned.is_calibrated && learned.slides == [5; 10] && learned.left_out.unwrap() > 0.9);
    let model = Model::from_words(&learned.words).unwrap();
    assert!(model.tells_unknown() && model.task() == Task::Other);
    let found = Quality::of(&model, &rest);
    assert!(found.accuracy >= 0.9 && found.calibration_error < 0.08 && found.known.unwrap() > 0.9, "{found:?}");
    // A flat block is none of them.
    let flat = RandomSlides { specimens: vec![Specimen::ALL[0]], slides: 20, seed: 43, ..RandomSlides::default() };
    let known = |slide: &PathSlide| model.classification(slide.path.unwrap().numbers()).known.unwrap();
    assert!(flat.all().unwrap().iter().filter(|slide| known(slide)).count() <= 4);
    // What was learned is not what the base knows.
    let base = file.model().unwrap();
    assert!(Quality::of(&base, &rest).accuracy < 0.3);
    // Two slides tell the mean, but not how sure an answer is.
    let two = LabeledSamples {
        numbers: few
            .numbers
            .iter()
            .zip(&few.labels)
            .filter(|(_, label)| **label < 2)
            .map(|(x, _)| x.clone())
            .take(4)
            .collect(),
        labels: few.labels.iter().copied().filter(|label| *label < 2).take(4).collect(),
        names: few.names.clone(),
    };
    let plain = learn(file.words(), &two, "{}").unwrap();
    assert!(!plain.is_calibrated && !Model::from_words(&plain.words).unwrap().is_calibrated());
}

/// A board learns slide after slide, and a host from all of them at once: the centers, what is known, and the names are
/// the same, bit for bit.
#[test]
fn a_board_learns_what_a_host_learns() {
    let slides = slides(45, 110);
    for base in ["builtin:embedding", "builtin:taxel-embedding"] {
        let file = ModelFile::open(base.as_ref()).unwrap();
        let base = file.model().unwrap();
        let (few, rest) = five(&of_new(&slides, base.input()));
        let mut lessons = vec![Lesson::new(); few.names.len()];
        let mut centers: Vec<Option<Center>> = vec![None; few.names.len()];
        for (numbers, &label) in few.numbers.iter().zip(&few.labels) {
            let center = lessons[usize::from(label)].push(base.place(&padded(numbers)).unwrap());
            centers[usize::from(label)] = center.or(centers[usize::from(label)]);
        }
        // Two of the ten are left out, so that some slides are unknown.
        let of_eight = few.labels.iter().map(|label| *label < 8);
        let eight = LabeledSamples {
            numbers: few
                .numbers
                .iter()
                .zip(of_eight.clone())
                .filter(|(_, is_in)| *is_in)
                .map(|(x, _)| x.clone())
                .collect(),
            labels: few.labels.iter().zip(of_eight).filter(|(_, is_in)| *is_in).map(|(label, _)| *label).collect(),
            names: few.names[..8].to_vec(),
        };
        let learned = learn(file.words(), &eight, "{}").unwrap();
        let model = Model::from_words(&learned.words).unwrap();
        let centers: Vec<Center> = centers[..8].iter().map(|center| center.unwrap()).collect();
        for (class, center) in centers.iter().enumerate() {
            assert_eq!(model.mean_place(class as u8).as_ref(), Some(center.place()), "{class}");
        }
        let (mut known, mut unknown) = (0, 0);
        for numbers in rest.numbers.iter().chain(&few.numbers) {
            let host = model.classification(&padded(numbers));
            let board = nearest(&base.place(&padded(numbers)).unwrap(), None, centers.iter().enumerate());
            assert_eq!(board, (host.known == Some(true)).then_some(usize::from(host.class)));
            *if board.is_some() { &mut known } else { &mut unknown } += 1;
        }
        assert!(known > 50 && unknown > 10, "{known} {unknown}");
    }
}

/// The slides of a flat block differ much in the projection. That is no reason to know more of other textures.
#[test]
fn a_flat_texture_among_the_learned_ones_leaves_unknown_ones_unknown() {
    let of = |names: &[&str], seed, count| {
        let specimens: Vec<Specimen> = names.iter().map(|name| name.parse().unwrap()).collect();
        let wanted = RandomSlides { specimens, slides: count, seed, sensors: [710_000, 1], ..RandomSlides::default() };
        wanted.all().unwrap()
    };
    let (learned, others) = (["Fla0", "Saw3", "Sin3"], ["Tri2", "Saw2", "Sin2"]);
    let (of_learned, of_others) = (of(&learned, 47, 90), of(&others, 48, 60));
    for (base, input) in [("builtin:taxel-embedding", Input::TaxelPath), ("builtin:embedding", Input::Path)] {
        let file = ModelFile::open(base.as_ref()).unwrap();
        let samples = |names: [&str; 3], slides: &[PathSlide]| {
            let label = |slide: &PathSlide| {
                let pattern = slide.slide.specimen.pattern.name();
                names.iter().position(|name| name.starts_with(pattern)).unwrap()
            };
            samples(slides, input, &names.map(str::to_owned), label)
        };
        let (few, rest) = five(&samples(learned, &of_learned));
        assert_eq!(few.labels.len(), 15);
        let found = learn(file.words(), &few, "{}").unwrap();
        let model = Model::from_words(&found.words).unwrap();
        let known = Quality::of(&model, &rest);
        assert!(known.accuracy >= 0.85, "{base}: {known:?}");
        let others = samples(others, &of_others);
        let unknown =
            others.numbers.iter().filter(|numbers| model.classification(&padded(numbers)).known == Some(false));
        let (unknown, all) = (unknown.count(), others.numbers.len());
        let least = if input == Input::TaxelPath { 85 } else { 40 };
        assert!(100 * unknown >= least * all, "{base}: {unknown} of {all} are unknown");
        // Each texture is unlike the two others.
        assert!(found.found_unknown.unwrap() > 0.9, "{base}: {:?}", found.found_unknown);
    }
}
