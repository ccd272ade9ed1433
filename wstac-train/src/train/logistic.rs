//! Multinomial logistic regression with an L2 penalty: one weighted sum for each class.
//!
//! The crate argmin (0.11, MIT or Apache-2.0) finds the minimum with L-BFGS and the line search of Moré and Thuente.
//! The loss is here, because the libraries that bring their own do not train these samples (390 inputs, 10 classes):
//!
//! - linfa-logistic 0.8.1 takes the logarithm of a sum of exponentials with the largest score of all samples, so that
//!   it is lost for samples with small scores. Its line search ends early: 62 % right of 3000 slides after 4000 slides,
//!   where scikit-learn 1.9 has 96 %.
//! - smartcore 0.7.0 runs on one thread, with up to 1000 iterations that cannot be limited. In a test build it did not
//!   finish 4000 slides within 2 minutes, where this takes 24 seconds.
//!
//! With 12000 slides along the path, 300 iterations name 98.7 % (penalty 0.1) and 99.0 % (0.02) of 3000 slides of other
//! sensors, where scikit-learn's `LinearSVC(C=1)` names 97.9 % and its `LogisticRegression(C=10)` 98.0 %.
//!
//! Sums run over blocks of samples of a fixed size, and blocks are added in order. So any number of threads gives the
//! same weights.

use std::sync::Mutex;

use argmin::core::{CostFunction, Error as Failure, Executor, Gradient, State};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use rayon::prelude::*;

use crate::model::trained::{Linear, Row};

/// Samples of a block.
const BLOCK: usize = 256;
/// Steps that L-BFGS remembers.
const MEMORY: usize = 10;
/// Smallest scale of an input: one that hardly changes is not made large.
const LEAST_SCALE: f64 = 0.05;

/// Samples with their classes.
pub(super) struct Samples<'s> {
    /// Number of inputs of a sample.
    pub(super) inputs: usize,
    /// The inputs of all samples, one sample after the other.
    pub(super) numbers: &'s [f32],
    /// A class for each sample.
    pub(super) classes: &'s [u8],
    /// Number of classes.
    pub(super) count: usize,
}

/// Limits of the fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Factor of half the sum of all squared weights; the loss is a sum over samples.
    pub(super) penalty: f64,
    pub(super) iterations: u64,
}

/// Fits the weights.
///
/// Inputs are centered and scaled for the optimizer, and the scale is part of the weights afterwards. The penalty is on
/// the weights of the unscaled inputs.
pub(super) fn fit(samples: &Samples<'_>, limits: Limits) -> Result<Linear, String> {
    let (inputs, count) = (samples.inputs, samples.count);
    let (means, scales) = means_and_scales(samples);
    let mut numbers = samples.numbers.to_vec();
    for sample in numbers.chunks_mut(inputs) {
        for ((number, mean), scale) in sample.iter_mut().zip(&means).zip(&scales) {
            *number = ((f64::from(*number) - mean) / scale) as f32;
        }
    }
    let penalties = scales.iter().map(|scale| limits.penalty / (scale * scale)).collect();
    let problem = Problem {
        inputs,
        count,
        numbers,
        classes: samples.classes,
        penalties,
        last: Mutex::new((Vec::new(), 0.0, Vec::new())),
    };
    let solver = LBFGS::new(MoreThuenteLineSearch::new(), MEMORY);
    let executor = Executor::new(problem, solver)
        .configure(|state| state.param(vec![0.0; (inputs + 1) * count]).max_iters(limits.iterations));
    let result = executor.run().map_err(|error| format!("the optimizer failed: {error}"))?;
    let best = result.state().get_best_param().ok_or("the optimizer found no weights")?;
    let row = |class: usize| {
        let weights: Vec<f64> = (0..inputs).map(|input| best[input * count + class] / scales[input]).collect();
        let shift: f64 = weights.iter().zip(&means).map(|(weight, mean)| weight * mean).sum();
        Row { weights, bias: best[inputs * count + class] - shift }
    };
    Ok(Linear { pairs: false, rows: (0..count).map(row).collect() })
}

