//! Tactile events and their answers.

use wstac_core::features::FeatureScale;
use wstac_core::law::Answer;
use wstac_core::model::file::TAXEL_INPUTS;
use wstac_core::model::speeds::KnownSpeeds;
use wstac_core::paper::direction::Direction;
use wstac_core::paper::speed::{self, LitSpan, Speed, SpeedConfig};
use wstac_core::paper::trigger::Event;
use wstac_core::params::SAMPLE_FRAMES;
use wstac_core::reason::Reason;
use wstac_core::touch::motion::{self, Contact, MotionConfig};
use wstac_core::touch::path_sample::{self, PathSample};
use wstac_core::touch::wave::{Basis, Extent, Measured};

use super::{OutputOptions, RecordTimes, SampleFrames};
use crate::frame_clock::{FrameClock, Stamp};
use crate::texture::{NoTexture, Texture, Textures};

/// A tactile event and its answers.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TactileEvent {
    /// The number of the first frame of the sample.
    pub frame: u64,
    /// The time when the touch began in nanoseconds ([`StreamSummary::clock`](super::StreamSummary::clock)): that of
    /// its first lit frame, or by a law of durations that of [`Self::frame`]. It is `None` from a board whose clock is
    /// not known yet.
    pub time_ns: Option<u64>,
    /// The time of the frame with which the answer was complete in nanoseconds: the last one of the sample, or that at
    /// which [`AtOnce`](wstac_core::touch::at_once::AtOnce) answered. It is `None` from a board whose clock is not
    /// known yet.
    pub completed_ns: Option<u64>,
    /// The wall-clock time of [`Self::time_ns`]; `None` where the source knows none.
    pub stamp: Option<Stamp>,
    /// The times of the touch in seconds; `None` by a law of durations, or from a board whose clock is not known yet.
    pub time: Option<TouchTime>,
    /// The kind of the touch; `None` by a law of durations, which takes every touch for a slide.
    pub contact: Option<Contact>,
    /// The number of the first lit frame of the touch; `None` by a law of durations.
    pub touch_frame: Option<u64>,
    /// The number of the first dark frame behind the touch; `None` if the light has not left, or by a law of durations.
    pub end_frame: Option<u64>,
    /// Lit frames from the first to the last, less one; `None` if no frame is lit, or if the sample does not show the
    /// touch's begin and end.
    pub lit_frames: Option<u8>,
    /// The part of the sample that is brighter than the threshold of `[speed]`; `None` if no frame is, or for an event
    /// of a board.
    pub lit_span: Option<LitSpan>,
    /// The sliding speed, or why there is none.
    pub speed: Result<Speed, Reason>,
    /// An upper bound of the speed of an event that is cut off. The slide lasted longer than was seen, so it was
    /// slower. The bound is as good as the speed law is there.
    pub speed_at_most: Option<Speed>,
    /// The sliding direction, or why there is none.
    pub direction: Direction,
    /// What speed and direction are known by; `None` unless 25 taxels tell them, and from a board before version 0.4.
    pub basis: Option<Basis>,
    /// Where and how wide the touch is across its motion; `None` unless 25 taxels tell the velocity, and from a board
    /// before version 0.4.
    pub extent: Option<Extent>,
    /// The mean [acceleration](wstac_core::touch::wave::TaxelMotion::acceleration); `None` from boards.
    pub acceleration: Option<Measured>,
    /// The texture, or the reason why there is none.
    pub texture: Result<Texture, NoTexture>,
    /// The [period](path_sample::period) of the texture in mm; `None` where it cannot be told, unless the answer is a
    /// reliable one of 25 taxels, and from boards.
    pub period_mm: Option<Measured>,
    /// The speeds that the model knows, if the speed of the slide is none of them and so it is no wonder that the
    /// texture is unknown, or may be wrong.
    pub texture_doubt: Option<KnownSpeeds>,
    /// Frames of the sample that were lost and filled, 0 to 70.
    pub frames_filled: u8,
    /// Whether the answers are reliable: see [`Answer::reliable`](wstac_core::law::Answer::reliable). They are not if
    /// the frames of the sample came unevenly.
    pub reliable: bool,
    /// The reason why the touch is unclear, or why the answers are not reliable; `None` if they are, and if a board
    /// does not say, as before version 0.4. By a law of durations it is only [`Reason::Uneven`] or
    /// [`Reason::FasterCamera`].
    pub doubt: Option<Reason>,
    /// Whether the sample is reliable, whatever its answers are: the baseline was quiet, at most a tenth of the sample
    /// was filled, and its frames came evenly. A board says only [`Self::reliable`].
    pub sample_reliable: bool,
    /// The sample, if it was asked for.
    pub sample: Option<Box<SampleFrames>>,
    /// The samples along the path, if they were asked for.
    pub paths: Option<Box<Paths>>,
}

