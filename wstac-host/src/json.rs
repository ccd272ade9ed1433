//! Typed outputs as the lines of `wstac run --json`. The names and values here are kept forever.

use std::time::SystemTime;

use serde::Serialize;
use wstac_core::features::Features;
use wstac_core::paper::direction::Direction;
use wstac_core::paper::speed::Speed;
use wstac_core::paper::trigger::InterruptedSample;
use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES};
use wstac_core::reason::Reason;
use wstac_core::touch::motion::Contact;
use wstac_core::touch::wave::{Basis, Measured};

use crate::output::{
    ContactEndReport, EarlyTexture, FaultReport, FrameFeatures, InterruptedReport, MotionReport, Output, SampleFrames,
    SlipReport, Stamp, StreamClock, StreamSummary, TactileEvent,
};
use crate::source::LossCounts;
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
        /// The time of the frame in nanoseconds; `None` from a board whose clock is not known yet.
        time_ns: Option<u64>,
        /// The wall-clock time of the frame.
        #[serde(flatten)]
        stamp: StampFields,
        /// Natural logarithms, exact multiples of 1/2048.
        f: [f64; FEATURES],
    },
    /// Speed and direction of a frame while something slides.
    Motion {
        /// The number of the feature frame.
        frame: u64,
        /// The time of the frame in nanoseconds; `None` from a board whose clock is not known yet.
        time_ns: Option<u64>,
        /// The wall-clock time of the frame.
        #[serde(flatten)]
        stamp: StampFields,
        /// The time of the frame in seconds from the first frame; `None` from a board whose clock is not known
        /// yet.
        time_s: Option<f64>,
        /// The kind of the touch: always `slide`.
        contact: &'static str,
        /// The sliding speed.
        speed: SpeedField,
        /// The sliding direction.
        direction: DirectionField,
        /// The part of the light that tells both: `edge` or `outline`.
        #[serde(skip_serializing_if = "Option::is_none")]
        basis: Option<&'static str>,
    },
    /// A tactile event.
    Event(Box<EventLine<'a>>),
    /// The answer of a model that needs only the first frames of a sample.
    Texture {
        /// The number of the first frame of the sample.
        frame: u64,
        /// The time of that frame in nanoseconds; `None` from a board whose clock is not known yet.
        time_ns: Option<u64>,
        /// The wall-clock time of the frame.
        #[serde(flatten)]
        stamp: StampFields,
        /// Frames of the sample that the model reads.
        frames: u8,
        /// The model's answer.
        texture: &'a Texture,
    },
    /// A sample that a long gap interrupted.
    Incomplete {
        /// The number of its first frame.
        frame: u64,
        /// The time of that frame in nanoseconds; `None` from a board whose clock is not known yet.
        time_ns: Option<u64>,
        /// The wall-clock time of the frame.
        #[serde(flatten)]
        stamp: StampFields,
        /// The number of its frames that had arrived: 1 to 69.
        frames: u8,
    },
    /// The end of the touch of an event: its light has left.
    #[serde(rename = "contact_end")]
    ContactEnd {
        /// The number of the first dark frame behind the touch.
        frame: u64,
        /// The number of the first frame of the event's sample.
        event_frame: u64,
        /// The time of that dark frame in nanoseconds; `None` from a board whose clock is not known yet.
        time_ns: Option<u64>,
        /// The wall-clock time of the frame.
        #[serde(flatten)]
        stamp: StampFields,
        /// The time of that dark frame in seconds from the first frame; `None` from a board whose clock is not known
        /// yet.
        time_s: Option<f64>,
    },
    /// A held part that begins to slip.
    Slip {
        /// The number of the frame that shows the slip.
        frame: u64,
        /// The time of that frame in nanoseconds; `None` from a board whose clock is not known yet.
        time_ns: Option<u64>,
        /// The wall-clock time of the frame.
        #[serde(flatten)]
        stamp: StampFields,
        /// The number of the first frame with light of the motion.
        onset_frame: u64,
        /// The number of the first frame with light of the press, or, after a slip, of the frame in which its rest was
        /// known.
        held_since_frame: u64,
        /// The most light of a frame since the onset, as a fraction of the press's brightest frame, with two decimals.
        strength: f64,
    },
    /// A fault of the source.
    Fault {
        /// The number of the feature frame that comes next.
        frame: u64,
        /// The time of that frame in nanoseconds; `None` before the first frame.
        time_ns: Option<u64>,
        /// The wall-clock time of the frame.
        #[serde(flatten)]
        stamp: StampFields,
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
        /// The lost frames by reason, if any were lost and the reasons are known.
        #[serde(skip_serializing_if = "LossCounts::is_empty")]
        dropped_by: LossCounts,
        /// `complete` or `incomplete`.
        baseline: &'static str,
        /// The sample that was being captured.
        incomplete: Option<InterruptedSample>,
        /// The time of the last feature frame in nanoseconds; `None` without one, or from a board whose clock is not
        /// known yet.
        time_ns: Option<u64>,
        /// The wall-clock time of the frame.
        #[serde(flatten)]
        stamp: StampFields,
        /// The clock of all times: `driver`, `board` or `frames`.
        clock: StreamClock,
        /// The milliseconds in which a rolling shutter reads its rows; `null` if nobody stated them.
        #[serde(skip_serializing_if = "Option::is_none")]
        readout_ms: Option<Option<f64>>,
    },
}