/// Returns the mean of every input, and its standard deviation.
fn means_and_scales(samples: &Samples<'_>) -> (Vec<f64>, Vec<f64>) {
    let n = samples.classes.len().max(1) as f64;
    let mut sums = vec![[0.0_f64; 2]; samples.inputs];
    for sample in samples.numbers.chunks(samples.inputs) {
        for ([sum, squares], number) in sums.iter_mut().zip(sample) {
            *sum += f64::from(*number);
            *squares += f64::from(*number) * f64::from(*number);
        }
    }
    let scale = |[sum, squares]: &[f64; 2]| (squares / n - (sum / n).powi(2)).max(0.0).sqrt().max(LEAST_SCALE);
    (sums.iter().map(|[sum, _]| sum / n).collect(), sums.iter().map(scale).collect())
}

/// The loss of weights: input by input a weight for each class, then the biases.
struct Problem<'s> {
    inputs: usize,
    count: usize,
    numbers: Vec<f32>,
    classes: &'s [u8],
    /// The penalty of each input's weights.
    penalties: Vec<f64>,
    /// The last weights with their loss and its gradient, which are computed together.
    last: Mutex<(Vec<f64>, f64, Vec<f64>)>,
}

impl Problem<'_> {
    /// Returns something of the loss and its gradient at these weights.
    fn at<T>(&self, weights: &[f64], of: impl FnOnce(f64, &[f64]) -> T) -> T {
        // A poisoned lock means that another thread panicked, and that panic ends everything anyway.
        let mut last = self.last.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if last.0 != weights {
            let (loss, gradient) = self.loss(weights);
            *last = (weights.to_vec(), loss, gradient);
        }
        of(last.1, &last.2)
    }

    fn loss(&self, weights: &[f64]) -> (f64, Vec<f64>) {
        let blocks: Vec<(f64, Vec<f64>)> = self
            .numbers
            .par_chunks(BLOCK * self.inputs)
            .zip(self.classes.par_chunks(BLOCK))
            .map(|(numbers, classes)| self.block(weights, numbers, classes))
            .collect();
        let (mut loss, mut gradient) = (0.0, vec![0.0; weights.len()]);
        for (part, slopes) in blocks {
            loss += part;
            gradient.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += slope);
        }
        let rows = weights.chunks(self.count).zip(gradient.chunks_mut(self.count));
        for ((weights, slopes), penalty) in rows.zip(&self.penalties) {
            for (weight, slope) in weights.iter().zip(slopes) {
                loss += 0.5 * penalty * weight * weight;
                *slope += penalty * weight;
            }
        }
        (loss, gradient)
    }

    /// Returns the loss of some samples, and its gradient.
    fn block(&self, weights: &[f64], numbers: &[f32], classes: &[u8]) -> (f64, Vec<f64>) {
        let (mut loss, mut gradient) = (0.0, vec![0.0; weights.len()]);
        let biases = &weights[self.inputs * self.count..];
        let mut scores = vec![0.0_f64; self.count];
        for (sample, class) in numbers.chunks(self.inputs).zip(classes) {
            scores.copy_from_slice(biases);
            for (input, number) in sample.iter().enumerate() {
                add_scaled(&mut scores, f64::from(*number), &weights[input * self.count..]);
            }
            // The largest score of this sample is taken out, so that no exponential overflows and one of them is 1.
            let class = usize::from(*class);
            let (largest, own) = (scores.iter().copied().fold(f64::MIN, f64::max), scores[class]);
            for score in &mut scores {
                *score = (*score - largest).exp();
            }
            let sum: f64 = scores.iter().sum();
            loss += sum.ln() + largest - own;
            for score in &mut scores {
                *score /= sum;
            }
            scores[class] -= 1.0;
            for (input, number) in sample.iter().enumerate() {
                add_scaled(&mut gradient[input * self.count..], f64::from(*number), &scores);
            }
            add_scaled(&mut gradient[self.inputs * self.count..], 1.0, &scores);
        }
        (loss, gradient)
    }
}

