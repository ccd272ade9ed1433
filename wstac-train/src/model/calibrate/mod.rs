//! Calibration of a model: how sure an answer is, and whether a sample is like those of the training.
//!
//! [`calibrate`] needs samples of two sets: those of the training, and others that no model has seen, of other sensors
//! where possible. It writes a file that has the same answers as before.

mod factor;
mod lda;
mod sensors;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use wstac_core::model::Model;
use wstac_core::model::calibration::{CONFIDENCE_ONE, MOST_DIMENSIONS};
use wstac_core::model::file::{Input, crc};
use wstac_core::params::FEATURE_ONE;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;

use super::eval;
use super::trained::padded;
use crate::dataset::recordings::Recording;
pub(super) use factor::Scored;
pub use lda::Projection;

/// A unit of the projection in a file: the standard deviation within a class.
const UNIT: f64 = 64.0;
/// The flag of a file with a calibration, in its half 15.
const FLAG: u32 = 1 << 24;

/// Samples with labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabeledSamples {
    /// The numbers of each sample, in the order of a model file: frame by frame.
    pub numbers: Vec<Vec<i16>>,
    /// The number of each sample's label. For [`calibrate`] it is that of the model's class.
    pub labels: Vec<u16>,
    /// The labels' names.
    pub names: Vec<String>,
}

impl LabeledSamples {
    /// Reads the samples that a model takes from a data set, with the labels that fit its task.
    ///
    /// A sample of zeros only is left out: such a slide has no path. Labels that are those of classes have the class's
    /// number.
    ///
    /// # Errors
    /// The data set cannot be read, or has no labels.
    pub fn read(model: &Model, path: &Path) -> Result<Self, Error> {
        Self::read_where(model, path, |_| true)
    }

    /// Reads samples that tell how textures differ on one sensor, as [`LabeledSamples::read`] does.
    ///
    /// If the data set has the array `sensor`, what a sensor adds to the samples of all textures is taken from them:
    /// textures that are learned on a sensor are named on the same one.
    ///
    /// # Errors
    /// The data set cannot be read, or has no labels.
    pub fn read_for_one_sensor(model: &Model, path: &Path) -> Result<Self, Error> {
        let mut rows = Vec::new();
        let mut samples = Self::read_where(model, path, |row| {
            rows.push(row);
            true
        })?;
        if let Some(sensors) = eval::beside(path, "sensor", eval::array_of(model.input()))? {
            let sensors = rows.into_iter().filter_map(|row| sensors.get(row));
            let names: BTreeSet<&String> = sensors.clone().collect();
            let numbers: BTreeMap<&String, usize> = names.into_iter().zip(0..).collect();
            let sensors: Vec<usize> = sensors.filter_map(|sensor| numbers.get(sensor).copied()).collect();
            sensors::remove(&mut samples, &sensors);
        }
        Ok(samples)
    }

    /// Reads the samples for training and those for tests, by the array `split` of a data set, as
    /// [`LabeledSamples::read`] does.
    ///
    /// # Errors
    /// The data set cannot be read, or has no labels or no array `split`.
    pub fn read_split(model: &Model, path: &Path) -> Result<[Self; 2], Error> {
        let split = eval::beside(path, "split", eval::array_of(model.input()))?;
        let split = split.ok_or_else(|| {
            let message = "has no array split, whose values are train and test; give a second data set instead";
            Error::new(ErrorKind::Data, path.display(), message)
        })?;
        let of = |side: &str| Self::read_where(model, path, |row| split.get(row).is_some_and(|found| found == side));
        Ok([of("train")?, of("test")?])
    }

    /// Reads the samples of those rows that hold one and are wanted.
    fn read_where(model: &Model, path: &Path, mut is_wanted: impl FnMut(usize) -> bool) -> Result<Self, Error> {
        let (mut numbers, truth) = eval::labeled(model, path)?;
        let Some(truth) = truth else {
            let message = "has no labels, expected the array y, y_specimen, y_pattern or y_depth";
            return Err(Error::new(ErrorKind::Data, path.display(), message));
        };
        let eval::Truth { labels: names, numbers: mut labels, .. } = truth;
        // No second list of them: they may take most of the memory.
        let rows: Vec<bool> =
            numbers.iter().enumerate().map(|(row, numbers)| eval::is_sample(numbers) && is_wanted(row)).collect();
        let (mut of_labels, mut of_numbers) = (rows.iter(), rows.iter());
        labels.retain(|_| of_labels.next() == Some(&true));
        numbers.retain(|_| of_numbers.next() == Some(&true));
        Ok(Self { numbers, labels, names })
    }

