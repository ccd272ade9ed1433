//! Typed outputs of a stream: everything else, such as JSON, recordings and messages, is made of them.

mod event;

use std::fmt;

use wstac_core::features::Features;
use wstac_core::paper::trigger::{ContactEnd, InterruptedSample, StreamEnd};
use wstac_core::params::{FEATURES, SAMPLE_FRAMES, TAXELS};
use wstac_core::touch::motion::{ReadoutTime, Velocity};
use wstac_core::touch::slip::Slip;
use wstac_core::touch::wave::Basis;
#[cfg(feature = "board")]
use wstac_core::wire::{Request, Telemetry};

pub(crate) use self::event::Answering;
pub use self::event::{Paths, TactileEvent, TouchTime};
#[cfg(feature = "board")]
use crate::frame_clock::ClockMatch;
use crate::frame_clock::FrameClock;
pub use crate::frame_clock::{Elapsed, Stamp, StreamClock};
use crate::reasons::{Fault, LossCounts, LossReason};
use crate::texture::Texture;

/// Chooses which outputs a stream has besides its events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "each is a choice of its own")]
pub struct OutputOptions {
    /// The features of every frame.
    pub features: bool,
    /// The sample in every event.
    pub samples: bool,
    /// Speed and direction of every frame while something slides.
    pub motion: bool,
    /// The samples along the path in the event of every slide, of ten sums and of 25 taxels.
    pub paths: bool,
}

impl OutputOptions {
    /// The outputs for a person who watches a sensor: features and motion.
    pub const LIVE: Self = Self { features: true, samples: false, motion: true, paths: false };
}

/// The names of the ten features, in their order: rows from top to bottom, then columns from left to right (SPEC §1).
pub const FEATURE_NAMES: [&str; FEATURES] = ["r1", "r2", "r3", "r4", "r5", "c1", "c2", "c3", "c4", "c5"];

/// A sample in units of 2^-11: 70 frames of ten features, five rows, then five columns.
pub type SampleFrames = [Features; SAMPLE_FRAMES];

/// An output of a stream.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Output {
    /// The features of a frame, if they were asked for.
    Features(FrameFeatures),
    /// Speed and direction of a frame while something slides, if they were asked for.
    Motion(MotionReport),
    /// A tactile event.
    Event(Box<TactileEvent>),
    /// The answer of a model that needs only the first frames of a sample. The event follows.
    EarlyTexture(EarlyTexture),
    /// A sample that a long gap interrupted. It has no event.
    Interrupted(InterruptedReport),
    /// The end of the touch of an event: its light has left.
    ContactEnd(ContactEndReport),
    /// A held part begins to slip. Only the estimator `wave` has it.
    Slip(SlipReport),
    /// Camera frames that were lost.
    Lost(LostFrames),
    /// A fault of the source. The source goes on.
    Fault(FaultReport),
    /// The baseline is complete and was not quiet: something touched the sensor. All events are marked as not reliable.
    BaselineDisturbed {
        /// The number of the feature frame that comes next.
        frame: u64,
    },
    /// The end of the stream: the last output.
    End(StreamSummary),
}

impl Output {
    /// Returns the time of the record in nanoseconds ([`StreamSummary::clock`]); `None` for records without a time, and
    /// from a board whose clock is not known yet.
    pub fn time_ns(&self) -> Option<u64> {
        self.times().0
    }

    /// Returns the number of the feature frame whose time is that of the record: of an event that of its first touch.
    /// It is `None` for the end.
    pub fn time_frame(&self) -> Option<u64> {
        Some(match self {
            Self::Features(features) => features.frame,
            Self::Motion(motion) => motion.frame,
            Self::Event(event) => event.touch_frame.unwrap_or(event.frame),
            Self::EarlyTexture(texture) => texture.frame,
            Self::Interrupted(sample) => sample.frame,
            Self::ContactEnd(end) => end.frame,
            Self::Slip(slip) => slip.frame,
            Self::Lost(lost) => lost.frame,
            Self::Fault(fault) => fault.frame,
            Self::BaselineDisturbed { frame } => *frame,
            Self::End(_) => return None,
        })
    }

