//! Training of texture models: from labeled slides to a model file, with a test on sensors or recordings of their own.
//!
//! A [`TrainingSet`] gathers slides of data sets, recordings and simulations. [`train`] splits them by group, fits a
//! linear model on one part, and evaluates its model file on the other one ([`Trial`]).
//!
//! ```
//! use wstac_train::dataset::random::RandomSweep;
//! use wstac_train::train::{TrainOptions, TrainingSet, train};
//!
//! let sweep = RandomSweep::parse("example", "specimens = [\"Fla0\", \"Saw4\"]\nslides = 40\nsensors = 10")?;
//! let slides = sweep.slides.all()?;
//! let options = TrainOptions::default();
//! let set = TrainingSet::of_sweep(&sweep, &slides, &options);
//! let trained = train(set, &options)?;
//! assert_eq!(trained.labels, ["Fla0", "Saw4"]);
//! assert!(trained.trial.unwrap().right() >= 7);
//! # Ok::<(), wstac_host::error::Error>(())
//! ```

mod logistic;
mod set;
mod split;

use wstac_core::model::Model;
use wstac_core::model::file::{Input, MOST_CLASSES, Task};
use wstac_core::model::speeds::KnownSpeeds;
use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;

pub use self::set::{LabeledSlide, TrainingSet};
use crate::dataset::path::frames_of;
use crate::model::calibrate::{Calibrated, LabeledSamples, Quality, Settings, calibrate, with_part};
use crate::model::trained::{Kind, Trained, in_file_order, vec_in_file_order};
use crate::model::write::{self, Written};
use logistic::{Limits, Samples};

/// Factor of the penalty, and largest number of iterations.
const LIMITS: Limits = Limits { penalty: 0.02, iterations: 200 };

/// Fraction of the groups for training that is kept aside for the calibration.
const ASIDE: f64 = 0.15;

/// The choices for a training.
#[derive(Clone, Debug)]
pub struct TrainOptions {
    /// The sample that the model takes.
    pub input: Input,
    /// The task of the model: specimens by default.
    pub task: Task,
    /// Fraction of the groups that is for tests, if a set does not say which. 0 trains without a test.
    pub test: f64,
    /// A note about the training, which is part of the file.
    pub note: Option<String>,
}

impl Default for TrainOptions {
    fn default() -> Self {
        Self { input: Input::Path, task: Task::Specimen, test: 0.2, note: None }
    }
}

/// A trained model, and how good it is.
#[derive(Clone, Debug)]
pub struct TrainedModel {
    /// The names of its classes, in their order.
    pub labels: Vec<String>,
    /// The model file.
    pub written: Written,
    /// Number of slides that it was trained on.
    pub slides: usize,
    /// Number of groups that it was trained on.
    pub groups: usize,
    /// Number of slides for training that have no sample, and were left out.
    pub left_out: usize,
    /// The quality of its answers for the slides that its calibration kept aside; `None` without a calibration.
    pub calibration: Option<Quality>,
    /// Why it has no calibration.
    pub why_uncalibrated: Option<String>,
    /// Whether all slides were simulated for the training.
    pub is_simulated: bool,
    /// Its test; `None` if no slide is for tests.
    pub trial: Option<Trial>,
}

/// The answers of a model file to slides of groups that it was not trained on.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The names of the classes.
    pub labels: Vec<String>,
    /// For each class, how often its slides got each answer; the last number is that of slides without a
    /// sample, or taken for unknown.
    pub counts: Vec<Vec<u32>>,
    /// Number of groups.
    pub groups: usize,
}

impl Trial {
    /// Returns the number of slides.
    pub fn slides(&self) -> u32 {
        self.counts.iter().flatten().sum()
    }

    /// Returns the number of right answers. A slide without a sample has none, and one that is taken for
    /// unknown neither.
    pub fn right(&self) -> u32 {
        self.counts.iter().enumerate().map(|(class, answers)| answers[class]).sum()
    }

    /// Returns the number of right answers to a class's slides, and the number of these.
    pub fn of_class(&self, class: usize) -> [u32; 2] {
        self.counts.get(class).map_or([0; 2], |answers| [answers[class], answers.iter().sum()])
    }

