//! Diagnosis of a sensor that nothing touches, in numbers and in words.
//!
//! [`measure`] reads any source, or takes the events of one that somebody else reads; [`still`], [`pace`] and
//! [`pixels`] compute numbers from it. [`signal`] computes what the trigger would see, [`mjpeg`] the effect of
//! compression, and [`verdict`] the recommended changes. Levels are gray levels of 255, whatever the format's full
//! scale is.

pub mod controls;
pub mod measure;
pub mod mjpeg;
pub mod pace;
pub mod page;
pub mod pixels;
pub mod signal;
pub mod still;
mod text;
pub mod verdict;

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};

use controls::ControlReport;
use measure::Measured;
use mjpeg::MjpegReport;
use signal::SignalReport;
use still::Still;
use verdict::Finding;
use wstac_host::camera::DeviceInfo;
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::source::{LossReason, StreamInfo};

/// All results of a diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// A one-line description of the source.
    pub source: String,
    /// The camera's identity and modes; `None` if the source is not a camera.
    pub camera: Option<CameraReport>,
    /// The timing of frames.
    pub rate: RateReport,
    /// The brightness of the sensor while nothing touches it.
    pub levels: LevelsReport,
    /// The variation of the brightness from frame to frame.
    pub noise: NoiseReport,
    /// The smallest light that the trigger sees.
    pub signal: SignalReport,
    /// The slow change of the brightness.
    pub drift: DriftReport,
    /// Controls: those that are locked, or should be, and any other that can be set and changed.
    pub controls: Vec<ControlReport>,
    /// The effect of MJPEG, or `None` if there is no comparison.
    pub mjpeg: Option<MjpegReport>,
    /// `true` if no change is needed.
    pub healthy: bool,
    /// The recommended changes, the most important first.
    pub verdict: Vec<Finding>,
}

/// A camera.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CameraReport {
    /// Its identity, and all its modes.
    #[serde(flatten)]
    pub device: DeviceInfo,
    /// Four-character code of the format that it sent.
    pub format: String,
}

/// The timing of frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RateReport {
    /// Requested frames per second, or `None` if the source decides.
    pub asked: Option<f64>,
    /// Frames per second that the driver, or the file, states.
    pub stated: f64,
    /// Frames per second by the driver's timestamps, or `None` without timestamps.
    pub measured: Option<f64>,
    /// Standard deviation of the intervals from their mean, in ms.
    pub jitter_ms: Option<f64>,
    /// The longest interval between two frames in a row, in ms.
    pub longest_ms: Option<f64>,
    /// Number of measured frames.
    pub frames: u64,
    /// Duration of the measurement, in s.
    pub seconds: f64,
    /// Frames that were lost during the measurement, by reason.
    #[serde(serialize_with = "by_name")]
    pub lost: BTreeMap<LossReason, u64>,
}

/// The brightness of the sensor, in gray levels of 255.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LevelsReport {
    /// Full scale of the format, in its own steps.
    pub full_scale: u32,
    /// Mean of all taxels.
    pub mean: f64,
    /// Mean of the darkest taxel.
    pub darkest_taxel: f64,
    /// Mean of the brightest taxel.
    pub brightest_taxel: f64,
    /// Value of a pixel without light: as the user gives it, else the mean of the darkest 1 % of pixels.
    pub black: Option<f64>,
    /// `true` if the user gave it.
    pub black_is_given: bool,
    /// Mean of all taxels above black: light that leaks in.
    ///
    /// If black was not given, light that falls on all pixels alike does not show.
    pub leak: Option<f64>,
    /// Fraction of pixels at full scale.
    pub saturated: Option<f64>,
    /// Fraction of pixels that are always 0: light below black is cut off there.
    pub clipped: Option<f64>,
}

/// The variation of levels from frame to frame, in gray levels of 255, rms; slower changes are not counted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NoiseReport {
    /// Variation of a taxel's mean, over all taxels.
    pub taxel: f64,
    /// Variation of the noisiest taxel's mean.
    pub worst_taxel: f64,
    /// Variation of a pixel inside a taxel; `None` if there are no pixels.
    pub pixel: Option<f64>,
}

/// The slow change of levels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DriftReport {
    /// Slope of the mean of all taxels, in gray levels of 255 per minute.
    pub levels_per_minute: f64,
    /// Standard error of that slope.
    pub error: f64,
    /// Slope of the taxel that changes most.
    pub worst_taxel: f64,
    /// Minutes until the drift alone makes the trigger fire.
    ///
    /// It is `None` if the drift is too small to distinguish from noise. It is also `None` for light that falls, which
    /// never fires.
    pub minutes_to_trigger: Option<f64>,
}