    /// Returns the samples of recordings that a model of this input takes, with their specimens.
    ///
    /// The recordings have their samples along the path ([`crate::dataset::recordings::read_paths`]). Events without
    /// one are left out.
    pub fn of_recordings(recordings: &[Recording], input: Input) -> Self {
        let mut samples = Self::default();
        for recording in recordings {
            let events = 0..recording.samples.len();
            let found: Vec<Vec<i16>> = events.filter_map(|event| recording.sample(event, input)).collect();
            let labels = vec![0; found.len()];
            samples.append(Self { numbers: found, labels, names: vec![recording.specimen.clone()] });
        }
        samples
    }

    /// Appends samples; labels of the same name become one.
    pub fn append(&mut self, other: Self) {
        let number = |name: String| {
            self.names.iter().position(|own| *own == name).unwrap_or_else(|| {
                self.names.push(name);
                self.names.len() - 1
            }) as u16
        };
        let numbers: Vec<u16> = other.names.into_iter().map(number).collect();
        if self.numbers.is_empty() {
            self.numbers = other.numbers;
        } else {
            self.numbers.extend(other.numbers);
        }
        self.labels.extend(other.labels.iter().filter_map(|&label| numbers.get(usize::from(label))));
    }

    /// Returns the samples of labels below `classes`.
    #[must_use]
    fn of_classes(&self, classes: usize) -> Self {
        let known = |label: &&u16| usize::from(**label) < classes;
        let both = self.numbers.iter().zip(&self.labels).filter(|(_, label)| known(label));
        let (numbers, labels) = both.map(|(numbers, &label)| (numbers.clone(), label)).unzip();
        Self { numbers, labels, names: self.names.iter().take(classes).cloned().collect() }
    }
}

/// Returns the sensors that two data sets have in common, by their arrays `sensor`; none if one has no such array.
///
/// # Errors
/// A data set cannot be read.
pub fn sensors_in_common(one: &Path, other: &Path, input: Input) -> Result<BTreeSet<String>, Error> {
    let sensors = |path| Ok(eval::beside(path, "sensor", eval::array_of(input))?.unwrap_or_default());
    let one: BTreeSet<String> = sensors(one)?.into_iter().collect();
    Ok(sensors(other)?.into_iter().filter(|sensor| one.contains(sensor)).collect())
}

/// The settings of a calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The most dimensions of the projection: 0 to [`MOST_DIMENSIONS`]. With 0 the file does not tell what is unknown.
    pub dimensions: usize,
    /// The fraction of known samples that may be taken for unknown.
    pub rejected: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { dimensions: MOST_DIMENSIONS, rejected: 0.02 }
    }
}

/// A calibrated model file.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// The file's words.
    pub words: Vec<u32>,
    /// The calibration alone, as [`with_part`] takes it.
    pub(crate) part: Vec<u16>,
    /// The dimensions of its projection; 0 without one.
    pub dimensions: usize,
    /// Whether each class has a limit of its own of what is known. Classes have one in common where one of them has
    /// too few held-out samples with a right answer: [`Settings::rejected`] of them must be a sample or more.
    pub has_own_limits: bool,
    /// Its answers about the samples that were held out.
    pub held_out: Quality,
}

/// The answers of a calibrated model for samples whose classes are known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// The number of samples.
    pub samples: usize,
    /// The fraction of samples with a right answer. One that is said to be unknown has none.
    pub accuracy: f64,
    /// The expected calibration error: the mean difference between confidence and accuracy, over 15 ranges of
    /// confidence.
    pub calibration_error: f64,
    /// The fraction of samples that are known; `None` if the model does not tell.
    pub known: Option<f64>,
}

