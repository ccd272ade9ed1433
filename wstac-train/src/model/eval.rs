//! Evaluation of a model: its answers on samples of a data set, next to the truth if that is known.

use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::path::Path;

use wstac_core::model::file::Task;
use wstac_core::model::{Classification, Model};
use wstac_core::params::{FEATURE_ONE, SAMPLE_FRAMES};

use super::npz::{Array, Npz};
use super::trained::{in_file_order, padded, vec_in_file_order};
pub use crate::dataset::arrays::array_of;
use crate::dataset::npz::rows_of;
use crate::dataset::recordings::Recording;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;

/// Largest number of samples in a data set whose samples are read one after the other.
const MOST_SAMPLES: u64 = 1 << 24;
/// Largest number of samples that are in memory at a time.
const MOST_KEPT: u64 = 1 << 18;
/// Bytes of memory that a number of a sample takes at most, with what is computed of it.
const BYTES_KEPT: usize = 16;
/// Most bytes of the labels of a data set, or of its other texts.
const MOST_TEXT: usize = 8 << 20;
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
    /// Whether each sample is known; `None` if the model does not tell. A row without a sample is not.
    pub known: Option<Vec<bool>>,
    /// Whether each row holds a sample: a row of zeros holds none, such as that of a slide without a velocity.
    pub has_sample: Vec<bool>,
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
    /// Numbers the labels of samples; `right` are those that are right for the classes.
    fn of(
        from: &str,
        right: Vec<String>,
        samples: impl IntoIterator<Item = Result<String, Error>>,
        too_many: impl Fn() -> Error,
    ) -> Result<Self, Error> {
        let (mut labels, mut known) = (Vec::new(), HashMap::new());
        let mut number = |label: String| {
            *known.entry(label).or_insert_with_key(|label| {
                labels.push(label.clone());
                labels.len() as u16 - 1
            })
        };
        let of_class = right.into_iter().map(&mut number).collect();
        let mut numbers = Vec::new();
        for label in samples {
            let this = number(label?);
            if usize::from(this) >= MOST_LABELS {
                return Err(too_many());
            }
            numbers.push(this);
        }
        Ok(Self { from: from.to_owned(), labels, numbers, of_class })
    }

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
    fn of(labels: Vec<String>, found: &[Classification], has_sample: Vec<bool>, truth: Option<Truth>) -> Self {
        let known = found.iter().zip(&has_sample).map(|(answer, has)| answer.known.map(|known| known && *has));
        Self {
            predictions: found.iter().map(|answer| answer.class).collect(),
            confidences: found.iter().map(|answer| answer.confidence).collect(),
            known: known.collect(),
            labels,
            has_sample,
            truth,
        }
    }

    /// Returns whether a row has an answer: it holds a sample, and the model does not say that it is unknown.
    pub fn is_answered(&self, row: usize) -> bool {
        let is_known = self.known.as_ref().is_none_or(|known| known.get(row) == Some(&true));
        is_known && self.has_sample.get(row) == Some(&true)
    }

    /// Returns the number of rows with an answer.
    pub fn answered(&self) -> usize {
        (0..self.predictions.len()).filter(|row| self.is_answered(*row)).count()
    }

    /// Returns the number of right answers. A row without an answer ([`Answers::is_answered`]) has no right one.
    pub fn right(&self) -> Option<usize> {
        let truth = self.truth.as_ref()?;
        let both = self.predictions.iter().zip(&truth.numbers).enumerate();
        let right = both.filter(|(row, (class, number))| {
            self.is_answered(*row) && truth.of_class.get(usize::from(**class)) == Some(*number)
        });
        Some(right.count())
    }
}

/// Computes a model's answers for the samples of an `.npz` file.
///
/// # Errors
/// The file cannot be used; the message names the part.
pub fn answers(model: &Model, path: &Path) -> Result<Answers, Error> {
    let npz = Npz::open(path)?;
    let (found, has_sample) = classifications(model, &npz)?;
    let labels = labels_of(model);
    let truth = truth(&npz, model.task(), &labels, found.len())?;
    Ok(Answers::of(labels, &found, has_sample, truth))
}

