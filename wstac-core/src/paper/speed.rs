//! Sliding speed from the duration for which a sample is lit (SPEC §4; paper, "Speed Regression").
//!
//! It holds for specimens of one length, within the range that its law was fitted on.
//! [`motion`](crate::touch::motion) needs neither.

use crate::error::{ConfigError, LawParameter};
use crate::exp::{EXP_FRACTION_BITS, EXP_ONE, EXTRA_BITS, exp_of_negative, widened};
use crate::features::Features;
use crate::ln::constant;
use crate::paper::trigger::Event;
use crate::params::{FASTEST_FITTED, SAMPLE_FRAMES, SLOWEST_FITTED, SPEED_INTERCEPT, SPEED_SLOPE, VALID_THRESHOLD};
use crate::rate::FrameRate;
use crate::reason::Reason;

/// The published law from a duration D, in frames at 30 per second, to a speed v in mm/s: D = intercept − slope · log10
/// v.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Law {
    /// The frames at 1 mm/s.
    pub intercept: f32,
    /// The frames per decade, above 0.
    pub slope: f32,
}

impl Law {
    /// The law with the paper's numbers.
    pub const PUBLISHED: Self = Self { intercept: SPEED_INTERCEPT, slope: SPEED_SLOPE };

    /// Returns the speed in mm/s of a slide that lasted `frames` at 30 per second; `None` if the law has no finite
    /// speed.
    ///
    /// The error is a fraction of the speed. Let u = 2^-24 be the rounding of one 32-bit operation. `frames` is off by
    /// up to six of them, intercept and slope by one each. Their difference is then off by (intercept + 6 D) u, which
    /// the law multiplies by ln 10 / slope. Three operations and the two parameters add 5 |ln v| u, and e^x adds 3 u.
    ///
    /// So it is off by at most ((intercept + 6 D) ln 10 / slope + 5 |ln v| + 3) u: 2.5e-6 from 100 to 200 mm/s.
    pub fn speed(&self, frames: f32) -> Option<f32> {
        let mm_s = libm::expf((self.intercept - frames) / self.slope * core::f32::consts::LN_10);
        // There is no answer if 32 bits cannot tell it from 0 or from infinity.
        (mm_s > 0.0 && mm_s.is_finite()).then_some(mm_s)
    }

    const fn check(self) -> Result<(), ConfigError> {
        let Self { intercept, slope } = self;
        if !intercept.is_finite() {
            return Err(ConfigError::SpeedLaw { parameter: LawParameter::Intercept, found: intercept });
        }
        if !(slope > 0.0 && slope.is_finite()) {
            return Err(ConfigError::SpeedLaw { parameter: LawParameter::Slope, found: slope });
        }
        Ok(())
    }
}

/// The quantity that the validity threshold is compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
// It is exhaustive: light is absolute or above the baseline.
pub enum ThresholdOn {
    /// The light Σ o of a row or column.
    #[default]
    Absolute,
    /// The light Σ o of a row or column less its baseline.
    AboveBaseline,
}

/// The parameters of the speed computation, checked when they are built.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct SpeedConfig {
    law: Law,
    on: ThresholdOn,
    /// ln threshold in units of 2^-20, rounded down.
    level: i32,
    /// The threshold in units of [`BRIGHTEST`] · 2^-31, rounded down.
    light: u32,
    /// Frames at 30 per second that a feature frame lasts.
    nominal_frames: f32,
    /// Slowest and fastest speed that the law was fitted on, in mm/s.
    fitted: [f32; 2],
}

/// A little above the highest possible feature, ln 5, in units of 2^-20.
const BRIGHTEST: i32 = 1_690_000;

impl SpeedConfig {
    /// Creates the parameters from a law, a threshold and the camera's frame rate.
    ///
    /// A row or column is lit above the threshold. The threshold is a fraction of full scale, summed over its five
    /// taxels: above 0, at most 5.
    ///
    /// # Errors
    /// Returns [`ConfigError::SpeedThreshold`] or [`ConfigError::SpeedLaw`] if one of them is out of range.
    pub const fn new(law: Law, threshold: f64, on: ThresholdOn, rate: FrameRate) -> Result<Self, ConfigError> {
        if !(threshold > 0.0 && threshold <= 5.0) {
            return Err(ConfigError::SpeedThreshold(threshold));
        }
        attempt!(law.check());
        let one = (1 << EXP_FRACTION_BITS) as f64;
        let brightest = constant::exp(-(BRIGHTEST as f64) / one);
        let level = constant::floor(constant::ln(threshold) * one);
        Ok(Self {
            law,
            on,
            // A threshold below e^-2048 is below every feature.
            level: if level < i32::MIN as i64 { i32::MIN } else { level as i32 },
            light: (threshold * brightest * EXP_ONE as f64) as u32,
            nominal_frames: rate.nominal_frames(),
            fitted: [SLOWEST_FITTED, FASTEST_FITTED],
        })
    }

    /// Returns the parameters with the range of speeds that the law was fitted on, from `slowest` to `fastest` mm/s.
    ///
    /// Answers outside are marked as extrapolated. Without this call the range is the paper's, 100 to 200 mm/s.
    ///
    /// # Errors
    /// Returns [`ConfigError::FittedRange`] unless both are finite and 0 < `slowest` ≤ `fastest`.
    pub const fn fitted_on(self, slowest: f32, fastest: f32) -> Result<Self, ConfigError> {
        if slowest > 0.0 && slowest <= fastest && fastest.is_finite() {
            return Ok(Self { fitted: [slowest, fastest], ..self });
        }
        Err(ConfigError::FittedRange { slowest, fastest })
    }