impl Quality {
    /// Evaluates a model on samples of its classes; of a sample of another label, every answer is wrong.
    pub fn of(model: &Model, samples: &LabeledSamples) -> Self {
        let mut answers = Vec::with_capacity(samples.numbers.len());
        let (mut right, mut known) = (0, 0);
        for (numbers, &label) in samples.numbers.iter().zip(&samples.labels) {
            let found = model.classification(&padded(numbers));
            let is_right = u16::from(found.class) == label;
            let confidence = f64::from(found.confidence.unwrap_or(0)) / f64::from(CONFIDENCE_ONE);
            answers.push((confidence, is_right));
            right += usize::from(is_right && found.known != Some(false));
            known += usize::from(found.known == Some(true));
        }
        let n = samples.numbers.len().max(1) as f64;
        Self {
            samples: samples.numbers.len(),
            accuracy: right as f64 / n,
            calibration_error: calibration_error(answers),
            known: model.tells_unknown().then(|| known as f64 / n),
        }
    }
}

/// Returns the expected calibration error of answers, each with its confidence and whether it is right: the mean
/// difference between confidence and accuracy, over 15 ranges of confidence. Without answers it is 0.
pub fn calibration_error(answers: impl IntoIterator<Item = (f64, bool)>) -> f64 {
    const RANGES: usize = 15;
    let mut sums = [(0.0, 0.0); RANGES];
    let mut n = 0_usize;
    for (confidence, is_right) in answers {
        let range = &mut sums[((confidence * RANGES as f64) as usize).min(RANGES - 1)];
        range.0 += confidence;
        range.1 += f64::from(u8::from(is_right));
        n += 1;
    }
    sums.iter().map(|(confidence, right)| (confidence - right).abs()).sum::<f64>() / n.max(1) as f64
}

/// Calibrates a model file by samples of its training and by samples that were held out of it.
///
/// A file that has a calibration gets a new one. Labels are the numbers of classes; samples of others are left out.
///
/// # Errors
/// The file is no model, or there are too few samples.
pub fn calibrate(
    words: &[u32],
    trained: &LabeledSamples,
    held_out: &LabeledSamples,
    settings: Settings,
) -> Result<Calibrated, String> {
    let model = Model::from_words(words).map_err(|error| error.to_string())?;
    let trained = trained.of_classes(model.labels().len());
    let projection = if settings.dimensions > 0 && model.labels().len() > 1 {
        Some(Projection::of(&trained, inputs_of(&model), settings.dimensions.min(MOST_DIMENSIONS))?)
    } else {
        None
    };
    calibrate_with(words, projection.as_ref(), &trained, held_out, settings)
}

/// Calibrates a model file with a projection that was made elsewhere, such as that of many more textures.
///
/// # Errors
/// The file is no model, or there are too few samples.
pub fn calibrate_with(
    words: &[u32],
    projection: Option<&Projection>,
    trained: &LabeledSamples,
    held_out: &LabeledSamples,
    settings: Settings,
) -> Result<Calibrated, String> {
    let plain = without(words)?;
    let model = Model::from_words(&plain).map_err(|error| error.to_string())?;
    let classes = model.labels().len();
    let held_out = held_out.of_classes(classes);
    if held_out.numbers.len() < 2 * classes {
        let found = counted(held_out.numbers.len(), "sample");
        return Err(format!("has {found} of the model's classes, expected at least {}", 2 * classes));
    }
    let mut scored = Scored::default();
    for (numbers, &label) in held_out.numbers.iter().zip(&held_out.labels) {
        let mut scores = Vec::with_capacity(classes);
        model.each_score(&padded(numbers), |_, score| scores.push(score));
        scored.scores.push(scores);
        scored.truth.push(usize::from(label));
    }
    let factor = scored.factor()?;
    let Some(projection) = projection else {
        return finished(&plain, part(factor, None), 0, false, &held_out);
    };
    let known = trained.numbers.iter().zip(&trained.labels).filter(|(_, label)| usize::from(**label) < classes);
    let places = known.map(|(numbers, &label)| (projection.place(numbers).into_iter(), label));
    let (means, counts) = lda::means(places, classes, projection.biases.len());
    if let Some(class) = counts.iter().position(|&count| count == 0) {
        let name = model.labels().get(class).map_or_else(String::new, |label| label.to_string());
        return Err(format!("no sample of class {name}, expected some of every class"));
    }
    let mut distances: Vec<Vec<f64>> = vec![Vec::new(); classes];
    // A wrong answer tells nothing about slides of its class.
    let right = |(numbers, label): &(&Vec<i16>, &u16)| u16::from(model.classify(&padded(numbers))) == **label;
    for (numbers, &class) in held_out.numbers.iter().zip(&held_out.labels).filter(right) {
        let mean = &means[usize::from(class)];
        let distance = projection.place(numbers).iter().zip(mean).map(|(a, b)| (a - b).powi(2)).sum();
        distances[usize::from(class)].push(distance);
    }
    if distances.iter().all(Vec::is_empty) {
        return Err("has no sample whose answer is right, expected slides of the model's classes".into());
    }
    let limit = |mut distances: Vec<f64>| {
        distances.sort_by(f64::total_cmp);
        let place = ((1.0 - settings.rejected) * distances.len() as f64).ceil() as usize;
        let threshold = distances[place.clamp(1, distances.len()) - 1];
        (threshold * UNIT * UNIT).ceil().min(f64::from(u32::MAX)) as u32
    };
    // Samples of some classes differ more than those of others. A few samples do not tell how much.
    let are_enough = distances.iter().all(|own| own.len() as f64 * settings.rejected >= 1.0);
    let limits = if are_enough {
        Limits::Own(distances.into_iter().map(limit).collect())
    } else {
        Limits::Common(limit(distances.concat()))
    };
    let dimensions = projection.biases.len();
    let known = KnownRegion { projection, means: &means, limits };
    finished(&plain, part(factor, Some(&known)), dimensions, are_enough, &held_out)
}

