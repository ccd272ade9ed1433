//! Normal numbers for millions of pixels per second: a table that is read from random places.

use crate::rng::Rng;

/// Number of entries in the table.
///
/// The variance of a taxel's sum is that of independent pixels within a few percent. The fraction is √(4/3 · taxel
/// width / numbers), 4 % at 90 pixels.
const NUMBERS: usize = 1 << 16;

/// A table of numbers of mean 0 and variance 1, exactly: an error of the mean would shift whole taxels.
#[derive(Clone, Debug)]
pub(super) struct NoiseTable {
    /// The numbers, followed by the first ones again, so that every place is the start of a run.
    numbers: Vec<f32>,
    rng: Rng,
}

impl NoiseTable {
    /// Creates a table for runs of up to `longest` numbers, each times `scale`.
    pub(super) fn new(longest: usize, scale: f64, mut rng: Rng) -> Self {
        let drawn: Vec<f64> = (0..NUMBERS).map(|_| rng.normal()).collect();
        let mean = drawn.iter().sum::<f64>() / NUMBERS as f64;
        let variance = drawn.iter().map(|number| (number - mean) * (number - mean)).sum::<f64>() / NUMBERS as f64;
        let factor = scale / variance.sqrt();
        let scaled = drawn.iter().map(|number| ((number - mean) * factor) as f32);
        Self { numbers: scaled.cycle().take(NUMBERS + longest).collect(), rng }
    }

    /// Returns the next `length` numbers, at most as many as the longest run.
    pub(super) fn run(&mut self, length: usize) -> &[f32] {
        let start = self.rng.below(NUMBERS);
        self.numbers.get(start..start + length).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_variance_are_exact_and_runs_go_round() {
        let table = NoiseTable::new(90, 2.0, Rng::new(3, 4));
        let once = || table.numbers[..NUMBERS].iter().map(|&number| f64::from(number));
        let mean = once().sum::<f64>() / NUMBERS as f64;
        let variance = once().map(|number| number * number).sum::<f64>() / NUMBERS as f64;
        assert!(mean.abs() < 1e-6 && (variance - 4.0).abs() < 1e-6, "{mean} {variance}");
        assert_eq!(table.numbers[..90], table.numbers[NUMBERS..]);
    }

    #[test]
    fn sums_of_runs_vary_as_those_of_independent_numbers() {
        let mut table = NoiseTable::new(90, 1.0, Rng::new(1, 1));
        let sums: Vec<f64> = (0..100_000).map(|_| table.run(90).iter().map(|&x| f64::from(x)).sum()).collect();
        let variance = sums.iter().map(|sum| sum * sum).sum::<f64>() / 1e5;
        assert!((variance / 90.0 - 1.0).abs() < 0.12, "{variance}");
    }
}