/// Computes a model's answers for all events of recordings, whose truth is their label specimen.
///
/// The recordings have their samples along the path ([`crate::dataset::recordings::read_paths`]) if the model takes
/// these. An event without such a sample is a row without one.
///
/// # Errors
/// The recordings have more different labels than can be counted.
pub fn answers_of_recordings(model: &Model, recordings: &[Recording]) -> Result<Answers, Error> {
    let task = model.task();
    let (mut found, mut has_sample, mut truth) = (Vec::new(), Vec::new(), Vec::new());
    for recording in recordings {
        for number in 0..recording.samples.len() {
            let sample = recording.sample(number, model.input());
            found.push(model.classification(&padded(sample.as_deref().unwrap_or_default())));
            has_sample.push(sample.is_some());
            truth.push(Ok(recording.label(task)));
        }
    }
    let labels = labels_of(model);
    let first = recordings.first().map_or("", |recording| recording.name.as_str());
    let too_many = || {
        let message = format_args!("and others have more than {MOST_LABELS} different labels; evaluate fewer at once");
        Error::new(ErrorKind::Data, first, message)
    };
    let truth = Truth::of("the label specimen", labels.clone(), truth, too_many)?;
    Ok(Answers::of(labels, &found, has_sample, Some(truth)))
}

/// Reads the samples that a model takes from an `.npz` file, with their true labels if they are known.
///
/// # Errors
/// The file cannot be used; the message names the part.
pub(crate) fn labeled(model: &Model, path: &Path) -> Result<(Vec<Vec<i16>>, Option<Truth>), Error> {
    let npz = Npz::open(path)?;
    let mut samples = samples(&npz, array_of(model.input()), 0)?;
    for sample in &mut samples {
        *sample = vec_in_file_order(sample);
    }
    let truth = truth(&npz, model.task(), &labels_of(model), samples.len())?;
    Ok((samples, truth))
}

/// Reads all samples of an array, of which there are `least` or more, in the order of the data set.
pub(crate) fn samples(npz: &Npz, name: &str, least: u64) -> Result<Vec<Vec<i16>>, Error> {
    let mut samples = Vec::with_capacity(kept(npz, name, least)?);
    each_sample(npz, name, least..=MOST_KEPT, |sample| samples.push(sample.to_vec()))?;
    Ok(samples)
}

/// Returns the names of a model's classes.
pub fn labels_of(model: &Model) -> Vec<String> {
    (0..model.labels().len()).filter_map(|class| model.labels().get(class)).map(|label| label.to_string()).collect()
}

/// Returns a model's answers, and whether each row holds a sample.
fn classifications(model: &Model, npz: &Npz) -> Result<(Vec<Classification>, Vec<bool>), Error> {
    let array = array_of(model.input());
    let n = opened(npz, array, &(0..=MOST_SAMPLES))?.1 as usize;
    let (mut found, mut has_sample) = (Vec::new(), Vec::new());
    let no_room = |_| npz.error(array, format_args!("not enough memory for {n} answers"));
    found.try_reserve_exact(n).and_then(|()| has_sample.try_reserve_exact(n)).map_err(no_room)?;
    each_sample(npz, array, 0..=MOST_SAMPLES, |sample| {
        found.push(model.classification(&in_file_order(sample)));
        has_sample.push(is_sample(sample));
    })?;
    Ok((found, has_sample))
}

/// Returns whether a row holds a sample. One of zeros holds none.
pub fn is_sample(row: &[i16]) -> bool {
    row.iter().any(|number| *number != 0)
}

/// Returns the number of samples of an array that are all kept in memory, of which there is enough.
fn kept(npz: &Npz, name: &str, least: u64) -> Result<usize, Error> {
    let n = opened(npz, name, &(least..=MOST_KEPT))?.1 as usize;
    let bytes = n.saturating_mul(BYTES_KEPT * SAMPLE_FRAMES * rows_of(name));
    let mut room = Vec::<u8>::new();
    // The room is asked for, although nothing is written to it.
    std::hint::black_box(&mut room).try_reserve_exact(bytes).map_err(|_| {
        let mb = bytes.div_ceil(1 << 20);
        npz.error(name, format_args!("{n} samples take up to {mb} MB of memory, expected at most what there is"))
    })?;
    Ok(n)
}

/// Passes every sample of an array to `give`, in the order of the data set.
///
/// Refuses a data set whose samples are of another scale, or that has another number of groups or splits.
fn each_sample(
    npz: &Npz,
    name: &str,
    expected: RangeInclusive<u64>,
    mut give: impl FnMut(&[i16]),
) -> Result<(), Error> {
    let (mut array, n) = opened(npz, name, &expected)?;
    let inputs = SAMPLE_FRAMES * rows_of(name);
    let (mut bytes, mut sample) = (vec![0; 2 * inputs], vec![0; inputs]);
    for _ in 0..n {
        array.read(&mut bytes).map_err(|error| npz.error(name, error))?;
        sample.iter_mut().zip(bytes.as_chunks().0).for_each(|(number, bytes)| *number = i16::from_le_bytes(*bytes));
        give(&sample);
    }
    Ok(())
}

