//! Means over sensors with their confidence intervals.

use super::slides::SENSORS;

/// Student's t of 19 degrees of freedom that 2.5 % exceed.
const T_95: f64 = 2.093_024;
const _: () = assert!(SENSORS == 20);

/// A fraction in percent with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Mean.
    pub mean: f64,
    /// Lower end, not below 0.
    pub low: f64,
    /// Upper end, not above 100.
    pub high: f64,
}

/// Returns the mean over sensors of the fraction of right slides, in percent, with Student's interval.
///
/// The input holds a sensor's number and `true` if it was right, slide by slide. Every sensor has the same number of
/// slides.
pub fn interval(answers: impl Iterator<Item = (u32, bool)>) -> Interval {
    let mut counts = [[0_u32; 2]; SENSORS as usize];
    for (sensor, right) in answers {
        if let Some([right_ones, all]) = counts.get_mut(sensor as usize) {
            *right_ones += u32::from(right);
            *all += 1;
        }
    }
    let shares = counts.map(|[right, all]| 100.0 * f64::from(right) / f64::from(all.max(1)));
    let n = f64::from(SENSORS);
    let mean = shares.iter().sum::<f64>() / n;
    let squares = shares.iter().map(|share| (share - mean) * (share - mean)).sum::<f64>();
    let half = T_95 * (squares / (n - 1.0) / n).sqrt();
    Interval { mean, low: (mean - half).max(0.0), high: (mean + half).min(100.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_is_students() {
        // Half of the sensors have 1 of 2 right, the others 2 of 2: standard deviation 25.6 of 20, √20 = 4.47.
        let answers = (0..20).flat_map(|sensor| [(sensor, true), (sensor, sensor % 2 == 0)]);
        let found = interval(answers);
        let half = 2.093_024 * 25.0 * (20.0_f64 / 19.0).sqrt() / 20.0_f64.sqrt();
        assert!((found.mean - 75.0).abs() < 1e-9 && (found.low - (75.0 - half)).abs() < 1e-9, "{found:?}");
        let all_right = interval((0..20).map(|sensor| (sensor, true)));
        assert_eq!(all_right, Interval { mean: 100.0, low: 100.0, high: 100.0 });
    }
}
