//! Evaluation of a model: its answers on samples of a data set, next to the truth if that is known.

use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::path::Path;

use wstac_core::model::file::{INPUTS, Input, Task};
use wstac_core::model::{Classification, Model};
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};

use super::npz::{Array, Npz};
use super::trained::in_file_order;
use wstac_host::error::Error;

/// Largest number of samples in a data set.
const MOST_SAMPLES: u64 = 1 << 24;
/// Largest number of different labels.
const MOST_LABELS: usize = 1024;
/// Longest label, in code points.
const LONGEST_LABEL: usize = 1024;

/// A model's answers.
#[derive(Clone, Debug)]
pub struct Answers {
    /// Labels of the model's classes.
    pub labels: Vec<String>,
    /// A class for each sample.
    pub predictions: Vec<u8>,
    /// The confidence of each answer in units of 2^-15; `None` for a model without a calibration.
    pub confidences: Option<Vec<u16>>,
    /// Whether each sample is known; `None` if the model does not tell.
    pub known: Option<Vec<bool>>,
    /// The truth, if it is known.
    pub truth: Option<Truth>,
}

/// The true labels of samples.
#[derive(Clone, Debug)]
pub struct Truth {
    /// The arrays that hold them.
    pub from: String,
    /// Labels, those of the model's classes first.
    pub labels: Vec<String>,
    /// The number of a label for each sample.
    pub numbers: Vec<u16>,
    /// For each class, the number of the label that is right for it.
    pub of_class: Vec<u16>,
}

impl Truth {
    /// Returns the labels of samples that are right for no class, and the number of those samples.
    pub fn of_no_class(&self) -> (Vec<&str>, usize) {
        let mut counts = vec![0; self.labels.len()];
        for &number in self.numbers.iter().filter(|number| !self.of_class.contains(number)) {
            if let Some(count) = counts.get_mut(usize::from(number)) {
                *count += 1;
            }
        }
        let labels = self.labels.iter().zip(&counts).filter(|(_, count)| **count > 0);
        (labels.map(|(label, _)| label.as_str()).collect(), counts.iter().sum())
    }
}

impl Answers {
    /// Returns the number of right answers.
    pub fn right(&self) -> Option<usize> {
        let truth = self.truth.as_ref()?;
        let both = self.predictions.iter().zip(&truth.numbers);
        Some(
            both.filter(|(class, truth_number)| truth.of_class.get(usize::from(**class)) == Some(*truth_number))
                .count(),
        )
    }
}

/// Computes a model's answers for the samples of an `.npz` file.
///
/// # Errors
/// The file cannot be used; the message names the part.
pub fn answers(model: &Model, path: &Path) -> Result<Answers, Error> {
    let npz = Npz::open(path)?;
    let found = classifications(model, &npz)?;
    let predictions: Vec<u8> = found.iter().map(|answer| answer.class).collect();
    let labels = labels_of(model);
    let truth = truth(&npz, model.task(), &labels, predictions.len())?;
    let confidences = found.iter().map(|answer| answer.confidence).collect();
    let known = found.iter().map(|answer| answer.known).collect();
    Ok(Answers { labels, predictions, confidences, known, truth })
}

/// Returns the name of the array that holds the samples for a model.
pub fn array_of(input: Input) -> &'static str {
    match input {
        Input::Path => "X_path",
        Input::TaxelPath => "X_taxel_path",
        _ => "X",
    }
}

/// Reads the samples that a model takes from an `.npz` file, with their true labels if they are known.
///
/// # Errors
/// The file cannot be used; the message names the part.
pub(crate) fn labeled(model: &Model, path: &Path) -> Result<(Vec<[i16; INPUTS]>, Option<Truth>), Error> {
    let npz = Npz::open(path)?;
    let mut samples = Vec::new();
    of_model(model, &npz, |sample| samples.push(*sample))?;
    let truth = truth(&npz, model.task(), &labels_of(model), samples.len())?;
    Ok((samples, truth))
}

