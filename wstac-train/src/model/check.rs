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

#[cfg(test)]
mod tests {
    use super::super::trained::{Kind, Row, Trained, guess_task};
    use super::super::write::{Options, write};
    use super::*;

    /// Returns a model whose weights differ in size by `most`, and samples that its small weights decide.
    fn case(pairs: bool, most: f64) -> (Trained, CheckSet) {
        let row = |class: usize| Row {
            // A large weight of an input that never changes, and small ones that decide.
            weights: (0..INPUTS)
                .map(|input| if input == 0 { most } else { f64::from(input / 70 % 3 == class) })
                .collect(),
            bias: 2.0 * most,
        };
        let labels: Vec<String> = (0..3).map(|class| class.to_string()).collect();
        let mut rows: Vec<Row> = (0..3).map(row).collect();
        if pairs {
            rows = [[0, 1], [0, 2], [1, 2]].map(|[a, b]| difference(&rows[a], &rows[b], most)).into();
        }
        let kind = Kind::Linear(Linear { pairs, rows });
        let (task, input, inputs) = (guess_task(&labels), Input::Frames, INPUTS);
        let model = Trained { labels, task, input, inputs, speeds: None, kind, remarks: Vec::new(), mean: None };
        let sample = |number: usize| {
            std::array::from_fn(|input| match input {
                0 => -4096,
                _ => 100 * i16::from(input / 70 % 3 == number % 3),
            })
        };
        (model, CheckSet { name: "set.npz".into(), samples: (0..300).map(sample).collect() })
    }

    fn difference(first: &Row, second: &Row, most: f64) -> Row {
        let mut weights: Vec<f64> = first.weights.iter().zip(&second.weights).map(|(a, b)| a - b).collect();
        weights[0] = most;
        Row { weights, bias: 2.0 * most }
    }

    fn compared(model: &Trained, set: &CheckSet) -> Result<String, String> {
        let Kind::Linear(linear) = &model.kind else { unreachable!() };
        let words = write(model, "", Options::default()).unwrap().words;
        set.compare(linear, INPUTS, &Model::from_words(&words).unwrap())
    }

    #[test]
    fn changed_answers_are_counted_and_refused() {
        for pairs in [false, true] {
            let (model, set) = case(pairs, 10.0);
            let found = compared(&model, &set).unwrap();
            assert!(found.starts_with("rounded weights change 0 of 300 answers of set.npz (0.00 %)"), "{found}");
            // Small weights are rounded to 0: every answer is that of equal scores.
            let (model, set) = case(pairs, 1e6);
            let error = compared(&model, &set).unwrap_err();
            assert!(error.starts_with("rounded weights change 200 of 300 answers of set.npz (66.67 %)"), "{error}");
            assert!(error.contains("expected at most 0.5 %; help: "), "{error}");
        }
    }

    #[test]
    fn weights_that_all_classes_share_decide_nothing() {
        let (mut model, set) = case(false, 1e6);
        if let Kind::Linear(linear) = &mut model.kind {
            linear.drop_shared();
        }
        assert!(compared(&model, &set).unwrap().contains("change 0 of 300"));
    }

    #[test]
    fn with_a_mean_weights_below_a_unit_still_count() {
        let (mut model, set) = case(false, 1e5);
        assert!(compared(&model, &set).unwrap_err().contains("change 200 of 300"));
        model.mean = Some(set.mean(INPUTS));
        assert!(compared(&model, &set).unwrap().contains("change 0 of 300"));
    }
}
