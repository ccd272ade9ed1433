//! Records for C programs.

use std::ffi::{CString, c_char};
use std::ptr;

use wstac_core::params::{FEATURES, TAXELS};
use wstac_core::reason::Reason;
use wstac_core::touch::motion::Contact;
use wstac_core::touch::wave::Basis;
use wstac_host::json::{angle, confidence, in_utc, millimeters, rounded, seconds, spread, strength, within_ms};
use wstac_host::output::{FaultReport, FrameFeatures, MotionReport, Output, SampleFrames, TactileEvent};
use wstac_host::source::LossCounts;
use wstac_host::texture::Texture;

use crate::status::c_string;

/// Most records of pushed frames that wait for wstac_next.
pub const WSTAC_MOST_RECORDS: usize = 1024;

/// Kind of a record.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WstacKind {
    /// No record yet: call again, or push more frames.
    Waiting = 0,
    /// The features of a frame, if the options request them. Has frame and features.
    Features = 1,
    /// A tactile event. Has frame, event and texture.
    Event = 2,
    /// The answer of a model that needs fewer than 70 frames. The event follows with the same texture. Has frame,
    /// frames and texture.
    Texture = 3,
    /// A sample that a long gap interrupted. It has no event. Has frame and frames.
    Incomplete = 4,
    /// A fault of the source, which goes on. Has frame, fault and message.
    Fault = 5,
    /// The end of the stream. Has frame, the number of feature frames, end, and message if frames were lost.
    End = 6,
    /// The end of the touch of an event: its light has left. Has frame, the first dark frame, event_frame and time_s.
    /// A law of durations gives none.
    ContactEnd = 7,
    /// Speed and direction of a frame while something slides, if the options request them. Has frame and time_s, and of
    /// event the contact, and speed and direction with their standard deviations.
    Motion = 8,
    /// A held part begins to slip. Has frame, onset_frame, held_since_frame and strength. Only the estimator `wave`
    /// gives it.
    Slip = 9,
}

/// Answer of the texture models. Strings are UTF-8, and null if no model tells.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct WstacTexture {
    /// The specimen, such as Saw3.
    pub specimen: *const c_char,
    /// The pattern, such as Saw.
    pub pattern: *const c_char,
    /// The depth of the pattern in mm; NAN if no model tells.
    pub depth_mm: f64,
    /// The class of a model of another task.
    pub other: *const c_char,
    /// The probability that the names are right, 0 to below 1; NAN if a model has no calibration.
    pub confidence: f64,
    /// 1 if the touch is like those of the training, and 0 if it is not: then there are no names. -1 if no model tells.
    pub known: i8,
}