fn labels_of(model: &Model) -> Vec<String> {
    (0..model.labels().len()).filter_map(|class| model.labels().get(class)).map(|label| label.to_string()).collect()
}

fn classifications(model: &Model, npz: &Npz) -> Result<Vec<Classification>, Error> {
    let mut found = Vec::new();
    of_model(model, npz, |sample| found.push(model.classification(sample)))?;
    Ok(found)
}

/// Passes every sample that a model takes to `give`, in the order of a model file.
fn of_model(model: &Model, npz: &Npz, mut give: impl FnMut(&[i16; INPUTS])) -> Result<(), Error> {
    each_sample(npz, array_of(model.input()), 0..=MOST_SAMPLES, |sample| give(&in_file_order(sample)))
}

/// Passes every sample of an array to `give`, in the order of the data set.
pub(crate) fn each_sample(
    npz: &Npz,
    name: &str,
    expected: RangeInclusive<u64>,
    mut give: impl FnMut(&[i16; INPUTS]),
) -> Result<(), Error> {
    let mut array = npz.array(name)?;
    let n = match array.shape[..] {
        [n, features, frames] if features == FEATURES as u64 && frames == SAMPLE_FRAMES as u64 => n,
        [n, inputs] if inputs == INPUTS as u64 => n,
        _ => return Err(npz.error(name, format_args!("shape {:?}, expected (n, 10, 70) or (n, 700)", array.shape))),
    };
    if array.descr != "<i2" {
        let message = format!("type {}, expected <i2: int16 in units of 1/2048, as wstac dataset writes", array.descr);
        return Err(npz.error(name, message));
    }
    if !expected.contains(&n) {
        let (least, most) = expected.into_inner();
        let range = if least == 0 { format!("at most {most}") } else { format!("{least} to {most}") };
        return Err(npz.error(name, format_args!("{n} samples, expected {range}")));
    }
    let mut bytes = [0; 2 * INPUTS];
    let mut sample = [0; INPUTS];
    for _ in 0..n {
        array.read(&mut bytes).map_err(|error| npz.error(name, error))?;
        sample.iter_mut().zip(bytes.as_chunks().0).for_each(|(number, bytes)| *number = i16::from_le_bytes(*bytes));
        give(&sample);
    }
    Ok(())
}

/// Returns the names of arrays that may have the labels of a task, the first that is there first.
pub(crate) fn label_arrays(task: Task) -> &'static [&'static str] {
    match task {
        Task::Specimen => &["y", "y_specimen"],
        Task::Pattern => &["y", "y_pattern"],
        Task::Depth => &["y", "y_depth"],
        _ => &["y"],
    }
}

/// Reads the true labels from the first array that fits the model's task.
fn truth(npz: &Npz, task: Task, classes: &[String], n: usize) -> Result<Option<Truth>, Error> {
    let has = |array: &str| npz.names().any(|name| name == array);
    if let Some(array) = label_arrays(task).iter().find(|array| has(array)) {
        return compare(npz, array, classes.to_vec(), n).map(Some);
    }
    if task == Task::Specimen && has("y_pattern") {
        let patterns = classes.iter().map(|label| pattern_and_depth(label).0.to_owned()).collect();
        return compare(npz, "y_pattern", patterns, n).map(Some);
    }
    if task == Task::Specimen && has("y_depth") {
        let depths = classes.iter().map(|label| pattern_and_depth(label).1.to_owned()).collect();
        return compare(npz, "y_depth", depths, n).map(Some);
    }
    Ok(None)
}

/// Returns a specimen's pattern and depth.
fn pattern_and_depth(label: &str) -> (&str, &str) {
    if label == "Sphere" { (label, "") } else { label.split_at_checked(3).unwrap_or((label, "")) }
}