    /// Returns a speed of this many mm/s, marked if it is outside the range that the law was fitted on.
    pub fn marked(&self, mm_s: f32) -> Speed {
        let [slowest, fastest] = self.fitted;
        Speed { mm_s, sd: None, extrapolated: !(slowest..=fastest).contains(&mm_s) }
    }

    /// Creates the published law and threshold for cameras of this rate.
    pub const fn published(rate: FrameRate) -> Self {
        const PUBLISHED: SpeedConfig =
            match SpeedConfig::new(Law::PUBLISHED, VALID_THRESHOLD, ThresholdOn::Absolute, FrameRate::NOMINAL) {
                Ok(config) => config,
                Err(_) => panic!("the published numbers are valid: decided at compile time"),
            };
        Self { nominal_frames: rate.nominal_frames(), ..PUBLISHED }
    }

    fn at(&self, duration: LitSpan) -> Option<f32> {
        self.law.speed(f32::from(duration.frames()) * self.nominal_frames)
    }
}

/// The lit part of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct LitSpan {
    /// The first valid frame of the sample, 0..=69.
    pub first: u8,
    /// The last valid frame of the sample, `first`..=69.
    pub last: u8,
}

impl LitSpan {
    /// Creates the span from the frame `first` to the frame `last` of a sample.
    pub const fn new(first: u8, last: u8) -> Self {
        Self { first, last }
    }

    /// Returns the duration D: end minus start, 0..=69 frames.
    pub fn frames(self) -> u8 {
        self.last.saturating_sub(self.first)
    }

    /// Returns whether the light starts before the sample or lasts beyond it.
    pub fn is_cut_off(self) -> bool {
        self.first == 0 || usize::from(self.last) == SAMPLE_FRAMES - 1
    }
}

/// A sliding speed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Speed {
    /// The speed in mm/s.
    pub mm_s: f32,
    /// The standard deviation in mm/s; `None` by a duration, which has none.
    pub sd: Option<f32>,
    /// Whether the speed is outside the range that a law of durations was fitted on: the paper's, 100..=200 mm/s, or
    /// that of [`SpeedConfig::fitted_on`]. By arrival times it never is.
    pub extrapolated: bool,
}

impl Speed {
    /// Creates a speed of this many mm/s, marked if it is outside the paper's range.
    pub fn new(mm_s: f32) -> Self {
        Self { mm_s, sd: None, extrapolated: !(SLOWEST_FITTED..=FASTEST_FITTED).contains(&mm_s) }
    }

    /// Creates a speed by arrival times: mm/s with their standard deviation.
    pub const fn by_arrival(mm_s: f32, sd: f32) -> Self {
        Self { mm_s, sd: Some(sd), extrapolated: false }
    }
}

/// The former name of [`Reason`].
#[deprecated(since = "0.4.0", note = "use `reason::Reason`")]
pub type NoSpeed = Reason;

/// Returns the first and last valid frame of an event's sample; `None` if no frame is valid.
///
/// A frame is valid if and only if a feature is above ln threshold. A feature's own error is 0.507 units of 2^-11,
/// which is 0.025 % of the light. So the result differs from that of the real light only if the light is that close to
/// the threshold.
pub fn duration(event: &Event<'_>, config: &SpeedConfig) -> Option<LitSpan> {
    match config.on {
        ThresholdOn::Absolute => {
            // q > 2048 · ln threshold, for integers q.
            let level = config.level >> EXTRA_BITS;
            valid_span(event, |features| features.iter().any(|&feature| i32::from(feature) > level))
        }
        ThresholdOn::AboveBaseline => {
            let base = event.baseline.means(EXP_FRACTION_BITS).map(light);
            valid_span(event, |features| {
                features
                    .iter()
                    .zip(base)
                    .any(|(&feature, base)| light(widened(feature)).saturating_sub(base) > config.light)
            })
        }
    }
}

/// Returns the sliding speed of an event.
///
/// # Errors
/// Returns the reason why there is none.
pub fn speed(event: &Event<'_>, config: &SpeedConfig) -> Result<Speed, Reason> {
    let above = |&total: &i32| {
        let scaled = i64::from(total) << EXTRA_BITS;
        scaled > i64::from(config.level) * i64::from(event.baseline.frames())
    };
    if config.on == ThresholdOn::Absolute && event.baseline.totals().iter().any(above) {
        return Err(Reason::BaselineAbove);
    }
    let duration = duration(event, config).ok_or(Reason::NeverValid)?;
    if duration.is_cut_off() {
        return Err(Reason::CutOff { at_most: config.at(duration) });
    }
    config.at(duration).map(|mm_s| config.marked(mm_s)).ok_or(Reason::OutsideLaw)
}

/// Returns the light of a feature in units of 2^-20, as a fraction of [`BRIGHTEST`] in units of 2^-31.
fn light(feature: i32) -> u32 {
    exp_of_negative((BRIGHTEST - feature).max(0) as u32)
}

fn valid_span(event: &Event<'_>, is_valid: impl Fn(&Features) -> bool) -> Option<LitSpan> {
    let mut span = None;
    for (number, features) in (0_u8..).zip(event.sample.frames()) {
        if is_valid(features) {
            let first = span.map_or(number, |span: LitSpan| span.first);
            span = Some(LitSpan { first, last: number });
        }
    }
    span
}