/// Returns the value of `wstac dataset --input` that makes an array of samples.
fn input_of(array: &str) -> &'static str {
    match array {
        "X_path" => "path",
        "X_taxel_path" => "taxel-path",
        "X_taxels" => "taxels",
        _ => "frames",
    }
}

/// Opens an array of samples, and returns their number, too.
fn opened(npz: &Npz, name: &str, expected: &RangeInclusive<u64>) -> Result<(Array, u64), Error> {
    if !npz.names().any(|found| found == name) {
        let found = npz.names().collect::<Vec<_>>().join(", ");
        let help = format_args!("help: wstac dataset --input {} makes a set with it", input_of(name));
        return Err(npz.error(name, format_args!("is missing, found {found}; {help}")));
    }
    let array = npz.array(name)?;
    let rows = rows_of(name) as u64;
    let inputs = rows * SAMPLE_FRAMES as u64;
    let n = match array.shape[..] {
        [n, features, frames] if [features, frames] == [rows, SAMPLE_FRAMES as u64] => n,
        [n, found] if found == inputs => n,
        _ => {
            let found = &array.shape;
            return Err(npz.error(name, format_args!("shape {found:?}, expected (n, {rows}, 70) or (n, {inputs})")));
        }
    };
    if array.descr != "<i2" {
        let message = format!("type {}, expected <i2: int16 in units of 1/2048, as wstac dataset writes", array.descr);
        return Err(npz.error(name, message));
    }
    if !expected.contains(&n) {
        let (least, most) = (expected.start(), expected.end());
        let range = if *least == 0 { format!("at most {most}") } else { format!("{least} to {most}") };
        return Err(npz.error(name, format_args!("{}, expected {range}", counted(n, "sample"))));
    }
    check_scale(npz)?;
    for beside in ["sensor", "recording", "split"].into_iter().filter(|beside| npz.names().any(|name| name == *beside))
    {
        let shape = npz.array(beside)?.shape;
        if shape != [n] {
            return Err(npz.error(beside, format_args!("shape {shape:?}, expected ({n},) as of {name}")));
        }
    }
    Ok((array, n))
}

/// Refuses a data set whose array `scale` is not that of all models. Without the array, the samples have that scale.
fn check_scale(npz: &Npz) -> Result<(), Error> {
    const NAME: &str = "scale";
    if !npz.names().any(|name| name == NAME) {
        return Ok(());
    }
    let mut array = npz.array(NAME)?;
    let mut bytes = [0; 8];
    let found = match (array.shape.iter().all(|side| *side == 1), array.descr.as_str()) {
        (true, "<f8") => array.read(&mut bytes).map(|()| f64::from_le_bytes(bytes)),
        (true, "<f4") => {
            let mut bytes = [0; 4];
            array.read(&mut bytes).map(|()| f32::from_le_bytes(bytes).into())
        }
        _ => {
            let message = format_args!("type {} and shape {:?}, expected one float64", array.descr, array.shape);
            return Err(npz.error(NAME, message));
        }
    };
    let found = found.map_err(|error| npz.error(NAME, error))?;
    let expected = 1.0 / f64::from(FEATURE_ONE);
    if (found / expected - 1.0).abs() < 1e-6 {
        return Ok(());
    }
    Err(npz.error(NAME, format_args!("{found}, expected {expected} (1/{FEATURE_ONE}), the unit of samples")))
}

/// Returns the names of arrays that may have the labels of a task, the first that is there first.
pub(crate) fn label_arrays(task: Task) -> &'static [&'static str] {
    match task {
        Task::Pattern => &["y", "y_pattern"],
        Task::Depth => &["y", "y_depth"],
        // Specimens, and names of one's own.
        _ => &["y", "y_specimen"],
    }
}

/// Returns why a data set has no truth about a model's answers.
///
/// # Errors
/// The file cannot be read.
pub fn why_without_truth(model: &Model, path: &Path) -> Result<String, Error> {
    let npz = Npz::open(path)?;
    let arrays = label_arrays(model.task());
    let found = arrays.iter().find(|array| npz.names().any(|name| name == **array));
    Ok(found.map_or_else(
        || format!("there is no array {}", arrays.join(" or ")),
        |array| format!("array {array} has none of the model's labels"),
    ))
}

