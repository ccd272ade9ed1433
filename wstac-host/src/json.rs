//! Typed outputs as the lines of `wstac run --json`. The names and values here are kept forever.

use std::time::SystemTime;

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use wstac_core::features::Features;
use wstac_core::paper::direction::Direction;
use wstac_core::paper::speed::Speed;
use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES};
use wstac_core::reason::Reason;
use wstac_core::touch::motion::Contact;
use wstac_core::touch::wave::{Basis, Measured};

use crate::output::{Output, SampleFrames, Stamp, StreamSummary, TactileEvent};

/// An output as a line of JSON: its `kind`, and the fields that `wstac help json` describes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JsonLine<'a>(&'a Output);

impl<'a> JsonLine<'a> {
    /// Returns the line of an output; `None` for lost frames and a disturbed baseline, which have none.
    pub fn new(output: &'a Output) -> Option<Self> {
        (!matches!(output, Output::Lost(_) | Output::BaselineDisturbed { .. })).then_some(Self(output))
    }
}

impl Serialize for JsonLine<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (output, mut line) = (self.0, Fields(serializer.serialize_map(None)?));
        match output {
            Output::Features(features) => {
                line.head("features", features.frame, output)?;
                line.add("f", &features.features.map(real))?;
            }
            Output::Motion(motion) => {
                let velocity = motion.velocity;
                line.head("motion", motion.frame, output)?;
                line.add("time_s", &motion.time_s.map(seconds))?;
                line.add("contact", Contact::Slide.as_str())?;
                line.add("speed", &SpeedField::from(Speed::by_arrival(velocity.mm_s, velocity.mm_s_sd)))?;
                let (deg, sd) = (angle(velocity.degrees), spread(velocity.degrees_sd));
                line.add("direction", &DirectionField::Arrival { deg, sd })?;
                line.add_any("basis", motion.basis.map(Basis::as_str))?;
            }
            Output::Event(event) => line.event(event)?,
            Output::EarlyTexture(early) => {
                line.head("texture", early.frame, output)?;
                line.add("frames", &early.frames)?;
                line.add("texture", &early.texture)?;
            }
            Output::Interrupted(sample) => {
                line.head("incomplete", sample.frame, output)?;
                line.add("frames", &sample.frames)?;
            }
            Output::ContactEnd(end) => {
                line.add("kind", "contact_end")?;
                line.add("frame", &end.frame)?;
                line.add("event_frame", &end.event_frame)?;
                line.times(output)?;
                line.add("time_s", &end.time_s.map(seconds))?;
            }
            Output::Slip(slip) => {
                line.head("slip", slip.frame, output)?;
                line.add("onset_frame", &slip.onset_frame)?;
                line.add("held_since_frame", &slip.held_since_frame)?;
                line.add("strength", &strength(slip.strength))?;
            }
            Output::Fault(report) => {
                line.head("fault", report.frame, output)?;
                line.add("fault", report.fault.kind.name())?;
                line.add("message", &report.fault.to_string())?;
            }
            Output::End(end) => {
                line.add("kind", "end")?;
                line.add("frames", &end.frames)?;
                line.add("dropped", &end.dropped)?;
                line.add_any("dropped_by", Some(end.dropped_by).filter(|by| !by.is_empty()))?;
                line.add_any("lost_events", Some(end.lost_events).filter(|lost| *lost > 0))?;
                line.add("baseline", baseline(end))?;
                line.add("incomplete", &end.incomplete)?;
                line.times(output)?;
                line.add("clock", &end.clock)?;
                line.add_any("readout_ms", end.readout.recorded_ms())?;
            }
            Output::Lost(_) | Output::BaselineDisturbed { .. } => {}
        }
        line.0.end()
    }
}

/// The fields of a line that is being written.
struct Fields<M>(M);

impl<M: SerializeMap> Fields<M> {
    fn add(&mut self, name: &'static str, value: &(impl Serialize + ?Sized)) -> Result<(), M::Error> {
        self.0.serialize_entry(name, value)
    }

    /// Writes a field that lines without a value do not have.
    fn add_any(&mut self, name: &'static str, value: Option<impl Serialize>) -> Result<(), M::Error> {
        value.map_or(Ok(()), |value| self.add(name, &value))
    }

    /// Writes the fields with which most lines begin.
    fn head(&mut self, kind: &str, frame: u64, output: &Output) -> Result<(), M::Error> {
        self.add("kind", kind)?;
        self.add("frame", &frame)?;
        self.times(output)
    }

    fn times(&mut self, output: &Output) -> Result<(), M::Error> {
        let StampFields { stamp, stamp_within_ms } = StampFields::new(output.stamp());
        self.add("time_ns", &output.time_ns())?;
        self.add_any("stamp", stamp)?;
        self.add_any("stamp_within_ms", stamp_within_ms)
    }

