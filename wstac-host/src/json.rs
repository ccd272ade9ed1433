//! Typed outputs as the lines of `wstac run --json`. The names and values here are kept forever.

use serde::Serialize;
use wstac_core::direction::{Direction, Heading, Unclear};
use wstac_core::features::Features;
use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES};
use wstac_core::speed::{NoSpeed, Speed};
use wstac_core::trigger::InterruptedSample;

use crate::output::{Output, SampleFrames, StreamSummary, TactileEvent};
use crate::texture::Texture;

/// A line of JSON. [`JsonLine::new`] makes it from an output.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
#[non_exhaustive]
pub enum JsonLine<'a> {
    /// The features of a frame.
    Features {
        /// The number of the feature frame.
        frame: u64,
        /// Natural logarithms, exact multiples of 1/2048.
        f: [f64; FEATURES],
    },
    /// A tactile event.
    Event(Box<EventLine<'a>>),
    /// The answer of a model that needs only the first frames of a sample.
    Texture {
        /// The number of the first frame of the sample.
        frame: u64,
        /// Frames of the sample that the model reads.
        frames: u8,
        /// The model's answer.
        texture: &'a Texture,
    },
    /// A sample that a long gap interrupted.
    Incomplete(InterruptedSample),
    /// A fault of the source.
    Fault {
        /// The number of the feature frame that comes next.
        frame: u64,
        /// The kind of the fault in a word.
        fault: &'a str,
        /// A description of the fault for people.
        message: String,
    },
    /// The end of the stream.
    End {
        /// Feature frames on the time line.
        frames: u64,
        /// Camera frames that were lost.
        dropped: u64,
        /// `complete` or `incomplete`.
        baseline: &'static str,
        /// The sample that was being captured.
        incomplete: Option<InterruptedSample>,
    },
}

impl<'a> JsonLine<'a> {
    /// Returns the line of an output; `None` for lost frames and a disturbed baseline, which have none.
    pub fn new(output: &'a Output) -> Option<Self> {
        Some(match output {
            Output::Features(features) => Self::Features { frame: features.frame, f: features.features.map(real) },
            Output::Event(event) => Self::Event(Box::new(EventLine::new(event))),
            Output::EarlyTexture(early) => {
                Self::Texture { frame: early.frame, frames: early.frames, texture: &early.texture }
            }
            Output::Interrupted(sample) => Self::Incomplete(*sample),
            Output::Fault(report) => {
                Self::Fault { frame: report.frame, fault: report.fault.kind.name(), message: report.fault.to_string() }
            }
            Output::End(end) => Self::End {
                frames: end.frames,
                dropped: end.dropped,
                baseline: baseline(end),
                incomplete: end.incomplete,
            },
            Output::Lost(_) | Output::BaselineDisturbed { .. } => return None,
        })
    }
}

/// An event as a line.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct EventLine<'a> {
    frame: u64,
    frames: usize,
    duration_frames: Option<u8>,
    speed: Option<SpeedField>,
    #[serde(skip_serializing_if = "Option::is_none")]
    speed_at_most: Option<SpeedField>,
    direction: DirectionField,
    texture: Option<&'a Texture>,
    frames_filled: u8,
    reliable: bool,
    #[serde(skip_serializing_if = "WhyField::is_empty")]
    why: WhyField,
    #[serde(skip_serializing_if = "Option::is_none")]
    sample: Option<Vec<Vec<f64>>>,
}