/// Reads the truth from an array, for classes whose right labels are `right`.
fn compare(npz: &Npz, name: &str, right: Vec<String>, n: usize) -> Result<Truth, Error> {
    let mut array = npz.array(name)?;
    if array.shape != [n as u64] {
        return Err(npz.error(name, format_args!("shape {:?}, expected ({n},) as of X", array.shape)));
    }
    let (mut labels, mut known) = (Vec::new(), HashMap::new());
    let mut number = |label: String| {
        *known.entry(label).or_insert_with_key(|label| {
            labels.push(label.clone());
            labels.len() as u16 - 1
        })
    };
    let of_class = right.into_iter().map(&mut number).collect();
    let text = Text::of(&array).ok_or_else(|| {
        npz.error(name, format_args!("type {}, expected integers, float64 or text (<U)", array.descr))
    })?;
    let mut bytes = vec![0; text.bytes()];
    let mut numbers = Vec::new();
    for _ in 0..n {
        array.read(&mut bytes).map_err(|error| npz.error(name, error))?;
        let this = number(text.read(&bytes));
        if usize::from(this) >= MOST_LABELS {
            return Err(npz.error(name, format_args!("expected at most {MOST_LABELS} different labels")));
        }
        numbers.push(this);
    }
    Ok(Truth { from: name.to_owned(), labels, numbers, of_class })
}

/// Reads an array of `n` elements as labels.
pub(crate) fn texts(npz: &Npz, name: &str, n: usize) -> Result<Vec<String>, Error> {
    let mut array = npz.array(name)?;
    if array.shape != [n as u64] {
        return Err(npz.error(name, format_args!("shape {:?}, expected ({n},) as of X", array.shape)));
    }
    let text = Text::of(&array).ok_or_else(|| {
        npz.error(name, format_args!("type {}, expected integers, float64 or text (<U)", array.descr))
    })?;
    let mut bytes = vec![0; text.bytes()];
    let read = (0..n).map(|_| {
        array.read(&mut bytes).map_err(|error| npz.error(name, error))?;
        Ok(text.read(&bytes))
    });
    read.collect()
}

/// The conversion of an element into a label.
enum Text {
    Unicode(usize),
    Integer { bytes: usize, signed: bool },
    Float,
}

impl Text {
    fn of(array: &Array) -> Option<Self> {
        let descr = array.descr.trim_start_matches(['<', '|']);
        let (kind, size) = descr.split_at_checked(1)?;
        let size: usize = size.parse().ok()?;
        match (kind, size) {
            ("U", 1..=LONGEST_LABEL) => Some(Self::Unicode(size)),
            ("i" | "u", 1 | 2 | 4 | 8) => Some(Self::Integer { bytes: size, signed: kind == "i" }),
            ("b", 1) => Some(Self::Integer { bytes: 1, signed: false }),
            ("f", 8) => Some(Self::Float),
            _ => None,
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Unicode(points) => 4 * points,
            Self::Integer { bytes, .. } => *bytes,
            Self::Float => 8,
        }
    }

    fn read(&self, bytes: &[u8]) -> String {
        let mut eight = [0; 8];
        match self {
            Self::Unicode(_) => {
                let points = bytes.as_chunks::<4>().0.iter().map(|point| u32::from_le_bytes(*point));
                let characters = points.map(|point| char::from_u32(point).unwrap_or(char::REPLACEMENT_CHARACTER));
                let text: String = characters.collect();
                text.trim_end_matches('\0').to_owned()
            }
            Self::Integer { bytes: count, signed } => {
                let negative = *signed && bytes.last().is_some_and(|byte| byte & 0x80 != 0);
                eight.fill(if negative { 0xFF } else { 0 });
                eight[..*count].copy_from_slice(bytes);
                if *signed { i64::from_le_bytes(eight).to_string() } else { u64::from_le_bytes(eight).to_string() }
            }
            Self::Float => {
                eight.copy_from_slice(bytes);
                f64::from_le_bytes(eight).to_string()
            }
        }
    }
}