/// The samples of an event along the path of its touch, and of 25 taxels over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Paths {
    /// Of ten sums; `None` for a touch that is no slide, and without a velocity.
    pub sums: Option<PathSample>,
    /// Of 25 taxels; `None` like [`Self::sums`].
    pub taxels: Option<PathSample>,
    /// Light of 25 taxels over time, frame by frame
    /// ([`TaxelRing::numbers`](wstac_core::touch::taxel_ring::TaxelRing::numbers)); `None` behind a long gap.
    pub light: Option<[i16; TAXEL_INPUTS]>,
}

impl TactileEvent {
    /// Creates an event of the core, or of a touch under way, from the answer of the law.
    pub(crate) fn new(event: &Event<'_>, answer: Answer, answering: &Answering) -> Self {
        let flat = event.sample.flat();
        let sample = flat.as_chunks().0.as_array().filter(|_| answering.options.samples);
        let texture = answering.textures.of_event(event, &answer, answering.motion, &answering.scale);
        let texture_doubt = answering.textures.doubt(&texture, &answer);
        let begin = event.touch_frame.unwrap_or(event.frame);
        let RecordTimes { time_ns, stamp, .. } = RecordTimes::new(begin, Some(&answering.clock));
        let completed_ns = answering.clock.nanoseconds(event.last_frame());
        Self {
            frame: event.frame,
            time_ns,
            completed_ns,
            stamp,
            time: event.touch_frame.map(|touch| TouchTime::new(touch, event.last_frame(), &answering.clock)),
            contact: answer.contact,
            touch_frame: event.touch_frame,
            end_frame: event.end_frame,
            lit_frames: answer.duration,
            lit_span: speed::duration(event, &answering.durations),
            speed: answer.speed,
            speed_at_most: bound(answer.speed, |mm_s| answering.durations.marked(mm_s)),
            direction: answer.direction,
            basis: answer.basis,
            extent: answer.extent,
            acceleration: answer.acceleration,
            texture,
            period_mm: period(event, &answer, answering.motion),
            texture_doubt,
            frames_filled: event.frames_filled,
            reliable: answer.reliable,
            doubt: answer.doubt,
            sample_reliable: event.reliable,
            sample: sample.copied().map(Box::new),
            paths: answering.options.paths.then(|| Box::new(Paths::of_event(event, &answer, answering))),
        }
    }

    /// Returns the event of a sample whose frames have other times than it was computed with: nothing of it is
    /// reliable.
    pub(crate) fn mistimed(self, why: Reason) -> Self {
        Self { reliable: false, sample_reliable: false, doubt: Some(why), ..self }
    }

    /// Returns the event of a sample of which a file leaves out frames that its speed depends on.
    pub(crate) fn missing(self) -> Self {
        Self { reliable: false, doubt: self.doubt.or(Some(Reason::LostFrames)), ..self }
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
        let time = answers.touch_frame().zip(clock.filter(|clock| clock.is_known()));
        let no_texture = match (answers.has_texture(), has_model) {
            (true, true) => NoTexture::Unanswered,
            (true, false) => NoTexture::NoModel,
            (false, _) => NoTexture::NoSlide,
        };
        let RecordTimes { time_ns, stamp, .. } =
            RecordTimes::new(answers.touch_frame().unwrap_or(answers.frame), clock);
        let completed_ns = clock.and_then(|clock| clock.nanoseconds(answers.last_frame()));
        Self {
            frame: answers.frame,
            time_ns,
            completed_ns,
            stamp,
            time: time.map(|(touch, clock)| TouchTime::new(touch, answers.last_frame(), clock)),
            contact: answers.contact,
            touch_frame: answers.touch_frame(),
            end_frame: answers.end_frame(),
            lit_frames: answers.duration,
            lit_span: None,
            speed: answers.speed,
            speed_at_most: bound(answers.speed, Speed::new),
            direction: direction_of_board(answers),
            basis: answers.basis,
            extent: answers.extent,
            acceleration: None,
            texture: texture.ok_or(no_texture),
            period_mm: None,
            texture_doubt: None,
            frames_filled: answers.frames_filled,
            reliable: answers.reliable,
            doubt: doubt_of_board(answers),
            sample_reliable: answers.reliable,
            sample: sample.copied().map(Box::new),
            paths: None,
        }
    }

