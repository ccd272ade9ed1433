//! Mean and variance of a pixel's value: a normal number, rounded to the values of a format and clamped to them.

use core::f64::consts::{FRAC_1_SQRT_2, PI};

use libm::{erfc, exp, round, sqrt};

use super::encode::{GREEN_LEVELS, green_level, nearest_green};

/// Number of standard deviations beyond which no value is expected: the sensor's own numbers end at six.
const REACH: f64 = 7.0;
/// Standard deviation in values from which rounding is taken as even noise of 1/12.
///
/// It is exact within 0.002 of a value if values are clamped, and far better otherwise.
const SMOOTH: f64 = 8.0;

/// The values that a pixel can have.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    /// Every integer up to full scale.
    Every(u32),
    /// The levels that 6 bits of green are read as; each but the first has the smallest unrounded value that becomes
    /// it.
    Six(Vec<(f64, f64)>),
}

impl Values {
    /// Returns the values of RGB565's green.
    pub(super) fn six_bits() -> Self {
        let least = |bits| (0..=255).find(|&value| nearest_green(value) >= bits).unwrap_or(u16::MAX);
        let level = |bits| f64::from(green_level(bits));
        Self::Six((1..GREEN_LEVELS).map(|bits| (f64::from(least(bits)) - 0.5, level(bits))).collect())
    }

    /// Returns the mean and variance of a normal number of this mean and deviation after rounding to the nearest value.
    pub(super) fn moments(&self, mean: f64, deviation: f64) -> [f64; 2] {
        match self {
            &Self::Every(most) if deviation >= SMOOTH => clamped(mean, deviation, f64::from(most)),
            &Self::Every(most) => {
                let nearest = |value| round(value).max(0.0).min(f64::from(most));
                let (low, high) = (nearest(mean - REACH * deviation), nearest(mean + REACH * deviation));
                let steps = (low as u32..high as u32).map(|value| (f64::from(value) + 0.5, f64::from(value) + 1.0));
                stepped(low, steps, mean, deviation)
            }
            Self::Six(steps) => stepped(0.0, steps.iter().copied(), mean, deviation),
        }
    }
}

/// Returns the moments of a value that is `lowest`, or that of the highest step which a normal number reaches.
fn stepped(lowest: f64, steps: impl Iterator<Item = (f64, f64)>, mean: f64, deviation: f64) -> [f64; 2] {
    let (mut first, mut second, mut before) = (0.0, 0.0, 0.0);
    for (least, value) in steps {
        let reached = if deviation > 0.0 {
            upper_tail((least - mean) / deviation)
        } else if mean >= least {
            1.0
        } else {
            0.0
        };
        let above = value - lowest;
        first += (above - before) * reached;
        second += (above * above - before * before) * reached;
        before = above;
    }
    [lowest + first, (second - first * first).max(0.0)]
}

/// Returns the moments of a normal number that is clamped to 0..=`most` and rounded.
fn clamped(mean: f64, deviation: f64, most: f64) -> [f64; 2] {
    let (low, high) = (-mean / deviation, (most - mean) / deviation);
    let density = |z: f64| exp(-0.5 * z * z) / sqrt(2.0 * PI);
    let above = upper_tail(high);
    let inside = upper_tail(low) - above;
    // Moments about the mean avoid a difference of large numbers far from the clamps.
    let first = deviation * (density(low) - density(high)) + (most - mean) * above - mean * upper_tail(-low);
    let second = deviation * deviation * (inside + low * density(low) - high * density(high))
        + (most - mean) * (most - mean) * above
        + mean * mean * upper_tail(-low);
    [mean + first, (second - first * first + inside / 12.0).max(0.0)]
}

/// Returns the fraction of normal numbers above z.
fn upper_tail(z: f64) -> f64 {
    if z < -REACH {
        1.0
    } else if z > REACH {
        0.0
    } else {
        0.5 * erfc(z * FRAC_1_SQRT_2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computes moments by brute force: a sum over the normal distribution in small steps.
    fn by_sum(mean: f64, deviation: f64, quantized: impl Fn(f64) -> f64) -> [f64; 2] {
        let (mut total, mut first, mut second) = (0.0, 0.0, 0.0);
        for step in -70_000..=70_000 {
            let z = f64::from(step) * 1e-4;
            let (weight, value) = (exp(-0.5 * z * z), quantized(mean + deviation * z));
            (total, first, second) = (total + weight, first + weight * value, second + weight * value * value);
        }
        let mean = first / total;
        [mean, second / total - mean * mean]
    }

    fn assert_same(found: [f64; 2], expected: [f64; 2], about: &str) {
        let off = [0, 1].map(|k| (found[k] - expected[k]).abs());
        assert!(off[0] < 0.003 && off[1] < 0.003 + 0.001 * expected[1], "{about}: {found:?}, expected {expected:?}");
    }

    #[test]
    fn every_value() {
        let values = Values::Every(1023);
        for mean in [-30.0, -1.0, 0.0, 0.3, 1.0, 1.5, 7.0, 400.2, 1020.0, 1023.5, 1060.0] {
            for deviation in [0.2, 0.6, 3.0, 7.99, 8.0, 30.0] {
                let expected = by_sum(mean, deviation, |value| round(value).clamp(0.0, 1023.0));
                assert_same(values.moments(mean, deviation), expected, &format!("{mean} {deviation}"));
            }
        }
    }

    #[test]
    fn six_bits() {
        let values = Values::six_bits();
        let read = |value: f64| f64::from(green_level(nearest_green(round(value).clamp(0.0, 255.0) as u16)));
        for mean in [-3.0, 0.0, 1.0, 2.5, 61.3, 127.0, 253.0, 300.0] {
            for deviation in [0.3, 0.6, 2.0, 9.0] {
                assert_same(values.moments(mean, deviation), by_sum(mean, deviation, read), &format!("{mean}"));
            }
            assert_same(values.moments(mean, 0.0), [read(mean), 0.0], &format!("{mean} without noise"));
        }
    }

    #[test]
    fn saturation_and_no_noise() {
        assert_same(Values::Every(255).moments(1e12, 1e5), [255.0, 0.0], "far beyond");
        assert_same(Values::Every(255).moments(1e12, 1.0), [255.0, 0.0], "far beyond, little noise");
        assert_same(Values::Every(255).moments(3.4, 0.0), [3.0, 0.0], "no noise");
    }
}
