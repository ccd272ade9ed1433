//! Typed outputs of a stream: everything else, such as JSON, recordings and messages, is made of them.

use std::fmt;
use std::time::SystemTime;

use wstac_core::direction::Direction;
use wstac_core::features::Features;
use wstac_core::law::{Answer, AnyLaw, EventLaw};
use wstac_core::motion::{self, Contact, MotionConfig, Velocity};
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::path_sample::{PathSample, TaxelRing};
use wstac_core::speed::{self, LitSpan, NoSpeed, Speed, SpeedConfig};
use wstac_core::trigger::{ContactEnd, Event, InterruptedSample, StreamEnd};

use crate::frame_clock::FrameClock;
use crate::source::{Fault, LossReason};
use crate::texture::{NoTexture, Texture, Textures};

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
    Interrupted(InterruptedSample),
    /// The end of the touch of an event: its light has left.
    ContactEnd(ContactEndReport),
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
}

/// The features of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FrameFeatures {
    /// The number of the feature frame.
    pub frame: u64,
    /// Five rows, then five columns: natural logarithms in units of 2^-11.
    pub features: Features,
}

/// Speed and direction of a frame while something slides.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MotionReport {
    /// The number of the feature frame.
    pub frame: u64,
    /// The time of the frame in seconds from the first frame; `None` from a board that has not described itself.
    pub time_s: Option<f64>,
    /// Speed and direction with their standard deviations.
    pub velocity: Velocity,
}

impl MotionReport {
    /// Creates the report of a frame, with its time in seconds.
    pub(crate) fn new(frame: u64, time_s: Option<f64>, velocity: Velocity) -> Self {
        Self { frame, time_s, velocity }
    }
}

/// A tactile event and its answers.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TactileEvent {
    /// The number of the first frame of the sample.
    pub frame: u64,
    /// The times of the touch; `None` by a law of durations, or from a board that has not described itself.
    pub time: Option<TouchTime>,
    /// The kind of the touch; `None` by a law of durations, which takes every touch for a slide.
    pub contact: Option<Contact>,
    /// The number of the first lit frame of the touch; `None` by a law of durations.
    pub touch_frame: Option<u64>,
    /// The number of the first dark frame behind the touch; `None` if the light has not left, or by a law of durations.
    pub end_frame: Option<u64>,
    /// Lit frames from the first to the last, less one; `None` if no frame is lit.
    pub lit_frames: Option<u8>,
    /// The part of the sample that is brighter than the threshold of `[speed]`; `None` if no frame is, or for an event of
    /// a board.
    pub lit_span: Option<LitSpan>,
    /// The sliding speed, or why there is none.
    pub speed: Result<Speed, NoSpeed>,
    /// An upper bound of the speed of an event that is cut off. The slide lasted longer than was seen, so it was
    /// slower. The bound is as good as the speed law is there.
    pub speed_at_most: Option<Speed>,
    /// The sliding direction, or why there is none.
    pub direction: Direction,
    /// The texture, or the reason why there is none.
    pub texture: Result<Texture, NoTexture>,
    /// Frames of the sample that were lost and filled, 0 to 70.
    pub frames_filled: u8,
    /// Whether the answers are reliable: see [`Answer::reliable`](wstac_core::law::Answer::reliable).
    pub reliable: bool,
    /// Whether the sample is reliable, whatever its answers are: the baseline was quiet and at most a tenth of the sample
    /// was filled. A board says only [`Self::reliable`].
    pub sample_reliable: bool,
    /// The sample, if it was asked for.
    pub sample: Option<Box<SampleFrames>>,
    /// The samples along the path, if they were asked for.
    pub paths: Option<Box<Paths>>,
}

/// The samples of an event along the path of its touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paths {
    /// Of ten sums; `None` for a touch that is no slide, and without a velocity.
    pub sums: Option<PathSample>,
    /// Of 25 taxels; also `None` if a frame of the sample was lost.
    pub taxels: Option<PathSample>,
}

impl TactileEvent {
    /// Creates an event of the core with its answers. `taxels` are those of its sample, if they are kept and complete.
    pub(crate) fn new(event: &Event<'_>, taxels: Option<&TaxelRing>, answering: &Answering<'_>) -> Self {
        let flat = event.sample.flat();
        let sample = flat.as_chunks().0.as_array().filter(|_| answering.with_sample);
        let answer = answering.law.answer(event);
        let texture = answering.textures.of_event(event, taxels, &answer, answering.motion);
        Self {
            frame: event.frame,
            time: event.touch_frame.map(|touch| TouchTime::new(touch, event.frame, answering.clock)),
            contact: answer.contact,
            touch_frame: event.touch_frame,
            end_frame: event.end_frame,
            lit_frames: answer.duration,
            lit_span: speed::duration(event, answering.durations),
            speed: answer.speed,
            speed_at_most: bound(answer.speed, |mm_s| answering.durations.marked(mm_s)),
            direction: answer.direction,
            texture,
            frames_filled: event.frames_filled,
            reliable: answer.reliable,
            sample_reliable: event.reliable,
            sample: sample.copied().map(Box::new),
            paths: answering.with_paths.then(|| Box::new(Paths::of_event(event, taxels, &answer, answering.motion))),
        }
    }