impl<'a> JsonLine<'a> {
    /// Returns the line of an output; `None` for lost frames and a disturbed baseline, which have none.
    pub fn new(output: &'a Output) -> Option<Self> {
        Some(match *output {
            Output::Features(FrameFeatures { frame, time_ns, stamp, ref features }) => {
                Self::Features { frame, time_ns, stamp: StampFields::new(stamp), f: features.map(real) }
            }
            Output::Motion(MotionReport { frame, time_ns, stamp, time_s, velocity, basis }) => Self::Motion {
                frame,
                time_ns,
                stamp: StampFields::new(stamp),
                time_s: time_s.map(seconds),
                contact: Contact::Slide.as_str(),
                speed: Speed::by_arrival(velocity.mm_s, velocity.mm_s_sd).into(),
                direction: DirectionField::Arrival { deg: angle(velocity.degrees), sd: spread(velocity.degrees_sd) },
                basis: basis.map(Basis::as_str),
            },
            Output::Event(ref event) => Self::Event(Box::new(EventLine::new(event))),
            Output::EarlyTexture(EarlyTexture { frame, time_ns, stamp, frames, ref texture }) => {
                Self::Texture { frame, time_ns, stamp: StampFields::new(stamp), frames, texture }
            }
            Output::Interrupted(InterruptedReport { frame, time_ns, stamp, frames }) => {
                Self::Incomplete { frame, time_ns, stamp: StampFields::new(stamp), frames }
            }
            Output::ContactEnd(ContactEndReport { frame, event_frame, time_ns, stamp, time_s }) => {
                let (stamp, time_s) = (StampFields::new(stamp), time_s.map(seconds));
                Self::ContactEnd { frame, event_frame, time_ns, stamp, time_s }
            }
            Output::Slip(SlipReport { frame, time_ns, stamp, onset_frame, held_since_frame, strength: light }) => {
                let (stamp, strength) = (StampFields::new(stamp), strength(light));
                Self::Slip { frame, time_ns, stamp, onset_frame, held_since_frame, strength }
            }
            Output::Fault(FaultReport { frame, time_ns, stamp, ref fault }) => {
                let (fault, message) = (fault.kind.name(), fault.to_string());
                Self::Fault { frame, time_ns, stamp: StampFields::new(stamp), fault, message }
            }
            Output::End(ref end) => Self::End {
                frames: end.frames,
                dropped: end.dropped,
                dropped_by: end.dropped_by,
                baseline: baseline(end),
                incomplete: end.incomplete,
                time_ns: end.time_ns,
                stamp: StampFields::new(end.stamp),
                clock: end.clock,
                readout_ms: end.readout.recorded_ms(),
            },
            Output::Lost(_) | Output::BaselineDisturbed { .. } => return None,
        })
    }
}

/// The wall-clock time of a line. A line whose source knows none has neither field.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StampFields {
    /// The time as RFC 3339 in UTC, with milliseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stamp: Option<String>,
    /// The most by which it may be wrong, by this machine's clock, in milliseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stamp_within_ms: Option<f64>,
}

impl StampFields {
    /// Creates the fields of a wall-clock time, if there is one.
    pub fn new(stamp: Option<Stamp>) -> Self {
        Self { stamp: stamp.map(|stamp| in_utc(stamp.time)), stamp_within_ms: stamp.map(within_ms) }
    }
}

