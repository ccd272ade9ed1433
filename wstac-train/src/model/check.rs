//! Counts the answers of a linear model that its rounded weights change, on samples of a data set.

use std::path::Path;

use wstac_core::model::Model;
use wstac_core::model::file::{INPUTS, Input};
use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES};
use wstac_host::error::{Error, ErrorKind};

use super::eval::{MOST_KEPT, array_of, each_sample, is_sample, kept};
use super::npz::Npz;
use super::trained::{Linear, in_file_order};

/// Largest fraction of changed answers that is accepted.
const MOST_CHANGED: f64 = 0.005;

/// The samples of a data set, and its name.
pub(super) struct CheckSet {
    name: String,
    samples: Vec<[i16; INPUTS]>,
}

impl CheckSet {
    pub(super) fn read(path: &Path, input: Input) -> Result<Self, Error> {
        let (npz, array) = (Npz::open(path)?, array_of(input));
        let mut samples = Vec::with_capacity(kept(&npz, array, 1)?);
        each_sample(&npz, array, 1..=MOST_KEPT, |sample| samples.extend(is_sample(sample).then_some(*sample)))?;
        if samples.is_empty() {
            let message = format_args!("{array} has only zeros, expected samples to compare answers on");
            return Err(Error::new(ErrorKind::Data, path.display(), message));
        }
        Ok(Self { name: path.display().to_string(), samples })
    }

    /// Returns the mean of each input of a model.
    pub(super) fn mean(&self, inputs: usize) -> Vec<f64> {
        let mut mean = vec![0.0; inputs];
        for sample in &self.samples {
            mean.iter_mut().zip(features(sample, inputs)).for_each(|(sum, feature)| *sum += feature);
        }
        mean.iter().map(|sum| sum / self.samples.len() as f64).collect()
    }

    /// Compares the answers of a model before and after rounding, and returns how many differ.
    ///
    /// # Errors
    /// More than [`MOST_CHANGED`] of the answers differ.
    pub(super) fn compare(&self, linear: &Linear, inputs: usize, model: &Model) -> Result<String, String> {
        let (mut changed, mut margins) = (0, Vec::with_capacity(self.samples.len()));
        for sample in &self.samples {
            let (class, margin) = decide(linear, model.labels().len(), sample, inputs);
            changed += usize::from(class != usize::from(model.classify(&in_file_order(sample))));
            margins.push(margin);
        }
        margins.sort_unstable_by(f64::total_cmp);
        let (all, name, median) = (margins.len(), &self.name, margins.get(margins.len() / 2).unwrap_or(&0.0));
        let share = changed as f64 / all as f64;
        let found = format!(
            "rounded weights change {changed} of {all} answers of {name} ({:.2} %), whose median margin is {median:.2e}",
            100.0 * share
        );
        if share <= MOST_CHANGED {
            return Ok(found);
        }
        Err(format!(
            "{found}, expected at most {} %; help: import it with weights of int16, train it on X * scale without a \
             StandardScaler, with more regularization, or train trees",
            100.0 * MOST_CHANGED
        ))
    }
}

/// Returns the features of a sample that a model takes, in the order of its inputs.
fn features(sample: &[i16; INPUTS], inputs: usize) -> impl Iterator<Item = f64> {
    let frames = inputs / FEATURES;
    let rows = sample.chunks(SAMPLE_FRAMES).flat_map(move |row| row.iter().take(frames));
    rows.map(|&units| f64::from(units) / f64::from(FEATURE_ONE))
}

/// Returns the class by real numbers, and by how much it wins: its score over the next, or its closest pair.
fn decide(linear: &Linear, classes: usize, sample: &[i16; INPUTS], inputs: usize) -> (usize, f64) {
    let sum = |row: &super::trained::Row| {
        row.bias + row.weights.iter().zip(features(sample, inputs)).map(|(weight, x)| weight * x).sum::<f64>()
    };
    let sums: Vec<f64> = linear.rows.iter().map(sum).collect();
    // The first of equal scores wins.
    let best = |scores: &[f64]| (0..scores.len()).rev().max_by(|&a, &b| scores[a].total_cmp(&scores[b])).unwrap_or(0);
    if linear.pairs {
        let pairs =
            || (0..classes).flat_map(|first| (first + 1..classes).map(move |second| [first, second])).zip(&sums);
        let mut votes = vec![0.0; classes];
        pairs().for_each(|(pair, &sum)| votes[pair[usize::from(sum <= 0.0)]] += 1.0);
        let class = best(&votes);
        let of_class = pairs().filter(|(pair, _)| pair.contains(&class));
        return (class, of_class.fold(f64::INFINITY, |least, (_, sum)| least.min(sum.abs())));
    }
    let [sum] = sums[..] else {
        let class = best(&sums);
        let others = sums.iter().enumerate().filter(|(other, _)| *other != class);
        return (class, sums[class] - others.fold(f64::NEG_INFINITY, |most, (_, &sum)| most.max(sum)));
    };
    (if classes == 1 { 0 } else { usize::from(sum > 0.0) }, sum.abs())
}