    /// Returns the wall-clock time of the record; `None` where the source knows none.
    pub fn stamp(&self) -> Option<Stamp> {
        self.times().1
    }

    fn times(&self) -> (Option<u64>, Option<Stamp>) {
        match self {
            Self::Features(features) => (features.time_ns, features.stamp),
            Self::Motion(motion) => (motion.time_ns, motion.stamp),
            Self::Event(event) => (event.time_ns, event.stamp),
            Self::EarlyTexture(texture) => (texture.time_ns, texture.stamp),
            Self::Interrupted(sample) => (sample.time_ns, sample.stamp),
            Self::ContactEnd(end) => (end.time_ns, end.stamp),
            Self::Slip(slip) => (slip.time_ns, slip.stamp),
            Self::Fault(fault) => (fault.time_ns, fault.stamp),
            Self::End(end) => (end.time_ns, end.stamp),
            Self::Lost(_) | Self::BaselineDisturbed { .. } => (None, None),
        }
    }

    /// Returns the same output with frames counted from frame `zero` on.
    #[must_use]
    pub fn counted_from(mut self, zero: u64) -> Self {
        let count = |frame: &mut u64| *frame = frame.saturating_sub(zero);
        match &mut self {
            Self::Features(features) => count(&mut features.frame),
            Self::Motion(motion) => count(&mut motion.frame),
            Self::Event(event) => {
                count(&mut event.frame);
                event.touch_frame.as_mut().map(count);
                event.end_frame.as_mut().map(count);
            }
            Self::ContactEnd(end) => {
                count(&mut end.frame);
                count(&mut end.event_frame);
            }
            Self::Slip(slip) => {
                [&mut slip.frame, &mut slip.onset_frame, &mut slip.held_since_frame].into_iter().for_each(count);
            }
            Self::EarlyTexture(texture) => count(&mut texture.frame),
            Self::Interrupted(sample) => count(&mut sample.frame),
            Self::Lost(lost) => count(&mut lost.frame),
            Self::Fault(fault) => count(&mut fault.frame),
            Self::BaselineDisturbed { frame } => count(frame),
            Self::End(end) => {
                count(&mut end.frames);
                if let Some(sample) = &mut end.incomplete {
                    count(&mut sample.frame);
                }
            }
        }
        self
    }

    /// Returns the same output with times counted from the first frame of its stream, although its processor was
    /// restarted: [`Processor::elapsed`](crate::session::Processor::elapsed) is the time up to there.
    #[must_use]
    pub fn after(mut self, elapsed: Elapsed) -> Self {
        let count = |time: &mut Option<u64>| *time = time.and_then(|time| elapsed.nanoseconds(time));
        let count_s = |time: &mut Option<f64>| *time = time.map(|time| elapsed.seconds(time));
        match &mut self {
            Self::Features(features) => count(&mut features.time_ns),
            Self::Motion(motion) => {
                count(&mut motion.time_ns);
                count_s(&mut motion.time_s);
            }
            Self::Event(event) => {
                count(&mut event.time_ns);
                count(&mut event.completed_ns);
                if let Some(touch) = &mut event.time {
                    touch.touch_s = elapsed.seconds(touch.touch_s);
                    touch.completed_s = elapsed.seconds(touch.completed_s);
                }
            }
            Self::ContactEnd(end) => {
                count(&mut end.time_ns);
                count_s(&mut end.time_s);
            }
            Self::Slip(slip) => count(&mut slip.time_ns),
            Self::EarlyTexture(texture) => count(&mut texture.time_ns),
            Self::Interrupted(sample) => count(&mut sample.time_ns),
            Self::Fault(fault) => count(&mut fault.time_ns),
            Self::End(end) => count(&mut end.time_ns),
            Self::Lost(_) | Self::BaselineDisturbed { .. } => {}
        }
        self
    }
}

