//! Features in 64-bit floating point, and the distance of other features from them.

use wstac_core::features::{Features, line_sums};
use wstac_core::params::{FEATURE_ONE, FEATURES, TAXELS};

/// The core's sums, logarithms and floor, computed without fixed point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Float64 {
    reference: f64,
    floor: f64,
    lit: f64,
}

impl Float64 {
    /// Creates the reference for taxels of `pixels` pixels of full scale `full_scale`.
    ///
    /// Features are floored at `floor_levels` gray levels; a row or column is lit above `threshold` of full scale.
    pub(super) fn new(pixels: u32, full_scale: u32, floor_levels: f64, threshold: f64) -> Self {
        let most = f64::from(pixels) * f64::from(full_scale);
        let floor = if floor_levels > 0.0 { 5.0 * floor_levels / f64::from(full_scale) } else { 1.0 / most };
        Self { reference: libm::log(most), floor: libm::log(floor), lit: libm::log(threshold) }
    }

    pub(super) fn features(&self, taxels: &[u32; TAXELS]) -> [f64; FEATURES] {
        line_sums(taxels).map(|sum| (libm::log(f64::from(sum)) - self.reference).max(self.floor))
    }
}

/// Deviation of features from those in 64-bit floating point, in units of a natural logarithm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeatureError {
    /// Deviation of all features of all frames.
    pub all: Deviation,
    /// Deviation of the features of lit rows and columns.
    pub lit: Deviation,
}

impl FeatureError {
    /// Adds a frame.
    pub(super) fn add(&mut self, found: &Features, expected: &[f64; FEATURES], float64: &Float64) {
        for (found, expected) in found.iter().zip(expected) {
            let deviation = f64::from(*found) / f64::from(FEATURE_ONE) - expected;
            self.all.add(deviation);
            if *expected > float64.lit {
                self.lit.add(deviation);
            }
        }
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.all.merge(&other.all);
        self.lit.merge(&other.lit);
    }
}

/// Statistics of several deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Largest absolute deviation.
    pub max: f64,
    /// Sum of the squared deviations.
    pub(super) squares: f64,
    /// Number of deviations.
    pub(super) count: u64,
}

impl Deviation {
    fn add(&mut self, deviation: f64) {
        self.max = self.max.max(deviation.abs());
        self.squares += deviation * deviation;
        self.count += 1;
    }

    fn merge(&mut self, other: &Self) {
        self.max = self.max.max(other.max);
        self.squares += other.squares;
        self.count += other.count;
    }

    /// Returns the root of the mean square; 0 without numbers.
    pub fn rms(&self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_core::features::{FeatureScale, Floor};
    use wstac_core::ln::fixed::Fixed;

    #[test]
    fn the_cores_features_are_near_and_the_floor_is_the_same() {
        let float64 = Float64::new(2500, 255, 0.5, 0.0475);
        let scale = FeatureScale::<Fixed>::new(2500, 255, 1, Floor::new(0.5, 255).unwrap()).unwrap();
        let mut error = FeatureError::default();
        for level in [0, 1, 10, 1000, 100_000, 637_500] {
            let taxels = [level; TAXELS];
            error.add(&scale.features(&line_sums(&taxels)), &float64.features(&taxels), &float64);
        }
        // Half a unit of rounding, plus the kernel's own error.
        assert!(error.all.max > 0.0 && error.all.max < 1.0 / 2048.0, "{error:?}");
        assert_eq!((error.all.count, error.lit.count), (60, 20));
        assert!(error.lit.rms() <= error.lit.max);
        let mut twice = error;
        twice.merge(&error);
        assert!((twice.all.rms() - error.all.rms()).abs() < 1e-15 && twice.all.count == 120);
    }
}