/// A tactile event, with the numbers that `wstac run --json` prints.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct WstacEvent {
    /// Sliding speed in mm/s: one decimal, or four significant digits if that is finer. NAN if there is none.
    pub speed_mm_s: f64,
    /// The speed is outside the range that the law of durations was fitted on; false by arrival times.
    pub speed_extrapolated: bool,
    /// Upper bound in mm/s of the speed of an event that is cut off, by a law of durations; NAN otherwise.
    pub speed_at_most_mm_s: f64,
    /// Lit frames from the first to the last, less one: 0 to 69; -1 if no frame is lit, or if the
    /// sample does not show the touch's begin and end.
    pub duration_frames: i32,
    /// Sliding direction in degrees, counterclockwise from +x: 0 to below 360, two decimals; NAN if there is none. By a
    /// law of durations it is 0, 90, 180 or 270.
    pub direction_deg: f64,
    /// Confidence of the direction by a law of durations: 0 to 1, four decimals; NAN by arrival times.
    pub direction_confidence: f64,
    /// Frames of the sample that were lost and filled: 0 to 70.
    pub frames_filled: u32,
    /// The baseline was quiet, and at most a tenth of the sample was filled. By arrival times also: speed and direction
    /// mostly hold within their standard deviations, and the kind of the touch is clear.
    pub reliable: bool,
    /// Why there is no speed; null if there is one.
    pub why_no_speed: *const c_char,
    /// Why there is no direction; null if there is one.
    pub why_no_direction: *const c_char,
    /// The sample: 70 frames of ten features each, natural logarithms in units of 1/2048. Null with the option at_once,
    /// and of a board whose sample has not arrived.
    pub sample: *const [i16; 10],
    /// Kind of the touch: "slide", "press", "poke" or "unclear"; null by a law of durations.
    pub contact: *const c_char,
    /// Standard deviation of the speed in mm/s; NAN if there is none.
    pub speed_sd_mm_s: f64,
    /// Standard deviation of the direction in degrees; NAN if there is none.
    pub direction_sd_deg: f64,
    /// Number of the first lit frame of the touch; -1 by a law of durations.
    pub touch_frame: i64,
    /// Number of the first dark frame behind the touch; -1 if the light has not left, or by a law of durations.
    pub end_frame: i64,
    /// Time of the first lit frame in seconds from the first frame; NAN by a law of durations.
    pub touch_s: f64,
    /// Time of the frame with which the answer was complete in seconds from the first frame; NAN by a law of durations.
    pub completed_s: f64,
    /// Wall-clock time of the first lit frame, as RFC 3339 in UTC; null where the source knows none. The record has it,
    /// too.
    pub stamp: *const c_char,
    /// Time of the frame with which the answer was complete in nanoseconds, by the clock of time_ns; -1 if it is not
    /// known.
    pub completed_ns: i64,
    /// Why the touch is unclear or the answers are not reliable; null if they are, by a law of durations, and if a
    /// board does not say.
    pub why_not_reliable: *const c_char,
    /// Why there is no texture, or which speeds the model knows if that of the slide is none; null otherwise.
    pub why_texture: *const c_char,
    /// What speed and direction are known by: "edge" (an edge that covers the sensor: only the motion across it is
    /// known) or "outline" (an object that is narrower than the sensor, or a corner); null unless 25 taxels were asked.
    pub basis: *const c_char,
    /// Middle of the touch to the left of its motion, from the sensor's middle, in mm; NaN if it is unknown.
    pub place_mm: f64,
    /// Standard deviation of the place in mm; NaN without one.
    pub place_sd_mm: f64,
    /// Width of the touch across its motion in mm; NaN if it is unknown.
    pub width_mm: f64,
    /// Standard deviation of the width in mm; NaN without one.
    pub width_sd_mm: f64,
    /// Objects side by side, as far as 25 taxels tell them apart; -1 if it is unknown.
    pub contacts: i32,
    /// Mean acceleration while an edge passes the sensor, in mm/s^2, below 0 if it slows down; NaN if it is unknown,
    /// and from boards.
    pub acceleration_mm_s2: f64,
    /// Standard deviation of the acceleration in mm/s^2; NaN without one.
    pub acceleration_sd_mm_s2: f64,
    /// Period of the texture along the motion in mm; NaN if it is unknown, and from boards.
    pub period_mm: f64,
    /// Standard deviation of the period in mm; NaN without one.
    pub period_sd_mm: f64,
}

/// How a stream ended.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct WstacEnd {
    /// Camera frames that were lost or unusable.
    pub dropped: u64,
    /// Whether the stream was long enough for the baseline.
    pub baseline_complete: bool,
    /// Number of the first frame of the sample that the end interrupted.
    pub incomplete_frame: u64,
    /// Frames of that sample that had arrived; 0 if there is none.
    pub incomplete_frames: u32,
    /// Clock of all times in nanoseconds. "driver": the monotonic clock, which all cameras of a machine share.
    /// "board": times of a board in that clock. "frames": the source states no times, so frames are counted from 0.
    /// Null in records of other kinds.
    pub clock: *const c_char,
}