impl DriftReport {
    /// Returns the minutes until the mean of all taxels has changed by this many levels in either direction.
    ///
    /// Returns `None` if the drift is too small to distinguish from noise.
    fn minutes_to(&self, levels: f64) -> Option<f64> {
        let slope = self.levels_per_minute.abs();
        (slope > 0.0 && slope > SIGNIFICANT * self.error).then(|| tidy(levels / slope))
    }
}

/// The user's knowledge about the source.
#[derive(Clone, Copy, Debug, Default)]
pub struct Known {
    /// Requested frames per second.
    pub asked_fps: Option<f64>,
    /// A pixel's value without light, in gray levels of 255, measured with the sensor in the dark.
    pub black: Option<f64>,
}

/// Multiple of its standard error from which a slope is not due to chance.
const SIGNIFICANT: f64 = 4.0;

/// Creates a report of a measurement.
///
/// # Errors
/// The configuration is not valid.
pub fn examine(
    info: &StreamInfo,
    config: &Config,
    measured: &Measured,
    known: Known,
    (camera, controls): (Option<CameraReport>, Vec<ControlReport>),
    mjpeg: Option<MjpegReport>,
) -> Result<Report, Error> {
    let still = Still::new(measured);
    let signal = signal::signal(&still, config, measured)?;
    let pixels = measured.pixels;
    let black = known.black.or(pixels.map(|pixels| pixels.darkest));
    let pace = measured.pace.summary();
    let means = still.means();
    let mean = still::mean(means.iter().copied());
    let drift = drift(&still, &signal);
    let mut report = Report {
        source: info.about.clone(),
        camera,
        rate: RateReport {
            asked: known.asked_fps,
            stated: info.rate.per_second(),
            measured: pace.map(|pace| tidy(pace.fps)),
            jitter_ms: pace.map(|pace| tidy(1e3 * pace.jitter)),
            longest_ms: pace.map(|pace| tidy(1e3 * pace.longest)),
            frames: measured.moments.len() as u64,
            seconds: tidy(measured.seconds()),
            lost: measured.lost.clone(),
        },
        levels: LevelsReport {
            full_scale: measured.full_scale,
            mean: tidy(mean),
            darkest_taxel: tidy(means.iter().copied().fold(f64::INFINITY, f64::min)),
            brightest_taxel: tidy(means.iter().copied().fold(0.0, f64::max)),
            black: black.map(tidy),
            black_is_given: known.black.is_some(),
            leak: black.map(|black| tidy(mean - black)),
            saturated: pixels.map(|pixels| tidy(pixels.saturated)),
            clipped: pixels.map(|pixels| tidy(pixels.clipped)),
        },
        noise: NoiseReport {
            taxel: tidy(still.noise()),
            worst_taxel: tidy(still.worst_noise()),
            pixel: pixels.map(|pixels| tidy(pixels.noise)),
        },
        signal,
        drift,
        controls,
        mjpeg,
        healthy: true,
        verdict: Vec::new(),
    };
    report.verdict = verdict::verdict(&report, info, config, measured);
    report.healthy = report.verdict.iter().all(|finding| finding.kind == verdict::READOUT);
    Ok(report)
}

fn drift(still: &Still, signal: &SignalReport) -> DriftReport {
    let whole = still.trend();
    let worst = still.worst_trend();
    let mut report = DriftReport {
        levels_per_minute: tidy(60.0 * whole.slope),
        error: tidy(60.0 * whole.error),
        worst_taxel: tidy(60.0 * worst.slope),
        minutes_to_trigger: None,
    };
    // Only brighter light fires the trigger; darker light hides as much light instead.
    report.minutes_to_trigger = report.minutes_to(signal.five_taxels).filter(|_| report.levels_per_minute > 0.0);
    report
}

/// Rounds to five decimals: more is noise.
pub(crate) fn tidy(number: f64) -> f64 {
    (number * 1e5).round() / 1e5
}

/// Serializes lost frames by the words of their reasons.
fn by_name<S: Serializer>(lost: &BTreeMap<LossReason, u64>, serializer: S) -> Result<S::Ok, S::Error> {
    let by_name: BTreeMap<&str, u64> = lost.iter().map(|(reason, frames)| (reason.name(), *frames)).collect();
    by_name.serialize(serializer)
}

#[cfg(test)]
mod tests;