    fn event(&mut self, event: &TactileEvent) -> Result<(), M::Error> {
        let (direction, extent) = (event.direction, event.extent);
        self.add("kind", "event")?;
        self.add("frame", &event.frame)?;
        self.add("frames", &SAMPLE_FRAMES)?;
        self.add("time_ns", &event.time_ns)?;
        self.add("completed_ns", &event.completed_ns)?;
        if let Some(contact) = event.contact {
            let StampFields { stamp, stamp_within_ms } = StampFields::new(event.stamp);
            self.add("touch_frame", &event.touch_frame)?;
            self.add("end_frame", &event.end_frame)?;
            self.add("time_s", &event.time.map(|time| seconds(time.touch_s)))?;
            self.add("completed_s", &event.time.map(|time| seconds(time.completed_s)))?;
            self.add("stamp", &stamp)?;
            self.add_any("stamp_within_ms", stamp_within_ms)?;
            self.add("contact", contact.as_str())?;
        }
        self.add("duration_frames", &event.lit_frames)?;
        self.add("speed", &event.speed.ok().map(SpeedField::from))?;
        self.add_any("speed_at_most", event.speed_at_most.map(SpeedField::from))?;
        self.add("direction", &DirectionField::new(direction))?;
        self.add_any("basis", event.basis.map(Basis::as_str))?;
        self.add_any("place_mm", extent.and_then(|extent| extent.place_mm).map(length))?;
        self.add_any("width_mm", extent.and_then(|extent| extent.width_mm).map(length))?;
        self.add_any("contacts", extent.map(|extent| extent.contacts))?;
        let acceleration =
            |Measured { value, sd }| Object([("mm_s2", millimeters(value)), ("sd", millimeters(sd).max(0.01))]);
        self.add_any("acceleration", event.acceleration.map(acceleration))?;
        self.add("texture", &event.texture.as_ref().ok())?;
        self.add_any("period_mm", event.period_mm.map(length))?;
        self.add("frames_filled", &event.frames_filled)?;
        self.add("reliable", &event.reliable)?;
        let why_texture = event.why_texture();
        let why = [
            ("speed", event.speed.err().map(Reason::as_str)),
            ("direction", direction.degrees.err().map(Reason::as_str)),
            ("texture", why_texture.as_deref()),
            ("reliable", event.doubt.map(Reason::as_str)),
        ];
        let why: Vec<_> = why.into_iter().filter_map(|(of, why)| Some((of, why?))).collect();
        self.add_any("why", (!why.is_empty()).then_some(Object(why)))?;
        self.add_any("sample", event.sample.as_deref().map(over_time))
    }
}

/// An object of these names and values.
struct Object<T>(T);

impl<K: Serialize, V: Serialize, T> Serialize for Object<T>
where
    for<'a> &'a T: IntoIterator<Item = &'a (K, V)>,
{
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.into_iter().map(|(name, value)| (name, value)))
    }
}

/// Returns a length in mm, with its standard deviation.
fn length(Measured { value, sd }: Measured) -> Object<[(&'static str, f64); 2]> {
    Object([("value", millimeters(value)), ("sd", millimeters(sd))])
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SensorLine<'a> {
    /// The name of the sensor, which comes first; `None` for the only one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor: Option<&'a str>,
    /// The line itself.
    #[serde(flatten)]
    pub line: JsonLine<'a>,
}

/// Returns a time as RFC 3339 writes it, in UTC with milliseconds.
pub fn in_utc(time: SystemTime) -> String {
    humantime::format_rfc3339_millis(time).to_string()
}

/// A speed, with its standard deviation by arrival times, and without it by a law of durations.
#[derive(Serialize)]
struct SpeedField {
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

/// A direction: any angle by arrival times, one of four by centroids.
#[derive(Serialize)]
#[serde(untagged)]
enum DirectionField {
    Arrival { deg: f64, sd: f64 },
    Centroids { deg: Option<u16>, confidence: f64 },
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

/// Returns an angle in degrees for output, with two decimals as its standard deviation has: 0 ≤ angle < 360.
pub fn angle(degrees: f32) -> f64 {
    turned(degrees, 2)
}

/// Returns an angle below a whole turn with so many decimals.
fn turned(degrees: f32, decimals: i32) -> f64 {
    // 359.996 is rounded to a whole turn, and zero has no sign.
    rounded_to(f64::from(degrees), decimals) % 360.0 + 0.0
}

/// Returns an angle with its standard deviation, as [`with_deviation`] does it.
pub fn angle_with_deviation(degrees: f32, sd: f32) -> String {
    with_deviation(turned(degrees, i32::from(sd < 9.95)), sd)
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
        for (degrees, expected) in
            [(0.0, 0.0), (-0.0, 0.0), (0.004, 0.0), (359.994, 359.99), (359.996, 0.0), (90.25, 90.25)]
        {
            assert_eq!(angle(degrees).to_bits(), f64::to_bits(expected), "{degrees}");
        }
        assert_eq!([0.1, 10.0].map(|sd| angle_with_deviation(359.96, sd)), ["0.0 ± 0.1", "0 ± 10"]);
    }
}
