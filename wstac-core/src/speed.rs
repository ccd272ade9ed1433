//! Sliding speed from how long a sample is lit (SPEC §4; paper, "Speed Regression").

use core::fmt;

use crate::error::{Error, LawParameter};
use crate::exp::{EXP_FRACTION_BITS, EXP_ONE, exp_of_negative};
use crate::features::Features;
use crate::ln::constant;
use crate::params::{
    AFTERGLOW_FRAMES, FASTEST_FITTED, FEATURE_FRACTION_BITS, NOMINAL_FRAME_RATE, SAMPLE_FRAMES, SLOWEST_FITTED,
    SPEED_INTERCEPT, SPEED_SLOPE, TRACK_LENGTH, VALID_THRESHOLD,
};
use crate::rate::FrameRate;
use crate::trigger::Event;

/// From a duration D, in frames at 30 a second, to a speed v in mm/s.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Law {
    /// D = intercept − slope · log10 v (paper).
    Published {
        /// Frames at 1 mm/s.
        intercept: f32,
        /// Frames a decade, above 0.
        slope: f32,
    },
    /// D = 30 · track / v + afterglow.
    Physical {
        /// Lit track in mm, above 0.
        track: f32,
        /// Afterglow in frames.
        afterglow: f32,
    },
}

impl Law {
    /// The paper's law with the paper's numbers.
    pub const PUBLISHED: Self = Self::Published { intercept: SPEED_INTERCEPT, slope: SPEED_SLOPE };
    /// The physical law, fitted to the paper's.
    pub const PHYSICAL: Self = Self::Physical { track: TRACK_LENGTH, afterglow: AFTERGLOW_FRAMES };

    /// Speed in mm/s of a slide that lasted `frames` at 30 a second; nothing where the law has no finite speed.
    ///
    /// Error, as a share of the speed, with u = 2^-24 for what one operation on 32 bits rounds by: `frames` is off by up to six of
    /// them, intercept and slope by one each. Their difference is then off by (intercept + 6 D) u, which the law multiplies by
    /// ln 10 / slope; three operations and the two parameters add 5 |ln v| u, and e^x 3 u. So `Published` is off by at most
    /// ((intercept + 6 D) ln 10 / slope + 5 |ln v| + 3) u: 2.5e-6 from 100 to 200 mm/s. `Physical` is off by at most
    /// ((6 D + afterglow) / (D − afterglow) + 5) u, 8e-7 there, and more towards its pole.
    pub fn speed(&self, frames: f32) -> Option<f32> {
        let mm_s = match *self {
            Self::Published { intercept, slope } => libm::expf((intercept - frames) / slope * core::f32::consts::LN_10),
            Self::Physical { track, afterglow } if frames > afterglow => {
                track * NOMINAL_FRAME_RATE as f32 / (frames - afterglow)
            }
            Self::Physical { .. } => return None,
        };
        // Beyond what 32 bits can tell from 0 or from infinity there is no answer.
        (mm_s > 0.0 && mm_s.is_finite()).then_some(mm_s)
    }

    const fn check(&self) -> Result<(), Error> {
        let (any, positive) = match *self {
            Self::Published { intercept, slope } => {
                ((LawParameter::Intercept, intercept), (LawParameter::Slope, slope))
            }
            Self::Physical { track, afterglow } => ((LawParameter::Afterglow, afterglow), (LawParameter::Track, track)),
        };
        if !any.1.is_finite() {
            return Err(Error::SpeedLaw { parameter: any.0, found: any.1 });
        }
        if !(positive.1 > 0.0 && positive.1.is_finite()) {
            return Err(Error::SpeedLaw { parameter: positive.0, found: positive.1 });
        }
        Ok(())
    }
}

/// What the validity threshold is compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum ThresholdOn {
    /// Σ o of a row or column.
    #[default]
    Absolute,
    /// Σ o less its baseline.
    AboveBaseline,
}

/// How speed is worked out; checked when built.
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
    /// Frames at 30 a second that a feature frame lasts.
    nominal_frames: f32,
    /// Slowest and fastest speed that the law was fitted on, in mm/s.
    fitted: [f32; 2],
}

/// A little above the highest feature there is, ln 5, in units of 2^-20.
const BRIGHTEST: i32 = 1_690_000;