    /// Returns the number of slides with an answer.
    pub fn answered(&self) -> u32 {
        self.slides() - self.without_answer()
    }

    /// Returns the number of slides without an answer: without a sample, or taken for unknown.
    pub fn without_answer(&self) -> u32 {
        self.counts.iter().filter_map(|answers| answers.last()).sum()
    }

    /// Returns whether guessing would have been right as often.
    pub fn is_guessing(&self) -> bool {
        u64::from(self.right()) * self.labels.len() as u64 <= self.slides().into()
    }
}

/// Returns Wilson's interval of 95 % of a fraction: that of `right` of `of`.
///
/// ```
/// let [low, high] = wstac_train::train::wilson(98, 100);
/// assert!((low - 0.930).abs() < 0.001 && (high - 0.994).abs() < 0.001);
/// assert_eq!(wstac_train::train::wilson(0, 0), [0.0, 1.0]);
/// ```
pub fn wilson(right: u32, of: u32) -> [f64; 2] {
    if of == 0 {
        return [0.0, 1.0];
    }
    let (n, z) = (f64::from(of), 1.96_f64);
    let fraction = f64::from(right) / n;
    let middle = (fraction + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (fraction * (1.0 - fraction) / n + z * z / (4.0 * n * n)).sqrt();
    [(middle - half).max(0.0), (middle + half).min(1.0)]
}

/// Trains a linear model on the slides of some groups, and tests its file on those of the others.
///
/// If every label has three groups for training or more, and about 50 slides, some are kept aside for the calibration:
/// then the model says how sure it is, and what it does not know.
///
/// Equal slides give equal files, with any number of threads.
///
/// # Errors
/// There are too few slides, classes or groups; the message says what is missing.
pub fn train(mut set: TrainingSet, options: &TrainOptions) -> Result<TrainedModel, Error> {
    let subject = set.about();
    trained(&mut set, options, &subject).map_err(|message| Error::new(ErrorKind::Data, subject, message))
}

fn trained(set: &mut TrainingSet, options: &TrainOptions, subject: &str) -> Result<TrainedModel, String> {
    split::split(set, options.test)?;
    let labels = set.labels();
    if labels.len() < 2 || labels.len() > MOST_CLASSES {
        let found = labels.first().map_or_else(String::new, |label| format!(" ({label})"));
        let classes = if labels.len() < 2 { found } else { String::new() };
        let count = counted(labels.len(), "label");
        return Err(format!("{count}{classes}, expected 2 to {MOST_CLASSES} different ones"));
    }
    let class_of = |slide: &LabeledSlide| labels.iter().position(|label| *label == slide.label).unwrap_or_default();
    let frames = usize::from(frames_of(options.input));
    let (tests, trains): (Vec<&LabeledSlide>, Vec<&LabeledSlide>) =
        set.slides.iter().partition(|slide| slide.is_test == Some(true));
    let usable: Vec<_> = trains.iter().copied().filter(|slide| slide.numbers.is_some()).collect();
    if let Some(label) = labels.iter().find(|label| !usable.iter().any(|slide| slide.label == **label)) {
        let more = set.more_slides();
        return Err(format!("label {label} has no slide with a sample to train on, expected at least 1: {more}"));
    }
    let aside = split::aside(&usable, ASIDE);
    let kept = aside.clone().unwrap_or_default();
    let (kept, fitted): (Vec<_>, Vec<_>) = usable.iter().copied().partition(|slide| kept.contains(&slide.group));
    // A set holds feature after feature, of 70 frames each. The model reads the first frames of each.
    let numbers = |sample: &[i16]| -> Vec<f32> {
        let read = sample.chunks(SAMPLE_FRAMES).flat_map(|feature| feature.iter().take(frames));
        read.map(|number| f32::from(*number) / FEATURE_ONE as f32).collect()
    };
    let classes: Vec<u8> = fitted.iter().map(|slide| class_of(slide) as u8).collect();
    // Not more memory than they take.
    let mut all: Vec<f32> = Vec::with_capacity(fitted.len() * options.input.numbers());
    all.extend(fitted.iter().filter_map(|slide| slide.numbers.as_deref()).flat_map(numbers));
    let inputs = frames * FEATURES;
    let samples = Samples { inputs, numbers: &all, classes: &classes, count: labels.len() };
    let linear = logistic::fit(&samples, LIMITS)?;
    let trained = Trained {
        labels: labels.clone(),
        task: options.task,
        input: options.input,
        inputs,
        speeds: speeds_of(&usable),
        kind: Kind::Linear(linear),
        remarks: Vec::new(),
        mean: None,
    };
    crate::model::check_names(&trained)?;
    let draft = write::write(&trained, "", write::Options::default())?;
    let of_file = |slides: &[&LabeledSlide]| LabeledSamples {
        numbers: slides.iter().filter_map(|slide| slide.numbers.as_deref()).map(vec_in_file_order).collect(),
        labels: slides.iter().map(|slide| class_of(slide) as u16).collect(),
        names: labels.clone(),
    };
    let calibrated =
        aside.and_then(|_| calibrate(&draft.words, &of_file(&fitted), &of_file(&kept), Settings::default()));
    // The test is of the file's integers; the facts about it are not known before, and do not change an answer.
    let words = calibrated.as_ref().map_or(&draft.words, |calibrated| &calibrated.words);
    let trial = (!tests.is_empty()).then(|| trial(words, &tests, &labels, class_of)).transpose()?;
    let groups = split::groups(&trains);
    let mut facts = serde_json::json!({
        "file": subject,
        "trainer": format!("wstac train {}, multinomial logistic regression", env!("CARGO_PKG_VERSION")),
        "slides": usable.len(),
        "groups": groups,
    });
    if calibrated.is_ok() {
        facts["calibrated"] = serde_json::json!({ "slides": kept.len(), "groups": split::groups(&kept) });
    }
    if let Some(trial) = &trial {
        facts["test"] = serde_json::json!({ "slides": trial.slides(), "groups": trial.groups, "right": trial.right() });
    }
    if let Some(note) = &options.note {
        facts["note"] = note.as_str().into();
    }
    let is_simulated = set.is_simulated();
    let mut written = write::write(&trained, &facts.to_string(), write::Options::default())?;
    let (calibration, why_uncalibrated) = match calibrated {
        Err(why) => (None, Some(why)),
        // Facts do not change scores, so the calibration is the same.
        Ok(Calibrated { part, held_out, .. }) => {
            written.words = with_part(&written.words, &part)?;
            (Some(held_out), None)
        }
    };
    Ok(TrainedModel {
        labels,
        written,
        slides: usable.len(),
        groups,
        left_out: trains.len() - usable.len(),
        calibration,
        why_uncalibrated,
        is_simulated,
        trial,
    })
}

/// Returns the range of the slides' speeds; `None` if one is not known, or too fast for a file.
fn speeds_of(slides: &[&LabeledSlide]) -> Option<KnownSpeeds> {
    let speeds: Vec<f64> = slides.iter().map(|slide| slide.speed_mm_s).collect::<Option<_>>()?;
    let slowest = speeds.iter().copied().fold(f64::INFINITY, f64::min);
    let fastest = speeds.iter().copied().fold(0.0, f64::max);
    // A file states integers. The conversion stops at the largest.
    KnownSpeeds::new(slowest.floor() as u16, fastest.ceil() as u16)
}

/// Applies a model file to slides.
fn trial(
    words: &[u32],
    tests: &[&LabeledSlide],
    labels: &[String],
    class_of: impl Fn(&LabeledSlide) -> usize,
) -> Result<Trial, String> {
    let model = Model::from_words(words).map_err(|error| error.to_string())?;
    let mut counts = vec![vec![0; labels.len() + 1]; labels.len()];
    for slide in tests {
        let answer = slide.numbers.as_deref().map_or(labels.len(), |sample| {
            let found = model.classification(&in_file_order(sample));
            if found.known == Some(false) { labels.len() } else { usize::from(found.class) }
        });
        counts[class_of(slide)][answer] += 1;
    }
    Ok(Trial { labels: labels.to_vec(), counts, groups: split::groups(tests) })
}

impl TrainedModel {
    /// Returns what was trained, in words.
    pub fn words(&self) -> String {
        format!("{} of {}", counted(self.slides, "slide"), counted(self.groups, "group"))
    }
}

#[cfg(test)]
mod tests;
