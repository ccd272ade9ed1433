//! The noise of the untouched sensor through the new layout, and the settings that follow from it.

use wstac_core::features::line_sums;
use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::layout::Layout;
use wstac_core::params::{DEFAULT_FLOOR_LEVELS, DEFAULT_MARGIN, DEFAULT_WINDOW, FEATURES, TAXELS, VALID_THRESHOLD};
use wstac_core::taxels::{FrameGeometry, TaxelSums};

use wstac_host::source::StreamInfo;

/// Distance in standard deviations that a setting keeps from the noise: once in 10^9 normal numbers.
const DEVIATIONS: f64 = 6.0;
/// Level of an untouched row or column in the camera for which the speed law was made.
///
/// It is not published. The value is that of five taxels with a black level of one of 255, as in the simulated sensor.
/// The threshold for light above the baseline is lower by this.
const PUBLISHED_DARK: f64 = 5.0 / 255.0;
/// Fraction of the threshold from which the level without a touch shifts durations too much.
const MOST_DARK: f64 = 0.5;

/// The noise of the untouched sensor, and the settings that stay clear of it. A line is a row or a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Mean of the brightest line's taxels, in gray levels of the pixel format.
    pub dark_levels: f64,
    /// Standard deviation of the noisiest line's mean from frame to frame, in gray levels.
    pub levels: f64,
    /// Standard deviation of the noisiest line's feature, in units of a natural logarithm.
    pub feature: f64,
    /// Suggested darkness floor, in gray levels.
    pub floor_levels: f64,
    /// Suggested margin of the trigger, in units of a natural logarithm per frame.
    pub margin: f64,
    /// Suggested threshold of a lit line, as a fraction of full scale summed over its five taxels.
    pub threshold: f64,
    /// `true` if the threshold should apply to light above the baseline: there is too much light without a touch.
    pub above_baseline: bool,
    /// Level of the brightest line without a touch, as a fraction of full scale summed over its five taxels.
    pub dark_sum: f64,
    /// Standard deviation of the noisiest line, as a fraction of full scale summed over its five taxels.
    pub sum: f64,
}

impl Noise {
    /// Measures the noise of untouched frames through a layout.
    ///
    /// # Errors
    /// The frames' sums do not fit the core.
    pub(super) fn measured(info: &StreamInfo, layout: Layout, untouched: &[Vec<u8>]) -> Result<Self, String> {
        let green = Any::new(info.format, info.color, YcbcrMethod::Exact);
        let camera = FrameGeometry::new(green, layout, info.rate)
            .and_then(|camera| camera.with_bytes_per_row(info.bytes_per_row))
            .map_err(|error| error.to_string())?;
        let full = f64::from(camera.pixels()) * f64::from(camera.full_scale());
        let gray = f64::from(camera.full_scale());
        let mut accumulators = TaxelSums::new(camera);
        let lines = untouched.iter().filter_map(|bytes| accumulators.push_frame(bytes).ok());
        Ok(Self::of_lines(&lines.map(|sums| lines_of(&sums, full)).collect::<Vec<_>>(), gray))
    }

    /// Computes the noise of line sums, which are fractions of a full scale of `gray` levels.
    fn of_lines(frames: &[[f64; FEATURES]], gray: f64) -> Self {
        let (mut dark_sum, mut sum, mut feature) = (0.0_f64, 0.0_f64, 0.0_f64);
        for line in 0..FEATURES {
            let values = || frames.iter().map(|frame| frame[line]);
            let count = frames.len().max(2) as f64;
            let mean = values().sum::<f64>() / count;
            let variance = values().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
            (dark_sum, sum) = (dark_sum.max(mean), sum.max(variance.sqrt()));
            if mean > 0.0 {
                feature = feature.max(variance.sqrt() / mean.max(5.0 * DEFAULT_FLOOR_LEVELS / gray));
            }
        }
        let to_levels = gray / 5.0;
        let up = |value: f64, unit: f64| (value / unit - 1e-9).ceil() * unit;
        let above_baseline = dark_sum > MOST_DARK * VALID_THRESHOLD;
        let threshold = if above_baseline { VALID_THRESHOLD - PUBLISHED_DARK } else { VALID_THRESHOLD };
        let window = f64::from(DEFAULT_WINDOW).sqrt();
        Self {
            dark_levels: dark_sum * to_levels,
            levels: sum * to_levels,
            feature,
            floor_levels: up(DEVIATIONS * sum * to_levels, 0.1).max(DEFAULT_FLOOR_LEVELS),
            margin: up(DEVIATIONS * feature / window, 0.01).max(DEFAULT_MARGIN),
            threshold: up(DEVIATIONS * sum, 0.0005).max(threshold),
            above_baseline,
            dark_sum,
            sum,
        }
    }
}

/// Returns the sums of rows and columns as fractions of full scale.
fn lines_of(sums: &[u32; TAXELS], full: f64) -> [f64; FEATURES] {
    line_sums(sums).map(|sum| f64::from(sum) / full)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns 25 frames of lines at `mean`, alternately `off` above and below it.
    fn frames(mean: f64, off: f64) -> Vec<[f64; FEATURES]> {
        (0..25).map(|t| [if t % 2 == 0 { mean + off } else { mean - off }; FEATURES]).collect()
    }

    #[test]
    fn a_quiet_sensor_keeps_the_defaults() {
        let noise = Noise::of_lines(&frames(0.02, 0.0001), 255.0);
        assert!((noise.dark_levels - 1.02).abs() < 1e-3, "{noise:?}");
        assert_eq!((noise.floor_levels, noise.margin, noise.threshold), (0.5, 0.2, VALID_THRESHOLD));
        assert!(!noise.above_baseline);
    }

    #[test]
    fn a_noisy_sensor_raises_them_and_a_bright_one_measures_above_the_baseline() {
        let noise = Noise::of_lines(&frames(0.1, 0.02), 255.0);
        let deviation = 0.02 * (25.0_f64 / 24.0).sqrt();
        assert!((noise.sum - deviation).abs() < 2e-4, "{noise:?}");
        assert!(noise.floor_levels >= 6.0 * deviation * 51.0 && noise.floor_levels < 6.0 * deviation * 51.0 + 0.2);
        assert!(noise.margin >= 6.0 * noise.feature / 5.0_f64.sqrt() && noise.margin < 0.57);
        assert!(noise.threshold >= 0.122 && noise.threshold < 0.124 && noise.above_baseline);
    }
}