/// Returns the uncertainty of a wall-clock time in milliseconds for output, with three decimals.
pub fn within_ms(stamp: Stamp) -> f64 {
    rounded_to(stamp.within.as_secs_f64() * 1000.0, 3)
}

/// A line of JSON with the name of its sensor, as several sensors need it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensorLine<'a> {
    /// The name of the sensor, which comes first; `None` for the only one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor: Option<&'a str>,
    /// The line itself.
    #[serde(flatten)]
    pub line: JsonLine<'a>,
}

/// An event as a line.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct EventLine<'a> {
    frame: u64,
    frames: usize,
    time_ns: Option<u64>,
    completed_ns: Option<u64>,
    #[serde(flatten)]
    touch: Option<TouchFields>,
    duration_frames: Option<u8>,
    speed: Option<SpeedField>,
    #[serde(skip_serializing_if = "Option::is_none")]
    speed_at_most: Option<SpeedField>,
    direction: Option<DirectionField>,
    #[serde(skip_serializing_if = "Option::is_none")]
    basis: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    place_mm: Option<MeasuredField>,
    #[serde(skip_serializing_if = "Option::is_none")]
    width_mm: Option<MeasuredField>,
    #[serde(skip_serializing_if = "Option::is_none")]
    contacts: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    acceleration: Option<AccelerationField>,
    texture: Option<&'a Texture>,
    #[serde(skip_serializing_if = "Option::is_none")]
    period_mm: Option<MeasuredField>,
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
            time_ns: event.time_ns,
            completed_ns: event.completed_ns,
            touch: TouchFields::new(event),
            duration_frames: event.lit_frames,
            speed: event.speed.ok().map(SpeedField::from),
            speed_at_most: event.speed_at_most.map(SpeedField::from),
            direction: DirectionField::new(direction),
            basis: event.basis.map(Basis::as_str),
            place_mm: event.extent.and_then(|extent| extent.place_mm).map(MeasuredField::from),
            width_mm: event.extent.and_then(|extent| extent.width_mm).map(MeasuredField::from),
            contacts: event.extent.map(|extent| extent.contacts),
            acceleration: event.acceleration.map(AccelerationField::from),
            texture: event.texture.as_ref().ok(),
            period_mm: event.period_mm.map(MeasuredField::from),
            frames_filled: event.frames_filled,
            reliable: event.reliable,
            why: WhyField {
                speed: event.speed.err().map(Reason::as_str),
                direction: direction.degrees.err().map(Reason::as_str),
                texture: event.why_texture(),
                reliable: event.doubt.map(Reason::as_str),
            },
            sample: event.sample.as_deref().map(over_time),
        }
    }
}

/// The fields of an event that a law of durations does not have.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct TouchFields {
    touch_frame: Option<u64>,
    end_frame: Option<u64>,
    time_s: Option<f64>,
    completed_s: Option<f64>,
    stamp: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stamp_within_ms: Option<f64>,
    contact: &'static str,
}

impl TouchFields {
    fn new(event: &TactileEvent) -> Option<Self> {
        let time = event.time;
        Some(Self {
            touch_frame: event.touch_frame,
            end_frame: event.end_frame,
            time_s: time.map(|time| seconds(time.touch_s)),
            completed_s: time.map(|time| seconds(time.completed_s)),
            stamp: event.stamp.map(|stamp| in_utc(stamp.time)),
            stamp_within_ms: event.stamp.map(within_ms),
            contact: event.contact?.as_str(),
        })
    }
}

/// Returns a time as RFC 3339 writes it, in UTC with milliseconds.
pub fn in_utc(time: SystemTime) -> String {
    humantime::format_rfc3339_millis(time).to_string()
}

/// A length in mm, with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct MeasuredField {
    value: f64,
    sd: f64,
}

impl From<Measured> for MeasuredField {
    fn from(measured: Measured) -> Self {
        Self { value: millimeters(measured.value), sd: millimeters(measured.sd) }
    }
}

/// An acceleration in mm/s², with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct AccelerationField {
    mm_s2: f64,
    sd: f64,
}

impl From<Measured> for AccelerationField {
    fn from(measured: Measured) -> Self {
        Self { mm_s2: millimeters(measured.value), sd: millimeters(measured.sd).max(0.01) }
    }
}