    /// Creates an event from the answers of a board. `has_model` says whether it has named a model, and `clock` is
    /// that of its frames, if its rate is known.
    #[cfg(feature = "board")]
    pub(crate) fn from_answers(
        answers: &wstac_core::wire::Answers<'_>,
        texture: Option<Texture>,
        has_model: bool,
        sample: Option<&SampleFrames>,
        clock: Option<&FrameClock>,
    ) -> Self {
        let time = answers.touch_frame().zip(clock);
        let no_texture = match (answers.has_texture(), has_model) {
            (true, true) => NoTexture::Unanswered,
            (true, false) => NoTexture::NoModel,
            (false, _) => NoTexture::NoSlide,
        };
        Self {
            frame: answers.frame,
            time: time.map(|(touch, clock)| TouchTime::new(touch, answers.frame, clock)),
            contact: answers.contact,
            touch_frame: answers.touch_frame(),
            end_frame: answers.end_frame(),
            lit_frames: answers.duration,
            lit_span: None,
            speed: answers.speed,
            speed_at_most: bound(answers.speed, Speed::new),
            direction: answers.direction,
            texture: texture.ok_or(no_texture),
            frames_filled: answers.frames_filled,
            reliable: answers.reliable,
            sample_reliable: answers.reliable,
            sample: sample.copied().map(Box::new),
            paths: None,
        }
    }

    /// Returns whether the sample starts or ends in the light, so that the slide lasted longer than was seen.
    pub fn is_cut_off(&self) -> bool {
        matches!(self.speed, Err(NoSpeed::CutOff { .. }))
    }
}

impl Paths {
    /// Returns the samples of an event of this answer, with all numbers that models read. If the law gives no velocity,
    /// it is that by coherence.
    fn of_event(event: &Event<'_>, taxels: Option<&TaxelRing>, answer: &Answer, config: MotionConfig) -> Self {
        let by_law = || answer.velocity().or_else(|| motion::by_coherence(event, config).velocity);
        let velocity = if answer.has_texture() { by_law() } else { None };
        let whole = SAMPLE_FRAMES as u8;
        Self {
            sums: velocity.and_then(|velocity| PathSample::of_sums(event, &velocity, config, whole)),
            taxels: velocity
                .zip(taxels)
                .and_then(|(velocity, taxels)| PathSample::of_taxels(taxels, &velocity, config, whole)),
        }
    }
}

/// The times of a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TouchTime {
    /// The time of the first lit frame, in seconds from the first frame of the stream.
    pub touch_s: f64,
    /// The time of the last frame of the sample, in seconds from the first frame of the stream.
    pub completed_s: f64,
    /// The wall-clock time of the first lit frame; `None` where the source knows none.
    pub stamp: Option<SystemTime>,
}

impl TouchTime {
    /// Creates the times of a touch that begins at frame `touch`, with a sample that begins at `frame`.
    fn new(touch: u64, frame: u64, clock: &FrameClock) -> Self {
        let last = frame.saturating_add(SAMPLE_FRAMES as u64 - 1);
        Self { touch_s: clock.seconds(touch), completed_s: clock.seconds(last), stamp: clock.stamp(touch) }
    }
}

/// All that answers an event: the law, the textures and the clock.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Answering<'p> {
    pub(crate) law: &'p AnyLaw,
    pub(crate) durations: &'p SpeedConfig,
    pub(crate) textures: &'p Textures,
    pub(crate) motion: MotionConfig,
    pub(crate) clock: &'p FrameClock,
    pub(crate) with_sample: bool,
    pub(crate) with_paths: bool,
}

/// The end of the touch of an event.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ContactEndReport {
    /// The number of the first dark frame behind the touch.
    pub frame: u64,
    /// The number of the first frame of the event's sample.
    pub event_frame: u64,
    /// The time of the first dark frame in seconds from the first frame of the stream; `None` from a board that has
    /// not described itself.
    pub time_s: Option<f64>,
}

impl ContactEndReport {
    /// Creates the report of a touch's end, with its time in seconds.
    pub(crate) fn new(end: ContactEnd, time_s: Option<f64>) -> Self {
        Self { frame: end.frame, event_frame: end.event_frame, time_s }
    }
}

/// Returns the bound of a speed that is not known because its event is cut off; `mark` marks it as extrapolated or not.
fn bound(speed: Result<Speed, NoSpeed>, mark: impl FnOnce(f32) -> Speed) -> Option<Speed> {
    match speed {
        Err(NoSpeed::CutOff { at_most: Some(mm_s) }) => Some(mark(mm_s)),
        _ => None,
    }
}

/// A texture that is known before its event.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct EarlyTexture {
    /// The number of the first frame of the sample: the frame of the event to come.
    pub frame: u64,
    /// Frames of the sample that the model reads.
    pub frames: u8,
    /// The model's answer. The event will have the same.
    pub texture: Texture,
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
    /// The fault itself.
    pub fault: Fault,
}

/// The state of a stream at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct StreamSummary {
    /// Feature frames on the time line, lost ones included.
    pub frames: u64,
    /// Camera frames that were lost or unusable.
    pub dropped: u64,
    /// Whether the stream was long enough for the baseline.
    pub baseline_complete: bool,
    /// The sample that was being captured.
    pub incomplete: Option<InterruptedSample>,
}

impl StreamSummary {
    /// Creates the summary of a stream of the core of which `dropped` camera frames were lost.
    pub(crate) fn new(end: StreamEnd, dropped: u64) -> Self {
        Self { frames: end.frames, dropped, baseline_complete: end.baseline_complete, incomplete: end.incomplete }
    }
}

/// The words for a person about a baseline that was not quiet.
#[derive(Clone, Copy, Debug)]
pub struct DisturbedBaseline;

impl fmt::Display for DisturbedBaseline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the baseline was not quiet: events are marked as not reliable; start again with nothing touching")
    }
}