/// Adds a multiple of each number to a sum: four at a time, which is as fast where the crate is optimized for size.
/// Tests run without optimization, where a chain of iterators takes several times as long as a loop.
fn add_scaled(sums: &mut [f64], factor: f64, numbers: &[f64]) {
    let count = sums.len().min(numbers.len());
    let (sums, numbers) = (&mut sums[..count], &numbers[..count]);
    let mut at = 0;
    while at + 4 <= count {
        let (sums, numbers) = (&mut sums[at..at + 4], &numbers[at..at + 4]);
        sums[0] += factor * numbers[0];
        sums[1] += factor * numbers[1];
        sums[2] += factor * numbers[2];
        sums[3] += factor * numbers[3];
        at += 4;
    }
    while at < count {
        sums[at] += factor * numbers[at];
        at += 1;
    }
}

impl CostFunction for Problem<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, weights: &Vec<f64>) -> Result<f64, Failure> {
        Ok(self.at(weights, |loss, _| loss))
    }
}

impl Gradient for Problem<'_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, weights: &Vec<f64>) -> Result<Vec<f64>, Failure> {
        Ok(self.at(weights, |_, gradient| gradient.to_vec()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns points of three classes in a plane, on three sides of its center, and a third number that says nothing.
    fn points() -> (Vec<f32>, Vec<u8>) {
        let mut random = 1_u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / 16_777_216.0 - 0.5
        };
        let centers = [[-9.0_f32, -5.0], [-7.0, -5.0], [-8.0, -3.5]];
        let classes: Vec<u8> = (0..600_u32).map(|n| (n % 3) as u8).collect();
        let point = |class: &u8| {
            let [x, y] = centers[usize::from(*class)];
            [x + next(), y + next(), 40.0 * next()]
        };
        (classes.iter().flat_map(point).collect(), classes)
    }

    #[test]
    fn classes_that_a_line_separates_are_separated() {
        let (numbers, classes) = points();
        let samples = Samples { inputs: 3, numbers: &numbers, classes: &classes, count: 3 };
        let limits = Limits { penalty: 0.1, iterations: 100 };
        let Linear { rows, pairs } = fit(&samples, limits).unwrap();
        assert!(!pairs && rows.len() == 3);
        for (point, class) in numbers.chunks(3).zip(&classes) {
            let score = |row: &Row| {
                row.bias
                    + row.weights.iter().zip(point).map(|(weight, number)| weight * f64::from(*number)).sum::<f64>()
            };
            let best = (0..3).max_by(|a, b| score(&rows[*a]).total_cmp(&score(&rows[*b])));
            assert_eq!(best, Some(usize::from(*class)), "{point:?}");
        }
        // What says nothing has a small weight, also without a unit of its own.
        assert!(rows.iter().all(|row| row.weights[2].abs() < 0.05 * row.weights[0].abs().max(row.weights[1].abs())));
    }

    #[test]
    fn the_gradient_is_that_of_the_loss() {
        let (numbers, classes) = points();
        let last = Mutex::new((Vec::new(), 0.0, Vec::new()));
        let problem = Problem { inputs: 3, count: 3, numbers, classes: &classes, penalties: vec![2.0, 0.5, 1.0], last };
        let weights: Vec<f64> = (0..12).map(|k| f64::from(k - 6) / 64.0).collect();
        let (_, gradient) = problem.loss(&weights);
        for k in 0..12 {
            let step = |by: f64| {
                let mut moved = weights.clone();
                moved[k] += by;
                problem.loss(&moved).0
            };
            let slope = (step(1e-5) - step(-1e-5)) / 2e-5;
            assert!((slope - gradient[k]).abs() < 1e-5 * gradient[k].abs().max(1.0), "{k}: {slope} {}", gradient[k]);
        }
    }

    #[test]
    fn the_number_of_threads_does_not_matter() {
        let (numbers, classes) = points();
        let samples = Samples { inputs: 3, numbers: &numbers, classes: &classes, count: 3 };
        let weights = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let linear = pool.install(|| fit(&samples, Limits { penalty: 0.1, iterations: 30 })).unwrap();
            linear.rows.into_iter().map(|row| (row.weights, row.bias)).collect::<Vec<_>>()
        };
        assert_eq!(weights(1), weights(3));
    }
}
