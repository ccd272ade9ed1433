//! The answers of the shipped models of the path about textures: the ten of the paper, unknown ones, and new ones.

pub(crate) mod conditions;
pub(crate) mod periods;

use std::fmt::Write as _;

use wstac_core::learned::{Center, nearest};
use wstac_core::model::Model;
use wstac_core::model::calibration::CONFIDENCE_ONE;
use wstac_core::model::file::{INPUTS, Input};
use wstac_host::model_file::ModelFile;
use wstac_scene::specimen::Specimen;
use wstac_tests::textures::{NEW, unknown, unlike_new};
use wstac_train::dataset::path::{PathSlide, RandomSlides};
use wstac_train::model::calibrate::{LabeledSamples, calibration_error};
use wstac_train::model::learn::learn;

use crate::{at_least, interval, judged};

/// Slides of the ten textures, of unknown ones, and of new ones on each sensor.
const SLIDES: u32 = 2000;
const UNKNOWN: u32 = 1000;
const NEW_SLIDES: u32 = 150;
/// Sensors of new textures, and slides of each texture that are learned.
const SENSORS: u32 = 12;
const SHOTS: usize = 5;
/// The first sensor. No model was trained, calibrated or tested with it or those behind it.
const FIRST_SENSOR: u32 = 900_000;
/// The shipped models, and the goal of their accuracy in percent.
const MODELS: [(&str, f64); 6] = [
    ("path-svm", 97.0),
    ("taxel-path-svm", 97.0),
    ("path-forest", 93.0),
    ("path-boosted", 93.0),
    ("taxel-path-forest", 93.0),
    ("taxel-path-boosted", 93.0),
];
/// The models of the other tables.
const DETAILED: usize = 2;
const SPEEDS: [f64; 6] = [50.0, 80.0, 120.0, 180.0, 240.0, 301.0];
/// The answer of a model about a slide: whether its class is right, its confidence, and whether the texture is known.
struct Said {
    right: bool,
    confidence: f64,
    known: bool,
}

/// Returns the sample of a slide that a model takes, if the slide shows enough of the path.
fn sample<'s>(model: &Model, slide: &'s PathSlide) -> Option<&'s [i16; INPUTS]> {
    let path = if model.input() == Input::Path { &slide.path } else { &slide.taxel_path };
    path.as_ref()
        .filter(|path| slide.slides && path.covers(model.frames()))
        .map(wstac_core::touch::path_sample::PathSample::numbers)
}

/// Returns what a model says about each slide; `None` without a sample.
fn said(model: &Model, slides: &[PathSlide]) -> Vec<Option<Said>> {
    let of = |slide: &PathSlide| {
        let found = model.classification(sample(model, slide)?);
        let specimen = slide.slide.specimen;
        let name = format!("{}{}", specimen.pattern.name(), specimen.depth_mm);
        let speeds = model.known_speeds().zip(slide.measured);
        Some(Said {
            right: model.labels().get(found.class.into()).is_some_and(|label| label == *name.as_str()),
            confidence: f64::from(found.confidence.unwrap_or(0)) / f64::from(CONFIDENCE_ONE),
            known: found.known == Some(true) && speeds.is_none_or(|(speeds, [mm_s, _])| speeds.has(mm_s)),
        })
    };
    slides.iter().map(of).collect()
}

/// Returns whether an answer is given and right.
fn is_right(said: Option<&Said>) -> bool {
    said.is_some_and(|said| said.right && said.known)
}

/// Returns the expected calibration error of the answers that are given.
fn error_of_given(all: &[Option<Said>]) -> f64 {
    let given = all.iter().flatten().filter(|said| said.known);
    calibration_error(given.map(|said| (said.confidence, said.right)))
}

/// Returns the rows of a table of accuracies by speed.
fn by_speed(models: &[(String, Vec<Option<Said>>)], slides: &[PathSlide]) -> String {
    let mut rows = String::new();
    for pair in SPEEDS.windows(2) {
        let within = |slide: &&PathSlide| (pair[0]..pair[1]).contains(&slide.slide.speed_mm_s);
        let count = slides.iter().filter(within).count();
        let _ = write!(rows, "| {} to {} mm/s |", pair[0], (pair[1] / 5.0).floor() * 5.0);
        for (_, all) in models {
            let both = slides.iter().zip(all).filter(|(slide, _)| within(slide));
            let right = both.filter(|(_, said)| is_right(said.as_ref())).count();
            let _ = write!(rows, " {:.1} |", 100.0 * right as f64 / count.max(1) as f64);
        }
        rows.push('\n');
    }
    rows
}

/// The result of learning the ten new textures on some sensors.
#[derive(Default)]
struct Learned {
    /// The accuracy on each sensor in percent.
    accuracies: Vec<f64>,
    /// Slides that are right, and all.
    right: [usize; 2],
    /// The part of the new textures' slides that is known, in percent.
    known: f64,
    /// Slides of textures unlike the new ones, and of the ten specimens: called unknown, named as a new one, and all.
    others: [[usize; 3]; 2],
}