/// Returns a file with this calibration, and its quality.
fn finished(
    plain: &[u32],
    part: Vec<u16>,
    dimensions: usize,
    has_own_limits: bool,
    held_out: &LabeledSamples,
) -> Result<Calibrated, String> {
    let words = with_part(plain, &part)?;
    let model = Model::from_words(&words).map_err(|error| error.to_string())?;
    let held_out = Quality::of(&model, held_out);
    Ok(Calibrated { words, part, dimensions, has_own_limits, held_out })
}

/// Returns the projection of a model file.
///
/// The numbers are those of the file, so they are rounded.
///
/// # Errors
/// The file is no model, or does not tell what is unknown.
pub fn projection_of(words: &[u32]) -> Result<Projection, String> {
    let model = Model::from_words(words).map_err(|error| error.to_string())?;
    if !model.tells_unknown() {
        return Err("has no projection, expected a calibrated model, such as builtin:embedding".into());
    }
    let inputs = inputs_of(&model);
    let labels = words[6] as usize / 2;
    let half = |at: usize| (words[at / 2] >> (16 * (at % 2))) as u16;
    let start = 2 * (words[labels - 1] as usize).div_ceil(2);
    let dimensions = usize::from(half(start + 3));
    let unit = 1.0 / (UNIT * f64::from(half(start + 4)).exp2());
    let rows = start + 8;
    let bias = |row: usize| {
        let halves = (0..4).map(|k| u64::from(half(rows + 4 * row + k)) << (16 * k));
        halves.sum::<u64>().cast_signed() as f64 * unit
    };
    let weight = |row: usize, input: usize| {
        // The words of a block's rows take turns.
        let in_block = if row / 2 * 2 + 1 < dimensions { 2 } else { 1 };
        let block = rows + 4 * dimensions + row / 2 * 2 * inputs;
        let at = block + 2 * (input / 2 * in_block + row % 2) + input % 2;
        f64::from(half(at).cast_signed()) * unit * f64::from(FEATURE_ONE)
    };
    let weights = (0..dimensions).map(|row| (0..inputs).map(|input| weight(row, input)).collect()).collect();
    Ok(Projection { weights, biases: (0..dimensions).map(bias).collect() })
}

/// Returns the number of inputs that a model reads.
pub fn inputs_of(model: &Model) -> usize {
    usize::from(model.frames()) * wstac_core::params::FEATURES
}

/// The means and limits that tell a known sample from an unknown one.
pub(super) struct KnownRegion<'a> {
    pub(super) projection: &'a Projection,
    /// The classes' places in the projection.
    pub(super) means: &'a [Vec<f64>],
    /// The largest squared distance of a known sample, in units of a file.
    pub(super) limits: Limits,
}

/// The largest squared distance of a known sample, in units of a file.
pub(super) enum Limits {
    /// One for all classes.
    Common(u32),
    /// One for each class.
    Own(Vec<u32>),
}