/// A record of wstac_next. Its kind tells which fields it has. The others have no value: 0, -1, NAN or null.
#[repr(C)]
pub struct WstacRecord {
    /// Kind of the record.
    pub kind: WstacKind,
    /// Number of a feature frame, from 0: the first frame of a sample, or the frame that comes after a fault.
    pub frame: u64,
    /// Features: natural logarithms in units of 1/2048.
    pub features: [i16; 10],
    /// Answers of an event.
    pub event: WstacEvent,
    /// Texture of an event, if there is a model, or a texture before its event.
    pub texture: WstacTexture,
    /// Frames of an interrupted sample that had arrived, or frames that a model reads.
    pub frames: u32,
    /// Kind of a fault, such as "disconnected".
    pub fault: *const c_char,
    /// Description of a fault for a person; of an end the lost frames by reason, such as "3 shorter than a frame, 1
    /// corrupt JPEG picture", null if none was lost.
    pub message: *const c_char,
    /// Summary of a stream.
    pub end: WstacEnd,
    /// Number of the first frame of the event whose touch has ended.
    pub event_frame: u64,
    /// Time of a touch's end in seconds from the first frame; NAN if it is not known.
    pub time_s: f64,
    /// Time of the record's frame in nanoseconds, of an event that of its first touch, and of the end that of the last
    /// frame; -1 if it is not known. Its clock is that of WstacEnd.
    pub time_ns: i64,
    /// Wall-clock time of the same frame, as RFC 3339 in UTC; null where the source knows none.
    pub stamp: *const c_char,
    /// The most by which the stamp may be wrong in milliseconds; NAN where there is none.
    pub stamp_within_ms: f64,
    /// Number of the first frame with light of a slip.
    pub onset_frame: u64,
    /// Number of the first frame with light of the press, or, after a slip, of the frame in which its rest was known.
    pub held_since_frame: u64,
    /// Most light of a frame since the onset of a slip, as a fraction of the press's brightest frame; NAN in records of
    /// other kinds.
    pub strength: f64,
    /// The 25 taxel sums that the features are made of, row by row; 0 if no camera frame of them arrived, of a
    /// board, and in records of other kinds.
    pub taxel_sums: [u32; 25],
}

const EMPTY: WstacRecord = WstacRecord {
    kind: WstacKind::Waiting,
    frame: 0,
    features: [0; FEATURES],
    event: WstacEvent {
        speed_mm_s: f64::NAN,
        speed_extrapolated: false,
        speed_at_most_mm_s: f64::NAN,
        duration_frames: -1,
        direction_deg: f64::NAN,
        direction_confidence: f64::NAN,
        frames_filled: 0,
        reliable: false,
        why_no_speed: ptr::null(),
        why_no_direction: ptr::null(),
        sample: ptr::null(),
        contact: ptr::null(),
        speed_sd_mm_s: f64::NAN,
        direction_sd_deg: f64::NAN,
        touch_frame: -1,
        end_frame: -1,
        touch_s: f64::NAN,
        completed_s: f64::NAN,
        stamp: ptr::null(),
        completed_ns: -1,
        why_not_reliable: ptr::null(),
        why_texture: ptr::null(),
        basis: ptr::null(),
        place_mm: f64::NAN,
        place_sd_mm: f64::NAN,
        width_mm: f64::NAN,
        width_sd_mm: f64::NAN,
        contacts: -1,
        acceleration_mm_s2: f64::NAN,
        acceleration_sd_mm_s2: f64::NAN,
        period_mm: f64::NAN,
        period_sd_mm: f64::NAN,
    },
    texture: NO_TEXTURE,
    frames: 0,
    fault: ptr::null(),
    message: ptr::null(),
    end: WstacEnd {
        dropped: 0,
        baseline_complete: false,
        incomplete_frame: 0,
        incomplete_frames: 0,
        clock: ptr::null(),
    },
    event_frame: 0,
    time_s: f64::NAN,
    time_ns: -1,
    stamp: ptr::null(),
    stamp_within_ms: f64::NAN,
    onset_frame: 0,
    held_since_frame: 0,
    strength: f64::NAN,
    taxel_sums: [0; TAXELS],
};

const NO_TEXTURE: WstacTexture = WstacTexture {
    specimen: ptr::null(),
    pattern: ptr::null(),
    depth_mm: f64::NAN,
    other: ptr::null(),
    confidence: f64::NAN,
    known: -1,
};

/// Returns a number of a frame or of nanoseconds as a signed one.
fn signed(frame: u64) -> i64 {
    i64::try_from(frame).unwrap_or(i64::MAX)
}

/// Returns lost frames by reason, in words.
fn by_reason(lost: &LossCounts) -> Option<String> {
    let reasons: Vec<_> = lost.iter().map(|(reason, frames)| format!("{frames} {reason}")).collect();
    (!reasons.is_empty()).then(|| reasons.join(", "))
}