impl Learned {
    /// Learns with a base on each sensor, as a host or a board does.
    fn of(file: &ModelFile, on_board: bool) -> Self {
        let mut all = Self::default();
        let base = file.model().expect("a shipped model");
        for sensor in 0..SENSORS {
            let (few, rest, without) = few_and_rest(sensor, base.input());
            let learned = learn(file.words(), &few, "{}").expect("five slides of each texture");
            let model = Model::from_words(&learned.words).expect("a model");
            let centers = centers(&base, &few);
            // The new texture that a sample is named, and whether it is known.
            let says = |numbers: &[i16; INPUTS]| {
                if on_board {
                    return board_says(&base, &centers, numbers);
                }
                let found = model.classification(numbers);
                (found.known.unwrap_or(true).then_some(found.class.into()), found.known == Some(true))
            };
            let said = rest.numbers.iter().map(|numbers| says(numbers[..].try_into().expect("a whole sample")));
            let said: Vec<(Option<u16>, bool)> = said.collect();
            let (count, right) = (said.len() + without, said.iter().zip(&rest.labels));
            let right = right.filter(|((name, _), label)| *name == Some(**label)).count();
            all.right[0] += right;
            all.right[1] += count;
            all.accuracies.push(100.0 * right as f64 / count as f64);
            let known = said.iter().filter(|(_, known)| *known).count();
            all.known += 100.0 * known as f64 / count as f64 / f64::from(SENSORS);
            for (specimens, [unknown, named, count]) in
                [unlike_new(), Specimen::ALL.to_vec()].into_iter().zip(&mut all.others)
            {
                let others = of_sensor(sensor, specimens, 88_600);
                for (name, known) in others.iter().filter_map(|slide| sample(&model, slide).map(says)) {
                    *unknown += usize::from(!known);
                    *named += usize::from(name.is_some());
                    *count += 1;
                }
            }
        }
        all
    }

    /// Returns the cells of a row.
    fn cells(&self) -> String {
        let worst = self.accuracies.iter().copied().fold(100.0, f64::min);
        let [[unlike, _, of_unlike], [unknown, named, specimens]] = self.others;
        let (unlike, unknown) = (at_least(unlike, of_unlike, 85.0), interval(unknown, specimens));
        let right = at_least(self.right[0], self.right[1], 97.0);
        let named = interval(named, specimens);
        format!("{right} | {worst:.1} | {:.1} | {unlike} | {unknown} | {named}", self.known)
    }
}

/// Returns the center of each new texture.
fn centers(base: &Model, few: &LabeledSamples) -> Vec<Center> {
    let of = |label: usize| {
        let own = few.numbers.iter().zip(&few.labels).filter(|(_, other)| usize::from(**other) == label);
        own.filter_map(|(numbers, _)| base.place::<INPUTS>(numbers[..].try_into().ok()?)).collect::<Vec<_>>()
    };
    (0..few.names.len()).map(|label| Center::of(&of(label))).collect()
}

/// Returns the new texture that a board names, beside the textures of its model, and whether it knows the texture.
fn board_says(base: &Model, centers: &[Center], numbers: &[i16; INPUTS]) -> (Option<u16>, bool) {
    let (found, place) = (base.classification(numbers), base.place(numbers).expect("an embedding"));
    let rival = base.mean_place(found.class).map(|mean| mean.squared_distance(&place));
    let name = nearest(&place, rival, (0..).zip(centers));
    (name, name.is_some() || found.known == Some(true))
}

/// Returns slides of textures on a sensor that learns.
fn of_sensor(sensor: u32, specimens: Vec<Specimen>, seed: u64) -> Vec<PathSlide> {
    let wanted = RandomSlides {
        specimens,
        slides: NEW_SLIDES,
        seed: seed + u64::from(sensor),
        sensors: [FIRST_SENSOR + 5000 + sensor, 1],
        ..RandomSlides::default()
    };
    wanted.all().expect("the scenes are valid")
}

/// Returns the first slides of each new texture on a sensor, all others, and the number of slides without a sample.
fn few_and_rest(sensor: u32, input: Input) -> (LabeledSamples, LabeledSamples, usize) {
    let names = (0..NEW.len()).map(|number| format!("new {number}")).collect();
    let mut few = LabeledSamples { names, ..LabeledSamples::default() };
    let (mut rest, mut without) = (LabeledSamples::default(), 0);
    for slide in of_sensor(sensor, NEW.to_vec(), 88_500) {
        let length_mm = slide.slide.specimen.length_mm;
        let is_it = |new: &Specimen| Specimen { length_mm, ..*new } == slide.slide.specimen;
        let label = NEW.iter().position(is_it).unwrap_or(0) as u16;
        let path = if input == Input::Path { slide.path } else { slide.taxel_path };
        let Some(path) = path else {
            without += 1;
            continue;
        };
        let is_few = few.labels.iter().filter(|&&other| other == label).count() < SHOTS;
        let to = if is_few { &mut few } else { &mut rest };
        to.numbers.push(path.numbers().to_vec());
        to.labels.push(label);
    }
    (few, rest, without)
}