/// The times of the frame that a record is about.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RecordTimes {
    pub(crate) time_ns: Option<u64>,
    pub(crate) stamp: Option<Stamp>,
    pub(crate) time_s: Option<f64>,
}

impl RecordTimes {
    /// Returns the times of a frame by a clock, if it is known.
    pub(crate) fn new(frame: u64, clock: Option<&FrameClock>) -> Self {
        let Some(clock) = clock else { return Self::default() };
        let time_ns = clock.nanoseconds(frame);
        Self { time_ns, stamp: clock.stamp(frame), time_s: time_ns.map(|_| clock.seconds(frame)) }
    }
}

/// The features of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FrameFeatures {
    /// The number of the feature frame.
    pub frame: u64,
    /// The time of the frame in nanoseconds ([`StreamSummary::clock`]); `None` from a board whose clock is not
    /// known yet.
    pub time_ns: Option<u64>,
    /// The wall-clock time of the frame; `None` where the source knows none.
    pub stamp: Option<Stamp>,
    /// Five rows, then five columns: natural logarithms in units of 2^-11.
    pub features: Features,
    /// The 25 taxel sums that the features are made of, row by row; `None` from a board, and if no camera frame of it
    /// arrived.
    pub sums: Option<[u32; TAXELS]>,
}

/// Speed and direction of a frame while something slides.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MotionReport {
    /// The number of the feature frame.
    pub frame: u64,
    /// The time of the frame in nanoseconds ([`StreamSummary::clock`]); `None` from a board whose clock is not
    /// known yet.
    pub time_ns: Option<u64>,
    /// The wall-clock time of the frame; `None` where the source knows none.
    pub stamp: Option<Stamp>,
    /// The time of the frame in seconds from the first frame; `None` from a board whose clock is not known yet.
    pub time_s: Option<f64>,
    /// Speed and direction with their standard deviations.
    pub velocity: Velocity,
    /// What the velocity is known by; `None` by ten sums.
    pub basis: Option<Basis>,
}

impl MotionReport {
    /// Creates the report of a frame. `clock` is that of the frames, if it is known.
    pub(crate) fn new(frame: u64, velocity: Velocity, basis: Option<Basis>, clock: Option<&FrameClock>) -> Self {
        let RecordTimes { time_ns, stamp, time_s } = RecordTimes::new(frame, clock);
        Self { frame, time_ns, stamp, time_s, velocity, basis }
    }
}

/// The end of the touch of an event.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ContactEndReport {
    /// The number of the first dark frame behind the touch.
    pub frame: u64,
    /// The number of the first frame of the event's sample.
    pub event_frame: u64,
    /// The time of the first dark frame in nanoseconds ([`StreamSummary::clock`]); `None` from a board whose clock
    /// is not known yet.
    pub time_ns: Option<u64>,
    /// The wall-clock time of that frame; `None` where the source knows none.
    pub stamp: Option<Stamp>,
    /// The time of the first dark frame in seconds from the first frame of the stream; `None` from a board whose
    /// clock is not known yet.
    pub time_s: Option<f64>,
}

impl ContactEndReport {
    /// Creates the report of a touch's end. `clock` is that of the frames, if it is known.
    pub(crate) fn new(end: ContactEnd, clock: Option<&FrameClock>) -> Self {
        let ContactEnd { frame, event_frame, .. } = end;
        let RecordTimes { time_ns, stamp, time_s } = RecordTimes::new(frame, clock);
        Self { frame, event_frame, time_ns, stamp, time_s }
    }
}

