//! Noise and drift of taxels and of the trigger's ten lines while nothing touches the sensor.

use wstac_core::params::{COLUMNS, FEATURES, ROWS, TAXELS};

use super::measure::Measured;
use wstac_host::statistics::{self, Line};

/// A straight line through levels over time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trend {
    /// Levels per second.
    pub slope: f64,
    /// Standard error of the slope, as if the noise of frames were independent.
    pub error: f64,
}

/// A measurement, as numbers over time.
#[derive(Clone, Debug)]
pub struct Still {
    times: Vec<f64>,
    follows: Vec<bool>,
    taxels: Vec<[f64; TAXELS]>,
    lines: Vec<[f64; FEATURES]>,
}

impl Still {
    /// Takes the frames of a measurement, and adds their line sums.
    pub fn new(measured: &Measured) -> Self {
        let moments = measured.moments.iter();
        Self {
            times: moments.clone().map(|moment| moment.at).collect(),
            follows: moments.clone().map(|moment| moment.follows).collect(),
            taxels: moments.clone().map(|moment| moment.levels).collect(),
            lines: moments.map(|moment| lines(&moment.levels)).collect(),
        }
    }

    /// Returns the mean of each taxel.
    pub fn means(&self) -> [f64; TAXELS] {
        std::array::from_fn(|taxel| mean(self.taxels.iter().map(|levels| levels[taxel])))
    }

    /// Returns the mean of each line: the sum of five taxels.
    pub fn line_means(&self) -> [f64; FEATURES] {
        std::array::from_fn(|line| mean(self.lines.iter().map(|sums| sums[line])))
    }

    /// Returns the noise of a taxel's mean, rms over all taxels.
    pub fn noise(&self) -> f64 {
        mean((0..TAXELS).map(|taxel| self.noise_of(taxel).powi(2))).sqrt()
    }

    /// Returns the noise of the noisiest taxel's mean.
    pub fn worst_noise(&self) -> f64 {
        (0..TAXELS).map(|taxel| self.noise_of(taxel)).fold(0.0, f64::max)
    }

    /// Computes the noise from the steps between consecutive frames, which slower changes hardly touch.
    fn noise_of(&self, taxel: usize) -> f64 {
        let pairs = self.taxels.windows(2).zip(self.follows.iter().skip(1)).filter(|(_, follows)| **follows);
        (mean(pairs.map(|(pair, _)| (pair[1][taxel] - pair[0][taxel]).powi(2))) / 2.0).sqrt()
    }

    /// Returns the noise of a line's mean over `frames` frames around its trend.
    ///
    /// The windows are those of the trigger, so that flicker which lasts longer than a frame counts in full.
    pub fn window_noise(&self, line: usize, frames: usize) -> f64 {
        let levels: Vec<f64> = self.lines.iter().map(|sums| sums[line]).collect();
        let (trend, center) = (self.trend_of(&levels), mean(self.times.iter().copied()));
        let average = mean(levels.iter().copied());
        let rest: Vec<f64> =
            levels.iter().zip(&self.times).map(|(level, at)| level - average - trend.slope * (at - center)).collect();
        let windows: Vec<f64> = rest.chunks_exact(frames.max(1)).map(|window| mean(window.iter().copied())).collect();
        let single = mean(rest.iter().map(|level| level * level));
        // Too few windows say little: then frames are taken to be independent.
        let variance =
            if windows.len() < 8 { single / frames.max(1) as f64 } else { mean(windows.iter().map(|w| w * w)) };
        variance.sqrt()
    }

    /// Returns the change of the mean of all taxels.
    pub fn trend(&self) -> Trend {
        let levels: Vec<f64> = self.taxels.iter().map(|levels| mean(levels.iter().copied())).collect();
        self.trend_of(&levels)
    }

    /// Returns the change of the taxel that changes most.
    pub fn worst_trend(&self) -> Trend {
        let trends = (0..TAXELS).map(|taxel| {
            let levels: Vec<f64> = self.taxels.iter().map(|levels| levels[taxel]).collect();
            self.trend_of(&levels)
        });
        trends.max_by(|a, b| a.slope.abs().total_cmp(&b.slope.abs())).unwrap_or_default()
    }

    /// Returns the change of levels, by least squares; equal levels have no change.
    fn trend_of(&self, levels: &[f64]) -> Trend {
        let points: Vec<[f64; 2]> = self.times.iter().zip(levels).map(|(&at, &level)| [at, level]).collect();
        let Some(line) = Line::fit(&points) else { return Trend::default() };
        // The line's error divides by n − 2, the doctor's by n.
        let count = points.len() as f64;
        Trend { slope: line.slope, error: line.slope_error * ((count - 2.0) / count).sqrt() }
    }
}

/// Returns the row sums, then the column sums.
pub fn lines(levels: &[f64; TAXELS]) -> [f64; FEATURES] {
    std::array::from_fn(|line| {
        let of_line = |place: usize| if line < ROWS { line * COLUMNS + place } else { place * COLUMNS + line - ROWS };
        (0..COLUMNS).map(|place| levels[of_line(place)]).sum()
    })
}

/// Returns the mean, or 0 of no numbers.
pub fn mean(numbers: impl IntoIterator<Item = f64>) -> f64 {
    statistics::mean(numbers).unwrap_or(0.0)
}