impl<'a> EventLine<'a> {
    fn new(event: &'a TactileEvent) -> Self {
        let direction = event.direction;
        Self {
            frame: event.frame,
            frames: SAMPLE_FRAMES,
            duration_frames: event.lit_frames,
            speed: event.speed.ok().map(SpeedField::from),
            speed_at_most: event.speed_at_most.map(SpeedField::from),
            direction: DirectionField {
                deg: direction.heading.ok().map(Heading::degrees),
                confidence: confidence(direction),
            },
            texture: event.texture.as_ref(),
            frames_filled: event.frames_filled,
            reliable: event.reliable,
            why: WhyField {
                speed: event.speed.err().map(NoSpeed::as_str),
                direction: direction.heading.err().map(Unclear::as_str),
                texture: event.texture.is_none().then_some(NO_MODEL),
            },
            sample: event.sample.as_deref().map(over_time),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct SpeedField {
    mm_s: f64,
    extrapolated: bool,
}

impl From<Speed> for SpeedField {
    fn from(speed: Speed) -> Self {
        Self { mm_s: rounded(speed.mm_s), extrapolated: speed.extrapolated }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct DirectionField {
    deg: Option<u16>,
    confidence: f64,
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
struct WhyField {
    #[serde(skip_serializing_if = "Option::is_none")]
    speed: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    direction: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    texture: Option<&'static str>,
}

impl WhyField {
    fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The words for a person about a missing texture.
pub const NO_MODEL: &str = "no model was given";

/// Returns `complete` or `incomplete`.
pub fn baseline(end: &StreamSummary) -> &'static str {
    if end.baseline_complete { "complete" } else { "incomplete" }
}

/// Returns a direction's confidence for output, 0 to 1, with four decimals.
pub fn confidence(direction: Direction) -> f64 {
    (f64::from(direction.confidence()) * 1e4).round() / 1e4
}

/// Returns a sample as ten features over 70 frames, as real numbers.
fn over_time(sample: &SampleFrames) -> Vec<Vec<f64>> {
    let over_time = |feature: usize| move |frame: &Features| real(frame[feature]);
    (0..FEATURES).map(|feature| sample.iter().map(over_time(feature)).collect()).collect()
}

/// Returns a feature as a real number: an exact multiple of 1/2048.
pub fn real(feature: i16) -> f64 {
    f64::from(feature) / f64::from(FEATURE_ONE)
}

/// Returns a speed for output: one decimal, or four significant digits if that is finer.
pub fn rounded(mm_s: f32) -> f64 {
    let value = f64::from(mm_s);
    let tenths = (value * 10.0).round() / 10.0;
    if tenths >= 100.0 || value <= 0.0 || !value.is_finite() {
        return tenths;
    }
    // Below 100, the last of four digits is 10^-decimals. Division by a power of ten up to 10^22 rounds correctly, so
    // the result is the number that is written with these digits.
    let decimals = 3 - value.log10().floor() as i32;
    // As formatting does it: ties to even.
    let digits = |decimals: i32| (value * 10_f64.powi(decimals)).round_ties_even();
    // A logarithm near a whole number may be one off.
    let decimals = match digits(decimals) {
        found if found >= 10_000.0 => decimals - 1,
        found if found < 1000.0 => decimals + 1,
        _ => decimals,
    };
    if decimals > 22 { value } else { digits(decimals) / 10_f64.powi(decimals) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the number that a reader makes of the written digits.
    fn written(mm_s: f32) -> f64 {
        let tenths = (f64::from(mm_s) * 10.0).round() / 10.0;
        if tenths >= 100.0 { tenths } else { format!("{mm_s:.3e}").parse().unwrap() }
    }

    #[test]
    fn rounded_speeds_are_the_written_numbers() {
        let mut bits = 1.0e-6_f32.to_bits();
        let mut compared = 0;
        while bits < 120.0_f32.to_bits() {
            let mm_s = f32::from_bits(bits);
            assert_eq!(rounded(mm_s).to_bits(), written(mm_s).to_bits(), "{mm_s}");
            bits += 997;
            compared += 1;
        }
        assert!(compared > 200_000, "{compared}");
        for mm_s in [9.9999_f32, 10.0, 0.1, 1.0, 99.94, 99.96, 99.951, 1e-3, 150.04, 0.0] {
            assert_eq!(rounded(mm_s).to_bits(), written(mm_s).to_bits(), "{mm_s}");
        }
    }
}