/// A held part that begins to slip.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SlipReport {
    /// The number of the frame that shows the slip.
    pub frame: u64,
    /// The time of that frame in nanoseconds ([`StreamSummary::clock`]); `None` from a board whose clock is not known
    /// yet.
    pub time_ns: Option<u64>,
    /// The wall-clock time of that frame; `None` where the source knows none.
    pub stamp: Option<Stamp>,
    /// The number of the first frame with light of the motion.
    pub onset_frame: u64,
    /// The number of the first frame with light of the press, or, after a slip, of the frame in which its rest was
    /// known.
    pub held_since_frame: u64,
    /// The most light of a frame since the onset, as a fraction of the press's brightest frame.
    pub strength: f32,
}

impl SlipReport {
    /// Creates the report of a slip. `clock` is that of the frames, if it is known.
    pub(crate) fn new(slip: Slip, clock: Option<&FrameClock>) -> Self {
        let Slip { frame, onset_frame, held_since_frame, strength, .. } = slip;
        let RecordTimes { time_ns, stamp, .. } = RecordTimes::new(frame, clock);
        Self { frame, time_ns, stamp, onset_frame, held_since_frame, strength }
    }
}

/// A texture that is known before its event.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct EarlyTexture {
    /// The number of the first frame of the sample: the frame of the event to come, unless it is light of one before.
    pub frame: u64,
    /// The time of that frame in nanoseconds ([`StreamSummary::clock`]); `None` from a board whose clock is not
    /// known yet.
    pub time_ns: Option<u64>,
    /// The wall-clock time of that frame; `None` where the source knows none.
    pub stamp: Option<Stamp>,
    /// Frames of the sample that the model reads.
    pub frames: u8,
    /// The model's answer. The event will have the same.
    pub texture: Texture,
}

/// A sample that a long gap interrupted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct InterruptedReport {
    /// The number of its first frame.
    pub frame: u64,
    /// The time of that frame in nanoseconds ([`StreamSummary::clock`]); `None` from a board whose clock is not
    /// known yet.
    pub time_ns: Option<u64>,
    /// The wall-clock time of that frame; `None` where the source knows none.
    pub stamp: Option<Stamp>,
    /// The number of its frames that had arrived: 1 to 69.
    pub frames: u8,
}

impl InterruptedReport {
    /// Creates the report of a sample. `clock` is that of the frames, if it is known.
    pub(crate) fn new(sample: InterruptedSample, clock: Option<&FrameClock>) -> Self {
        let InterruptedSample { frame, frames, .. } = sample;
        let RecordTimes { time_ns, stamp, .. } = RecordTimes::new(frame, clock);
        Self { frame, time_ns, stamp, frames }
    }
}

/// Camera frames that were lost.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct LostFrames {
    /// The number of the feature frame that comes next.
    pub frame: u64,
    /// The number of lost camera frames.
    pub frames: u64,
    /// Why they were lost.
    pub reason: LossReason,
}

/// A fault of a source that goes on.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FaultReport {
    /// The number of the feature frame that comes next.
    pub frame: u64,
    /// The time of that frame in nanoseconds, by the frame before it and the frame rate ([`StreamSummary::clock`]);
    /// `None` before the first frame.
    pub time_ns: Option<u64>,
    /// The wall-clock time of [`Self::time_ns`]; `None` where the source knows none.
    pub stamp: Option<Stamp>,
    /// The fault itself.
    pub fault: Fault,
}

/// Something that a board reports.
// It is exhaustive: whoever drives it must handle every case.
#[cfg(feature = "board")]
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// An output as `wstac run` gives it.
    Output(Output),
    /// A message for people.
    Note(String),
    /// A request that should be sent to the board.
    Request(Request),
    /// The number of events that the board has sent and given up, and that never arrived.
    LostEvents(u64),
    /// The state of the board, and the match of its clock; `None` before it has answered.
    Telemetry(Telemetry, Option<ClockMatch>),
    /// The state of the board's stream so far, when it has changed. A
    /// [`BoardLine`](crate::monitor::line::BoardLine) gives it.
    Progress(StreamSummary),
}