/// Reads the true labels from the first array that fits the model's task.
pub(super) fn truth(npz: &Npz, task: Task, classes: &[String], n: usize) -> Result<Option<Truth>, Error> {
    let has = |array: &str| npz.names().any(|name| name == array);
    if let Some(array) = label_arrays(task).iter().find(|array| has(array)) {
        let truth = compare(npz, array, classes.to_vec(), n)?;
        // Specimens are no truth about classes of other names, such as those of patterns that a trainer numbered.
        let is_of_classes = truth.numbers.iter().any(|number| truth.of_class.contains(number));
        return Ok(Some(truth).filter(|_| task != Task::Other || *array == "y" || is_of_classes));
    }
    let parts = ["y_pattern", "y_depth"].iter().zip([0, 1]).find(|(array, _)| task == Task::Specimen && has(array));
    let Some((array, part)) = parts else { return Ok(None) };
    let right = classes.iter().map(|label| pattern_and_depth(label)[part].to_owned());
    compare(npz, array, right.collect(), n).map(Some)
}

fn pattern_and_depth(label: &str) -> [&str; 2] {
    if label == "Sphere" { [label, ""] } else { label.split_at_checked(3).unwrap_or((label, "")).into() }
}

/// Reads the truth from an array, for classes whose right labels are `right`.
fn compare(npz: &Npz, name: &str, right: Vec<String>, n: usize) -> Result<Truth, Error> {
    let too_many = || npz.error(name, format_args!("expected at most {MOST_LABELS} different labels"));
    Truth::of(name, right, each_text(npz, name, n)?, too_many)
}

/// Reads an array with a text for each sample of another array; `None` if there is none.
pub(crate) fn beside(path: &Path, name: &str, samples: &str) -> Result<Option<Vec<String>>, Error> {
    let npz = Npz::open(path)?;
    if !npz.names().any(|found| found == name) {
        return Ok(None);
    }
    let n = npz.array(samples)?.shape.first().copied().unwrap_or(0).min(MOST_SAMPLES) as usize;
    texts(&npz, name, n).map(Some)
}

/// Reads an array of `n` elements as labels.
pub(crate) fn texts(npz: &Npz, name: &str, n: usize) -> Result<Vec<String>, Error> {
    let mut left = MOST_TEXT;
    let within = |text: Result<String, Error>| {
        let text = text?;
        left = left.checked_sub(text.len()).ok_or_else(|| {
            npz.error(name, format_args!("has more than {} MB of text; use shorter names", MOST_TEXT >> 20))
        })?;
        Ok(text)
    };
    each_text(npz, name, n)?.map(within).collect()
}

/// Opens an array of `n` elements, and returns them as labels one by one.
fn each_text(npz: &Npz, name: &str, n: usize) -> Result<impl Iterator<Item = Result<String, Error>>, Error> {
    let mut array = npz.array(name)?;
    if array.shape != [n as u64] {
        return Err(npz.error(name, format_args!("shape {:?}, expected ({n},) as of X", array.shape)));
    }
    let text = Text::of(&array).ok_or_else(|| {
        npz.error(name, format_args!("type {}, expected integers, float64 or text (<U)", array.descr))
    })?;
    let mut bytes = vec![0; text.bytes];
    Ok((0..n).map(move |_| {
        array.read(&mut bytes).map_err(|error| npz.error(name, error))?;
        text.read(&bytes).map_err(|error| npz.error(name, error))
    }))
}

/// The conversion of an element into a label: NumPy's letter for its kind, and its bytes.
struct Text {
    kind: char,
    bytes: usize,
}

impl Text {
    fn of(array: &Array) -> Option<Self> {
        let descr = array.descr.trim_start_matches(['<', '|']);
        let (kind, size) = descr.split_at_checked(1)?;
        let bytes = match (kind, size.parse().ok()?) {
            ("U", points @ 1..=LONGEST_LABEL) => 4 * points,
            ("i" | "u", bytes @ (1 | 2 | 4 | 8)) | ("b", bytes @ 1) | ("f", bytes @ 8) => bytes,
            _ => return None,
        };
        Some(Self { kind: kind.chars().next()?, bytes })
    }

    fn read(&self, bytes: &[u8]) -> Result<String, String> {
        if self.kind == 'U' {
            let points = bytes.as_chunks::<4>().0.iter().map(|point| u32::from_le_bytes(*point));
            let character = |point: u32| {
                let character = char::from_u32(point);
                character.ok_or_else(|| format!("is no text: it has U+{point:04X}, expected characters of Unicode"))
            };
            let text = points.map(character).collect::<Result<String, String>>()?;
            return Ok(text.trim_end_matches('\0').to_owned());
        }
        let negative = self.kind == 'i' && bytes.last().is_some_and(|byte| byte & 0x80 != 0);
        let mut eight = [if negative { 0xFF } else { 0 }; 8];
        eight[..self.bytes].copy_from_slice(bytes);
        Ok(match self.kind {
            'i' => i64::from_le_bytes(eight).to_string(),
            'f' => f64::from_le_bytes(eight).to_string(),
            _ => u64::from_le_bytes(eight).to_string(),
        })
    }
}