/// The data that the last record points to.
#[derive(Default)]
pub(super) struct Given {
    texts: Vec<CString>,
    sample: Option<Box<SampleFrames>>,
}

impl Given {
    /// Returns a record that says that there is none yet. Frees what the last record points to.
    pub(super) fn waiting(&mut self) -> WstacRecord {
        *self = Self::default();
        EMPTY
    }

    /// Returns the record of an output; `None` for lost frames and a disturbed baseline, which have none. Frees what
    /// the last record points to.
    pub(super) fn record(&mut self, output: Output) -> Option<WstacRecord> {
        *self = Self::default();
        let (time_ns, stamp) = (output.time_ns(), output.stamp());
        let record = self.without_times(output)?;
        Some(WstacRecord {
            time_ns: time_ns.map_or(-1, signed),
            stamp: self.keep_any(stamp.map(|stamp| in_utc(stamp.time)).as_deref()),
            stamp_within_ms: stamp.map_or(f64::NAN, within_ms),
            ..record
        })
    }

    fn without_times(&mut self, output: Output) -> Option<WstacRecord> {
        Some(match output {
            Output::Features(FrameFeatures { frame, features, sums, .. }) => {
                let taxel_sums = sums.unwrap_or(EMPTY.taxel_sums);
                WstacRecord { kind: WstacKind::Features, frame, features, taxel_sums, ..EMPTY }
            }
            Output::Motion(motion) => self.motion(motion),
            Output::ContactEnd(end) => WstacRecord {
                kind: WstacKind::ContactEnd,
                frame: end.frame,
                event_frame: end.event_frame,
                time_s: end.time_s.map_or(f64::NAN, seconds),
                ..EMPTY
            },
            Output::Slip(slip) => WstacRecord {
                kind: WstacKind::Slip,
                frame: slip.frame,
                onset_frame: slip.onset_frame,
                held_since_frame: slip.held_since_frame,
                strength: strength(slip.strength),
                ..EMPTY
            },
            Output::Event(event) => WstacRecord {
                kind: WstacKind::Event,
                frame: event.frame,
                texture: self.texture(event.texture.as_ref().ok()),
                event: self.event(*event),
                ..EMPTY
            },
            Output::EarlyTexture(early) => WstacRecord {
                kind: WstacKind::Texture,
                frame: early.frame,
                texture: self.texture(Some(&early.texture)),
                frames: u32::from(early.frames),
                ..EMPTY
            },
            Output::Interrupted(sample) => WstacRecord {
                kind: WstacKind::Incomplete,
                frame: sample.frame,
                frames: u32::from(sample.frames),
                ..EMPTY
            },
            Output::Fault(FaultReport { frame, fault, .. }) => WstacRecord {
                kind: WstacKind::Fault,
                frame,
                fault: self.keep(fault.kind.name()),
                message: self.keep(&fault.to_string()),
                ..EMPTY
            },
            Output::End(end) => WstacRecord {
                kind: WstacKind::End,
                frame: end.frames,
                message: self.keep_any(by_reason(&end.dropped_by).as_deref()),
                end: WstacEnd {
                    dropped: end.dropped,
                    baseline_complete: end.baseline_complete,
                    incomplete_frame: end.incomplete.map_or(0, |sample| sample.frame),
                    incomplete_frames: end.incomplete.map_or(0, |sample| u32::from(sample.frames)),
                    clock: self.keep(end.clock.as_str()),
                },
                ..EMPTY
            },
            _ => return None,
        })
    }