#[cfg(feature = "board")]
impl Report {
    /// Returns the note, or the number of lost events, in words.
    pub fn message(&self) -> Option<std::borrow::Cow<'_, str>> {
        match self {
            Self::Note(text) => Some(text.into()),
            Self::LostEvents(lost) => Some(format!("{} lost", crate::plural::counted(*lost, "event")).into()),
            _ => None,
        }
    }
}

/// The state of a stream at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct StreamSummary {
    /// Feature frames on the time line, lost ones included.
    pub frames: u64,
    /// The clock of all times in nanoseconds. By [`StreamClock::Driver`] they are times of a monotonic clock, which all
    /// cameras of a machine share, and by [`StreamClock::Board`] times of a board in that clock. By
    /// [`StreamClock::Frames`] they count from the first frame.
    pub clock: StreamClock,
    /// The time of the last feature frame in nanoseconds; `None` if there was none, or from a board whose clock
    /// is not known yet.
    pub time_ns: Option<u64>,
    /// The wall-clock time of that frame; `None` where the source knows none.
    pub stamp: Option<Stamp>,
    /// Camera frames that were lost or unusable.
    pub dropped: u64,
    /// The lost or unusable frames by reason. Of a board and of a part of a recording, no reasons are known.
    pub dropped_by: LossCounts,
    /// Events that a board sent and gave up, and that never arrived.
    pub lost_events: u64,
    /// Whether the stream was long enough for the baseline.
    pub baseline_complete: bool,
    /// The sample that was being captured.
    pub incomplete: Option<InterruptedSample>,
    /// The time in which the camera reads its rows, as motion was computed with it.
    pub readout: ReadoutUsed,
}

/// The time in which a camera reads its rows, as motion was computed with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReadoutUsed {
    /// A board computes motion, and does not say with what.
    #[default]
    OfBoard,
    /// Nobody stated it.
    Unknown,
    /// Microseconds from the first row to the last; 0 for a global shutter.
    Microseconds(i32),
}

impl ReadoutUsed {
    /// Creates it from the time that was used; `None` is unknown.
    pub fn of(time: Option<ReadoutTime>) -> Self {
        time.map_or(Self::Unknown, |time| Self::Microseconds((1000.0 * time.ms()).round() as i32))
    }

    /// Returns the milliseconds, 0 for a global shutter; `None` if they are unknown.
    pub fn ms(self) -> Option<f64> {
        match self {
            Self::OfBoard | Self::Unknown => None,
            Self::Microseconds(us) => Some(f64::from(us) / 1000.0),
        }
    }

    /// Returns the milliseconds for records, `Some(None)` if they are unknown; `None` for a global shutter and a board.
    pub fn recorded_ms(self) -> Option<Option<f64>> {
        match self {
            Self::OfBoard | Self::Microseconds(0) => None,
            Self::Unknown | Self::Microseconds(_) => Some(self.ms()),
        }
    }
}

impl StreamSummary {
    /// Creates the summary of a stream of the core of which `dropped` camera frames were lost.
    pub(crate) fn new(end: StreamEnd, dropped: u64) -> Self {
        let StreamEnd { frames, baseline_complete, incomplete, .. } = end;
        Self { frames, dropped, baseline_complete, incomplete, ..Self::default() }
    }

    /// Returns the summary with the time of its last frame, by the clock of the frames.
    pub(crate) fn by_clock(self, clock: &FrameClock) -> Self {
        let last = self.frames.checked_sub(1);
        let times = last.map(|last| RecordTimes::new(last, Some(clock))).unwrap_or_default();
        Self { clock: clock.clock(), time_ns: times.time_ns, stamp: times.stamp, ..self }
    }
}

/// The words for a person about a baseline that was not quiet.
#[derive(Clone, Copy, Debug)]
pub struct DisturbedBaseline;

impl fmt::Display for DisturbedBaseline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            "the baseline was not quiet, or frames of it were lost: events are marked as not reliable; start again with \
             nothing touching, or choose another --baseline-at of a file",
        )
    }
}
