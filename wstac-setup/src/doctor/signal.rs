//! The smallest light that the trigger sees, from the measured levels and noise and its own threshold.
//!
//! The trigger fires when a line's mean feature over a window, f = ln of the sum of its five taxels, is more than Δ above the
//! baseline's f₀. Δ = max((b − 1) · |f₀|, margin) with the signed rule, (b − 1) · f₀ with the literal one. With R the line's level at
//! rest, and F = max(R, the floor's level), it fires when the line gains more than s = F · e^Δ − R levels, sum of its taxels.

use serde::Serialize;
use wstac_core::params::{COLUMNS, FEATURES, ROWS, TAXELS};
use wstac_core::speed::ThresholdOn;
use wstac_core::trigger::Rule;

use super::measure::Measured;
use super::still::Still;
use super::tidy;
use wstac_host::config::Config;
use wstac_host::error::Error;

/// Deviations of a window's noise that a light must be above the threshold to be seen 999 times in 1000.
const SURE: f64 = 3.09;
/// No more false triggers an hour are told than there could be windows in it.
const HOUR_S: f64 = 3600.0;

/// In gray levels of 255.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SignalReport {
    /// What one taxel alone must gain over a window to fire, wherever it is: of its row and its column the more
    /// sensitive one, of all taxels the least sensitive.
    pub one_taxel: f64,
    /// The same to fire 999 times in 1000 in spite of the noise.
    pub one_taxel_sure: f64,
    /// What each taxel of a row or column must gain where all five light up: the least sensitive line.
    pub five_taxels: f64,
    /// Noise of a line's mean over a window, of the noisiest line.
    pub line_noise: f64,
    /// How many times its noise a line is below its threshold, of the line that is nearest.
    pub noise_margin: Option<f64>,
    /// Triggers an hour that noise alone makes, as if it were normal.
    pub false_triggers_per_hour: f64,
    /// The speed law's threshold: what each of a line's five taxels must have for it to count as lit.
    pub lit: f64,
    /// The brightest line at rest, as a share of that threshold: above 1 it counts as lit without a
    /// touch; 0 where the threshold is above the baseline.
    pub rest_of_lit: f64,
}

/// What the trigger would see.
///
/// # Errors
/// Where the configuration does not hold.
pub fn signal(still: &Still, config: &Config, measured: &Measured) -> Result<SignalReport, Error> {
    let failed = |error| Error::new("[trigger]", error);
    let trigger = config.trigger().map_err(failed)?;
    let real = |bits: u32| f64::from(bits) / 65_536.0;
    let (b, margin) = (real(trigger.multiplier().bits()), real(trigger.margin().bits()));
    let floor = 5.0 * config.features.floor_levels * 255.0 / f64::from(measured.full_scale);
    let window = usize::from(trigger.window());
    let added = measured.frames_added as usize;
    let rest = still.line_means();
    let gains = rest.map(|rest| {
        // With neither light nor a floor there is one raw count, which no mean is below.
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
    // Each line fires by itself; as many as there are windows at most.
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

/// Of each taxel the better of its two lines, of all taxels the worst.
fn least_sensitive(gains: &[f64; FEATURES]) -> f64 {
    let of_taxel = |taxel: usize| gains[taxel / COLUMNS].min(gains[ROWS + taxel % COLUMNS]);
    (0..TAXELS).map(of_taxel).fold(0.0, f64::max)
}
