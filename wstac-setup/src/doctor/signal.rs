//! The smallest light that the trigger sees, from the measured levels and noise and its own threshold.
//!
//! A line's feature is f = ln of the sum of its five taxels. The trigger fires if its mean over a window is more than Δ
//! above the baseline's f₀. Δ = max((b − 1) · |f₀|, margin) with the signed rule, (b − 1) · f₀ with the literal one.
//!
//! Let R be the line's level at rest, and F = max(R, the floor's level). Then it fires if the line gains more than s =
//! F · e^Δ − R levels, as the sum of its taxels.

use serde::Serialize;
use wstac_core::paper::speed::ThresholdOn;
use wstac_core::paper::trigger::Rule;
use wstac_core::params::{COLUMNS, FEATURES, ROWS, TAXELS};

use super::measure::Measured;
use super::still::Still;
use super::tidy;
use wstac_host::config::Config;
use wstac_host::error::Error;

/// Standard deviations of a window's noise by which a light must exceed the threshold to be seen 999 times in 1000.
const SURE: f64 = 3.09;
/// Seconds in an hour; the false triggers per hour are limited to the number of windows in it.
const HOUR_S: f64 = 3600.0;

/// The smallest visible light, in gray levels of 255.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SignalReport {
    /// Light that one taxel alone must gain over a window to fire the trigger, wherever it is.
    ///
    /// It is that of the more sensitive of its row and column, for the least sensitive of all taxels.
    pub one_taxel: f64,
    /// Light that one taxel alone must gain to fire 999 times in 1000 in spite of the noise.
    pub one_taxel_sure: f64,
    /// Light that each taxel of a row or column must gain if all five light up: for the least sensitive line.
    pub five_taxels: f64,
    /// Noise of the noisiest line's mean over a window.
    pub line_noise: f64,
    /// Distance of the nearest line from its threshold, in multiples of its noise.
    pub noise_margin: Option<f64>,
    /// False triggers per hour from noise alone, as if it were normal.
    pub false_triggers_per_hour: f64,
    /// The speed law's threshold: the level of each of a line's five taxels from which the line counts as lit.
    pub lit: f64,
    /// The brightest line at rest, as a fraction of that threshold.
    ///
    /// Above 1 it counts as lit without a touch. It is 0 if the threshold applies to light above the baseline.
    pub rest_of_lit: f64,
}

/// Computes what the trigger would see.
///
/// # Errors
/// The configuration is not valid.
pub fn signal(still: &Still, config: &Config, measured: &Measured) -> Result<SignalReport, Error> {
    let failed = |error| Error::config("[trigger]", error);
    let trigger = config.trigger().map_err(failed)?;
    let real = |bits: u32| f64::from(bits) / 65_536.0;
    let (b, margin) = (real(trigger.multiplier().bits()), real(trigger.margin().bits()));
    let floor = 5.0 * config.features.floor_levels * 255.0 / f64::from(measured.full_scale);
    let window = usize::from(trigger.window());
    let added = measured.frames_added as usize;
    let rest = still.line_means();
    let gains = rest.map(|rest| {
        // Without light and without a floor there is one raw count, which no mean is below.
        let from = rest.max(floor).max(f64::MIN_POSITIVE);
        let feature = (from / 255.0).ln();
        let above = match trigger.rule() {
            Rule::Signed => ((b - 1.0) * feature.abs()).max(margin),
            Rule::Literal => (b - 1.0) * feature,
        };
        (from * above.exp() - rest).max(0.0)
    });
    let noise: [f64; FEATURES] = std::array::from_fn(|line| still.window_noise(line, window * added));
    let sure: [f64; FEATURES] = std::array::from_fn(|line| gains[line] + SURE * noise[line]);
    let margins = || gains.iter().zip(&noise).filter(|(_, noise)| **noise > 0.0).map(|(gain, noise)| gain / noise);
    let windows = HOUR_S * measured.fps / (window * added) as f64;
    // Each line fires by itself; at most as many as there are windows.
    let chance = margins().fold(0.0, |sum, margin| sum + 0.5 * libm::erfc(margin / std::f64::consts::SQRT_2));
    let lit = 255.0 * config.speed.threshold / COLUMNS as f64;
    Ok(SignalReport {
        one_taxel: tidy(least_sensitive(&gains)),
        one_taxel_sure: tidy(least_sensitive(&sure)),
        five_taxels: tidy(gains.iter().copied().fold(0.0, f64::max) / COLUMNS as f64),
        line_noise: tidy(noise.iter().copied().fold(0.0, f64::max)),
        noise_margin: margins().min_by(f64::total_cmp).map(tidy),
        false_triggers_per_hour: tidy(windows * chance.min(1.0)),
        lit: tidy(lit),
        rest_of_lit: match config.speed.threshold_on {
            ThresholdOn::Absolute => tidy(rest.iter().copied().fold(0.0, f64::max) / (COLUMNS as f64 * lit)),
            ThresholdOn::AboveBaseline => 0.0,
        },
    })
}

/// Returns the largest over all taxels of the smaller gain of its two lines.
fn least_sensitive(gains: &[f64; FEATURES]) -> f64 {
    let of_taxel = |taxel: usize| gains[taxel / COLUMNS].min(gains[ROWS + taxel % COLUMNS]);
    (0..TAXELS).map(of_taxel).fold(0.0, f64::max)
}