impl SpeedConfig {
    /// A law, the threshold above which a row or column is lit (a share of full scale, summed over its five taxels:
    /// above 0, at most 5), and the camera's frame rate.
    ///
    /// # Errors
    /// [`Error::SpeedThreshold`], [`Error::SpeedLaw`].
    pub const fn new(law: Law, threshold: f64, on: ThresholdOn, rate: FrameRate) -> Result<Self, Error> {
        if !(threshold > 0.0 && threshold <= 5.0) {
            return Err(Error::SpeedThreshold(threshold));
        }
        if let Err(error) = law.check() {
            return Err(error);
        }
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

    /// The same with a law that was fitted on speeds from `slowest` to `fastest` mm/s: answers outside are marked as extrapolated.
    /// Without this it is the paper's range, 100 to 200 mm/s.
    ///
    /// # Errors
    /// [`Error::FittedRange`] unless both are finite and 0 < `slowest` ≤ `fastest`.
    pub const fn fitted_on(self, slowest: f32, fastest: f32) -> Result<Self, Error> {
        if slowest > 0.0 && slowest <= fastest && fastest.is_finite() {
            return Ok(Self { fitted: [slowest, fastest], ..self });
        }
        Err(Error::FittedRange { slowest, fastest })
    }

    /// This many mm/s, marked where that is outside the range that the law was fitted on.
    pub fn marked(&self, mm_s: f32) -> Speed {
        let [slowest, fastest] = self.fitted;
        Speed { mm_s, extrapolated: !(slowest..=fastest).contains(&mm_s) }
    }

    /// The paper's law and threshold, for cameras of this rate.
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
pub struct LitSpan {
    /// First valid frame of the sample, 0..=69.
    pub first: u8,
    /// Last valid frame of the sample, `first`..=69.
    pub last: u8,
}

impl LitSpan {
    /// D: end minus start, 0..=69 frames.
    pub fn frames(self) -> u8 {
        self.last.saturating_sub(self.first)
    }

    /// Whether the light starts before the sample or lasts beyond it.
    pub fn is_cut_off(self) -> bool {
        self.first == 0 || usize::from(self.last) == SAMPLE_FRAMES - 1
    }
}

/// A sliding speed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Speed {
    /// Speed in mm/s.
    pub mm_s: f32,
    /// Outside the range that the law was fitted on: the paper's, 100..=200 mm/s, or [`SpeedConfig::fitted_on`]'s.
    pub extrapolated: bool,
}

impl Speed {
    /// This many mm/s, marked where that is outside the paper's range.
    pub fn new(mm_s: f32) -> Self {
        Self { mm_s, extrapolated: !(SLOWEST_FITTED..=FASTEST_FITTED).contains(&mm_s) }
    }
}

/// Why there is no speed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum NoSpeed {
    /// The baseline itself is above the threshold.
    BaselineAbove,
    /// No frame of the sample is above the threshold.
    NeverValid,
    /// The first or the last frame of the sample is valid: the slide lasted at least as long as was seen.
    CutOff {
        /// What the law makes of the duration that was seen, in mm/s: a bound as good as the law is there, which is
        /// outside the range it was fitted on.
        at_most: Option<f32>,
    },
    /// The law has no finite speed for this duration.
    OutsideLaw,
}

impl NoSpeed {
    /// Returns the reason as a sentence, without the bound of [`NoSpeed::CutOff`]. JSON output and `Display` use this sentence.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::BaselineAbove => "the baseline is above the speed threshold",
            Self::NeverValid => "no frame is above the speed threshold",
            Self::CutOff { .. } => "cut off: the sample starts or ends above the speed threshold",
            Self::OutsideLaw => "the speed law has no finite speed for this duration",
        }
    }
}

impl fmt::Display for NoSpeed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl core::error::Error for NoSpeed {}

/// First and last valid frame of an event's sample; nothing where no frame is valid.
///
/// A frame is valid exactly where a feature is above ln threshold, so it differs from the real light's only where that is within a
/// feature's own error of the threshold: 0.507 units of 2^-11, 0.025 % of the light.
pub fn duration(event: &Event<'_>, config: &SpeedConfig) -> Option<LitSpan> {
    match config.on {
        ThresholdOn::Absolute => {
            // q > 2048 · ln threshold, for integers q.
            let level = config.level >> (EXP_FRACTION_BITS - FEATURE_FRACTION_BITS);
            valid_span(event, |features| features.iter().any(|&feature| i32::from(feature) > level))
        }
        ThresholdOn::AboveBaseline => {
            let base = event.baseline.means(EXP_FRACTION_BITS).map(light);
            valid_span(event, |features| {
                features.iter().zip(base).any(|(&feature, base)| {
                    let feature = i32::from(feature) << (EXP_FRACTION_BITS - FEATURE_FRACTION_BITS);
                    light(feature).saturating_sub(base) > config.light
                })
            })
        }
    }
}

/// Sliding speed of an event.
///
/// # Errors
/// Why there is none: see [`NoSpeed`].
pub fn speed(event: &Event<'_>, config: &SpeedConfig) -> Result<Speed, NoSpeed> {
    let above = |&total: &i32| {
        let scaled = i64::from(total) << (EXP_FRACTION_BITS - FEATURE_FRACTION_BITS);
        scaled > i64::from(config.level) * i64::from(event.baseline.frames())
    };
    if config.on == ThresholdOn::Absolute && event.baseline.totals().iter().any(above) {
        return Err(NoSpeed::BaselineAbove);
    }
    let duration = duration(event, config).ok_or(NoSpeed::NeverValid)?;
    if duration.is_cut_off() {
        return Err(NoSpeed::CutOff { at_most: config.at(duration) });
    }
    config.at(duration).map(|mm_s| config.marked(mm_s)).ok_or(NoSpeed::OutsideLaw)
}

/// Light of a feature in units of 2^-20: a share of [`BRIGHTEST`] in units of 2^-31.
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