/// Returns the head of a table with a column for each model.
fn head(what: &str, about: &str) -> String {
    let names = MODELS.map(|(name, _)| format!(" `{name}` |"))[..DETAILED].concat();
    format!("\n{about}\n\n| {what} |{names}\n| --- |{}\n", " ---: |".repeat(DETAILED))
}

/// Returns the section about textures.
pub(crate) fn section() -> String {
    let wanted =
        RandomSlides { slides: SLIDES, seed: 88_001, sensors: [FIRST_SENSOR, 1000], ..RandomSlides::default() };
    let slides = wanted.all().expect("the scenes are valid");
    let textures = unknown();
    let others = RandomSlides {
        specimens: textures.iter().map(|(_, specimen)| *specimen).collect(),
        slides: UNKNOWN,
        seed: 88_002,
        sensors: [FIRST_SENSOR + 2000, 1000],
        ..RandomSlides::default()
    };
    let others = others.all().expect("the scenes are valid");
    let mut page = String::from(HEAD);
    let files = MODELS.map(|(name, _)| ModelFile::open(format!("builtin:{name}").as_ref()).expect("a shipped model"));
    let mut tens = Vec::new();
    for ((name, goal), file) in MODELS.into_iter().zip(&files) {
        let model = file.model().expect("a shipped model");
        let (ten, other) = (said(&model, &slides), said(&model, &others));
        let right = ten.iter().filter(|said| is_right(said.as_ref())).count();
        let slow = || slides.iter().zip(&ten).filter(|(slide, _)| slide.slide.speed_mm_s < 200.0);
        let right_slow = slow().filter(|(_, said)| is_right(said.as_ref())).count();
        let given = ten.iter().flatten().count();
        let refused = ten.iter().flatten().filter(|said| !said.known).count();
        let found = other.iter().flatten().filter(|said| !said.known).count();
        let _ = writeln!(
            page,
            "| `{name}` | {goal:.0} | {} | {} | {:.4} | {} | {} |",
            at_least(right, ten.len(), goal),
            at_least(right_slow, slow().count(), 95.0),
            error_of_given(&ten),
            at_least(found, other.iter().flatten().count(), 92.0),
            judged(refused, given, 50 * refused > given)
        );
        tens.push((name.to_owned(), ten));
    }
    page += &head("speed", BY_SPEED);
    page += &by_speed(&tens[..DETAILED], &slides);
    page += &conditions::section();
    page + &learning()
}

/// Returns the table of learning.
pub(crate) fn learning() -> String {
    let mut page = String::from(LEARNING);
    for (name, board) in
        [("builtin:embedding", ""), ("builtin:taxel-embedding", ""), ("builtin:taxel-embedding", ", board")]
    {
        let file = ModelFile::open(name.as_ref()).expect("a shipped model");
        let _ = writeln!(page, "| `{name}`{board} | {} |", Learned::of(&file, !board.is_empty()).cells());
    }
    page
}

const BY_SPEED: &str = "Right answers in percent, by speed; they depend little on length:";

const HEAD: &str = "
## Textures

The shipped models name simulated slides of sensors that no model has seen, from the first 28 mm of path.
Speeds are 50 to 300 mm/s, lengths 60 to 120 mm.
A slide without an answer or called unknown counts as wrong.
The calibration error is the mean difference between confidence and accuracy; the goal is at most 0.03.
Unknown textures have a depth or a period at least 1.5 times outside the trained ones.
More than 3 % beyond the speeds of its training, a model calls every texture unknown.

| model | goal, % | accuracy, % | at 50 to 200 mm/s (goal: 95), % | calibration error | unknown textures found (goal: 92), % | trained textures refused (goal: at most 2), % |
| --- | ---: | ---: | ---: | ---: | ---: | ---: |
";

const LEARNING: &str = "
### Learning

`wstac model learn` makes a model of ten new textures from five slides of each.
All slides of a model are of one of 12 unseen sensors.
Unlike textures are unknown ones of another pattern, or a depth or a period at least 1.5 times outside each learned one.
Nine of the ten specimens differ by 0.5 mm in depth and 1 mm in period from learned ones.
A board knows the ten specimens of its model, too.

| base | accuracy (goal: 97), % | worst sensor, % | known, % | unlike textures unknown (goal: 85), % | specimens unknown, % | named as new, % |
| --- | ---: | ---: | ---: | ---: | ---: | ---: |
";