impl Limits {
    /// Returns the largest limit.
    fn most(&self) -> u32 {
        match self {
            Self::Common(limit) => *limit,
            Self::Own(limits) => limits.iter().copied().max().unwrap_or(0),
        }
    }
}

/// Returns the halves of a calibration.
pub(super) fn part(factor: f64, known: Option<&KnownRegion<'_>>) -> Vec<u16> {
    let mut halves = factor::halves(factor).to_vec();
    let Some(KnownRegion { projection, means, limits }) = known else {
        halves.push(0);
        return halves;
    };
    let dimensions = projection.biases.len();
    let largest = projection.weights.iter().flatten().map(|weight| weight.abs()).fold(f64::MIN_POSITIVE, f64::max);
    // A unit of a weight is that of the place over that of an input.
    let whole = UNIT / f64::from(FEATURE_ONE);
    let shift = (f64::from(i16::MAX) / (largest * whole)).log2().floor().clamp(1.0, 40.0);
    let fixed = |x: f64| (x * shift.exp2()).round();
    let halves_of = |limit: u32| [limit as u16, (limit >> 16) as u16];
    let has_own = u16::from(matches!(limits, Limits::Own(_)));
    halves.extend([dimensions as u16, shift as u16, has_own]);
    halves.extend(halves_of(limits.most()));
    for bias in &projection.biases {
        let bias = fixed(bias * UNIT) as i64;
        halves.extend((0..4).map(|half| (bias >> (16 * half)) as u16));
    }
    let weight = |row: &[f64], input: usize| (fixed(row[input] * whole) as i16).cast_unsigned();
    for block in projection.weights.chunks(2) {
        for pair in 0..block[0].len() / 2 {
            halves.extend(block.iter().flat_map(|row| [weight(row, 2 * pair), weight(row, 2 * pair + 1)]));
        }
    }
    for mean in *means {
        halves.extend(mean.iter().map(|place| ((place * UNIT).round() as i16).cast_unsigned()));
        halves.resize(halves.len().next_multiple_of(2), 0);
    }
    if let Limits::Own(limits) = limits {
        halves.extend(limits.iter().flat_map(|limit| halves_of(*limit)));
    }
    halves
}

/// Returns a file without its calibration.
///
/// # Errors
/// The file is no model.
pub fn without(words: &[u32]) -> Result<Vec<u32>, String> {
    let model = Model::from_words(words).map_err(|error| error.to_string())?;
    if !model.is_calibrated() {
        return Ok(words.to_vec());
    }
    rebuilt(&model, words, words[words[6] as usize / 2 - 1], None)
}

/// Returns a file without calibration with this one.
pub(crate) fn with_part(words: &[u32], part: &[u16]) -> Result<Vec<u32>, String> {
    let model = Model::from_words(words).map_err(|error| error.to_string())?;
    let words = rebuilt(&model, words, words[6], Some(part))?;
    Model::from_words(&words).map_err(|error| format!("cannot be calibrated: {error}"))?;
    Ok(words)
}

/// Returns a file with its content up to the half `end`, this calibration behind it, if there is one, and its labels
/// and training facts.
fn rebuilt(model: &Model, words: &[u32], end: u32, part: Option<&[u16]>) -> Result<Vec<u32>, String> {
    let mut bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let labels = model.labels();
    let names = (0..labels.len()).filter_map(|class| labels.get(class)).map(|label| 1 + label.bytes().len());
    // Without the padding behind them.
    let length = names.sum::<usize>() + 2 + labels.training().bytes().len();
    let text = bytes[2 * words[6] as usize..][..length].to_vec();
    bytes.truncate(2 * end as usize);
    if let Some(part) = part {
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        bytes.extend(part.iter().flat_map(|half| half.to_le_bytes()));
        bytes.extend(end.to_le_bytes());
    }
    let start = u32::try_from(bytes.len() / 2).map_err(|_| "expected a model below 8 GiB")?;
    bytes.extend(text);
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let mut words: Vec<u32> = bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    words[6] = start;
    words[7] = if part.is_some() { words[7] | FLAG } else { words[7] & !FLAG };
    words[2] = words.len() as u32;
    words[1] = crc(&words);
    Ok(words)
}

#[cfg(test)]
mod tests;