    fn event(&mut self, event: TactileEvent) -> WstacEvent {
        let (direction, why_texture) = (event.direction, event.why_texture());
        let place = event.extent.and_then(|extent| extent.place_mm);
        let width = event.extent.and_then(|extent| extent.width_mm);
        self.sample = event.sample;
        WstacEvent {
            speed_mm_s: event.speed.map_or(f64::NAN, |speed| rounded(speed.mm_s)),
            speed_extrapolated: event.speed.is_ok_and(|speed| speed.extrapolated),
            speed_at_most_mm_s: event.speed_at_most.map_or(f64::NAN, |speed| rounded(speed.mm_s)),
            duration_frames: event.lit_frames.map_or(-1, i32::from),
            direction_deg: direction.degrees.map_or(f64::NAN, angle),
            direction_confidence: confidence(direction).unwrap_or(f64::NAN),
            frames_filled: u32::from(event.frames_filled),
            reliable: event.reliable,
            why_no_speed: self.keep_any(event.speed.err().map(Reason::as_str)),
            why_no_direction: self.keep_any(direction.degrees.err().map(Reason::as_str)),
            sample: self.sample.as_ref().map_or(ptr::null(), |sample| sample.as_ptr()),
            contact: self.keep_any(event.contact.map(Contact::as_str)),
            speed_sd_mm_s: event.speed.ok().and_then(|speed| speed.sd).map_or(f64::NAN, rounded),
            direction_sd_deg: direction.sd.map_or(f64::NAN, spread),
            touch_frame: event.touch_frame.map_or(-1, signed),
            end_frame: event.end_frame.map_or(-1, signed),
            touch_s: event.time.map_or(f64::NAN, |time| seconds(time.touch_s)),
            completed_s: event.time.map_or(f64::NAN, |time| seconds(time.completed_s)),
            stamp: self.keep_any(event.time.and(event.stamp).map(|stamp| in_utc(stamp.time)).as_deref()),
            completed_ns: event.completed_ns.map_or(-1, signed),
            why_not_reliable: self.keep_any(event.doubt.map(Reason::as_str)),
            why_texture: self.keep_any(why_texture.as_deref()),
            basis: self.keep_any(event.basis.map(Basis::as_str)),
            place_mm: place.map_or(f64::NAN, |place| millimeters(place.value)),
            place_sd_mm: place.map_or(f64::NAN, |place| millimeters(place.sd)),
            width_mm: width.map_or(f64::NAN, |width| millimeters(width.value)),
            width_sd_mm: width.map_or(f64::NAN, |width| millimeters(width.sd)),
            contacts: event.extent.map_or(-1, |extent| extent.contacts.into()),
            acceleration_mm_s2: event.acceleration.map_or(f64::NAN, |found| millimeters(found.value)),
            acceleration_sd_mm_s2: event.acceleration.map_or(f64::NAN, |found| millimeters(found.sd).max(0.01)),
            period_mm: event.period_mm.map_or(f64::NAN, |found| millimeters(found.value)),
            period_sd_mm: event.period_mm.map_or(f64::NAN, |found| millimeters(found.sd).max(0.01)),
        }
    }

    fn motion(&mut self, motion: MotionReport) -> WstacRecord {
        let velocity = motion.velocity;
        let event = WstacEvent {
            contact: self.keep(Contact::Slide.as_str()),
            speed_mm_s: rounded(velocity.mm_s),
            speed_sd_mm_s: rounded(velocity.mm_s_sd),
            direction_deg: angle(velocity.degrees),
            direction_sd_deg: spread(velocity.degrees_sd),
            basis: self.keep_any(motion.basis.map(Basis::as_str)),
            ..EMPTY.event
        };
        let time_s = motion.time_s.map_or(f64::NAN, seconds);
        WstacRecord { kind: WstacKind::Motion, frame: motion.frame, event, time_s, ..EMPTY }
    }

    fn texture(&mut self, texture: Option<&Texture>) -> WstacTexture {
        let Some(texture) = texture else { return NO_TEXTURE };
        WstacTexture {
            specimen: self.keep_any(texture.specimen.as_deref()),
            pattern: self.keep_any(texture.pattern.as_deref()),
            depth_mm: texture.depth_mm.unwrap_or(f64::NAN),
            other: self.keep_any(texture.class.as_deref()),
            confidence: texture.confidence.unwrap_or(f64::NAN),
            known: texture.known.map_or(-1, i8::from),
        }
    }

    /// Keeps a text until the next record. Its bytes do not move when more texts are kept.
    fn keep(&mut self, text: &str) -> *const c_char {
        self.texts.push(c_string(text));
        self.texts.last().map_or(ptr::null(), |text| text.as_ptr())
    }

    fn keep_any(&mut self, text: Option<&str>) -> *const c_char {
        text.map_or(ptr::null(), |text| self.keep(text))
    }
}