    /// Returns the reason why there is no texture, or which speeds the model knows if that of the slide is none of
    /// them.
    pub fn why_texture(&self) -> Option<String> {
        let why = |speeds| format!("the speed is outside of those that the model knows: {speeds}");
        let none = self.texture.as_ref().err().map(|reason| reason.as_str().to_owned());
        none.or_else(|| self.texture_doubt.map(why))
    }

    /// Returns whether the sample starts or ends in the light, so that the slide lasted longer than was seen.
    pub fn is_cut_off(&self) -> bool {
        matches!(self.speed, Err(Reason::CutOff { .. }))
    }
}

/// Returns the period of the texture that a reliable answer of 25 taxels is about.
fn period(event: &Event<'_>, answer: &Answer, motion: MotionConfig) -> Option<Measured> {
    let velocity = answer.velocity().filter(|_| answer.reliable && answer.basis.is_some())?;
    path_sample::period(event, &velocity, motion)
}

/// Returns the direction that a board has sent. By arrival times it is missing for the reason of the speed, which the
/// link has no number for.
#[cfg(feature = "board")]
fn direction_of_board(answers: &wstac_core::wire::Answers<'_>) -> Direction {
    match (answers.direction, answers.speed) {
        (Direction { degrees: Err(_), confidence: None, .. }, Err(reason)) => Direction::by_arrival(Err(reason)),
        (direction, _) => direction,
    }
}

/// Returns why answers of a board are not reliable. A board before version 0.4 does not say; by arrival times, the
/// number of filled frames may.
#[cfg(feature = "board")]
fn doubt_of_board(answers: &wstac_core::wire::Answers<'_>) -> Option<Reason> {
    let has_lost = u32::from(answers.frames_filled) > wstac_core::params::LONGEST_FILLED_GAP;
    let by_number = answers.contact.is_some() && !answers.reliable && has_lost;
    answers.doubt.or_else(|| by_number.then_some(Reason::LostFrames))
}

impl Paths {
    /// Returns the samples of an event of this answer, with all numbers that models read. If the law gives no velocity,
    /// it is that by coherence.
    fn of_event(event: &Event<'_>, answer: &Answer, answering: &Answering) -> Self {
        let config = answering.motion;
        let by_law = || answer.velocity().or_else(|| motion::by_coherence(event, config).velocity);
        let velocity = if answer.has_texture() { by_law() } else { None };
        let whole = SAMPLE_FRAMES as u8;
        Self {
            sums: velocity.and_then(|velocity| PathSample::of_sums(event, &velocity, config, whole)),
            taxels: velocity.and_then(|velocity| PathSample::of_touch(event, &velocity, config, whole)),
            light: event.taxels().map(|ring| ring.numbers(&answering.scale)),
        }
    }
}

/// The times of a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TouchTime {
    /// The time of the first lit frame, in seconds from the first frame of the stream.
    pub touch_s: f64,
    /// The time of the frame with which the answer was complete, in seconds from the first frame of the stream.
    pub completed_s: f64,
}

impl TouchTime {
    /// Creates the times of a touch that begins at frame `touch` and is answered at frame `completed`.
    fn new(touch: u64, completed: u64, clock: &FrameClock) -> Self {
        Self { touch_s: clock.seconds(touch), completed_s: clock.seconds(completed) }
    }
}

/// All that answers an event besides its law: the textures, the clock and what was asked for.
#[derive(Debug)]
pub(crate) struct Answering {
    pub(crate) durations: SpeedConfig,
    pub(crate) textures: Textures,
    pub(crate) motion: MotionConfig,
    /// The scale of taxels in a sample.
    pub(crate) scale: FeatureScale,
    pub(crate) clock: FrameClock,
    pub(crate) options: OutputOptions,
}

/// Returns the bound of a speed that is not known because its event is cut off; `mark` marks it as extrapolated or not.
fn bound(speed: Result<Speed, Reason>, mark: impl FnOnce(f32) -> Speed) -> Option<Speed> {
    match speed {
        Err(Reason::CutOff { at_most: Some(mm_s) }) => Some(mark(mm_s)),
        _ => None,
    }
}