/// A speed, with its standard deviation by arrival times, and without it by a law of durations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SpeedField {
    mm_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    sd: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    extrapolated: Option<bool>,
}

impl From<Speed> for SpeedField {
    fn from(speed: Speed) -> Self {
        let sd = speed.sd.map(rounded);
        Self { mm_s: rounded(speed.mm_s), sd, extrapolated: sd.is_none().then_some(speed.extrapolated) }
    }
}

/// A direction as a field of a line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum DirectionField {
    /// By arrival times, any angle.
    Arrival {
        /// The angle in degrees.
        deg: f64,
        /// Its standard deviation in degrees.
        sd: f64,
    },
    /// By centroids, one of four.
    Centroids {
        /// The angle in degrees.
        deg: Option<u16>,
        /// The confidence, 0 to 1.
        confidence: f64,
    },
}

impl DirectionField {
    /// Returns the field of a direction; `None` if arrival times give none.
    fn new(direction: Direction) -> Option<Self> {
        if let Some(confidence) = confidence(direction) {
            let deg = direction.degrees.ok().map(|degrees| degrees as u16);
            return Some(Self::Centroids { deg, confidence });
        }
        Some(Self::Arrival { deg: angle(direction.degrees.ok()?), sd: spread(direction.sd?) })
    }
}

/// Returns an angle in degrees for output, with one decimal: 0 ≤ angle < 360.
pub fn angle(degrees: f32) -> f64 {
    // 359.96 is rounded to a whole turn, and zero has no sign.
    rounded_to(f64::from(degrees), 1) % 360.0 + 0.0
}

/// Returns the standard deviation of an angle in degrees for output, with two decimals.
pub fn spread(degrees: f32) -> f64 {
    rounded_to(f64::from(degrees), 2)
}

/// Returns a length in mm for output, with two decimals.
pub fn millimeters(length: f32) -> f64 {
    rounded_to(f64::from(length), 2) + 0.0
}

/// Returns the strength of a slip for output, with two decimals.
pub fn strength(light: f32) -> f64 {
    rounded_to(f64::from(light), 2)
}

/// Returns a time in seconds for output, with four decimals.
pub fn seconds(time: f64) -> f64 {
    rounded_to(time, 4)
}

fn rounded_to(number: f64, decimals: i32) -> f64 {
    let ten = 10_f64.powi(decimals);
    (number * ten).round() / ten
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
struct WhyField {
    #[serde(skip_serializing_if = "Option::is_none")]
    speed: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    direction: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    texture: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reliable: Option<&'static str>,
}

impl WhyField {
    fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// Returns `complete` or `incomplete`.
pub fn baseline(end: &StreamSummary) -> &'static str {
    if end.baseline_complete { "complete" } else { "incomplete" }
}

/// Returns the confidence of a direction by centroids for output, 0 to 1, with four decimals.
pub fn confidence(direction: Direction) -> Option<f64> {
    direction.confidence().map(|confidence| rounded_to(f64::from(confidence), 4))
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

/// Returns a value with its standard deviation as people read them: `119.4 ± 0.3`, or `690 ± 14` from a deviation of 10
/// on. Both have the same decimals, so that a rounded value never seems to be several deviations off; the least is 0.1.
///
/// ```
/// assert_eq!(wstac_host::json::with_deviation(119.4, 0.349), "119.4 ± 0.3");
/// assert_eq!(wstac_host::json::with_deviation(690.2, 13.73), "690 ± 14");
/// ```
pub fn with_deviation(value: f64, sd: f32) -> String {
    format!("{value:.*} ± {}", usize::from(sd < 9.95), short(sd))
}

/// Returns a standard deviation with one decimal below 10, at least 0.1, and without above.
pub(crate) fn short(sd: f32) -> String {
    if sd < 9.95 { format!("{:.1}", sd.max(0.1)) } else { format!("{sd:.0}") }
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

    #[test]
    fn angles_are_written_from_zero_to_below_a_turn() {
        for (degrees, expected) in [(0.0, 0.0), (-0.0, 0.0), (0.04, 0.0), (359.94, 359.9), (359.96, 0.0), (90.25, 90.3)]
        {
            assert_eq!(angle(degrees).to_bits(), f64::to_bits(expected), "{degrees}");
        }
    }
}
