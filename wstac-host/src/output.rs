//! Typed outputs of a stream: everything else, such as JSON, recordings and messages, is made of them.

use std::fmt;

use wstac_core::direction::{self, Direction};
use wstac_core::features::Features;
use wstac_core::params::SAMPLE_FRAMES;
use wstac_core::speed::{self, LitSpan, NoSpeed, Speed, SpeedConfig};
use wstac_core::trigger::{Event, InterruptedSample, StreamEnd};

use crate::source::{Fault, LossReason};
use crate::texture::{Texture, Textures};

/// Chooses which outputs a stream has besides its events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputOptions {
    /// The features of every frame.
    pub features: bool,
    /// The sample in every event.
    pub samples: bool,
}

/// A sample in units of 2^-11: 70 frames of ten features, five rows, then five columns.
pub type SampleFrames = [Features; SAMPLE_FRAMES];

/// An output of a stream.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Output {
    /// The features of a frame, if they were asked for.
    Features(FrameFeatures),
    /// A tactile event.
    Event(Box<TactileEvent>),
    /// The answer of a model that needs only the first frames of a sample. The event follows.
    EarlyTexture(EarlyTexture),
    /// A sample that a long gap interrupted. It has no event.
    Interrupted(InterruptedSample),
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
            Self::Event(event) => count(&mut event.frame),
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

/// A tactile event and its answers.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TactileEvent {
    /// The number of the first frame of the sample.
    pub frame: u64,
    /// Lit frames from the first to the last, less one; `None` if no frame is lit.
    pub lit_frames: Option<u8>,
    /// The sliding speed, or why there is none.
    pub speed: Result<Speed, NoSpeed>,
    /// An upper bound of the speed of an event that is cut off. The slide lasted longer than was seen, so it was
    /// slower. The bound is as good as the speed law is there.
    pub speed_at_most: Option<Speed>,
    /// The sliding direction, or why there is none, and its confidence.
    pub direction: Direction,
    /// The texture; `None` without a model.
    pub texture: Option<Texture>,
    /// Frames of the sample that were lost and filled, 0 to 70.
    pub frames_filled: u8,
    /// Whether the baseline was quiet and at most a tenth of the sample was filled.
    pub reliable: bool,
    /// The sample, if it was asked for.
    pub sample: Option<Box<SampleFrames>>,
}

impl TactileEvent {
    /// Creates an event of the core with the answers of `textures`.
    pub(crate) fn new(event: &Event<'_>, config: &SpeedConfig, textures: &Textures, with_sample: bool) -> Self {
        let flat = event.sample.flat();
        let sample = flat.as_chunks().0.as_array().filter(|_| with_sample);
        let speed = speed::speed(event, config);
        Self {
            frame: event.frame,
            lit_frames: speed::duration(event, config).map(LitSpan::frames),
            speed,
            speed_at_most: bound(speed, |mm_s| config.marked(mm_s)),
            direction: direction::direction(event),
            texture: textures.of_sample(&flat),
            frames_filled: event.frames_filled,
            reliable: event.reliable,
            sample: sample.copied().map(Box::new),
        }
    }

    /// Creates an event from the answers of a board.
    #[cfg(feature = "board")]
    pub(crate) fn from_answers(
        answers: &wstac_core::wire::Answers<'_>,
        texture: Option<Texture>,
        sample: Option<&SampleFrames>,
    ) -> Self {
        Self {
            frame: answers.frame,
            lit_frames: answers.duration,
            speed: answers.speed,
            speed_at_most: bound(answers.speed, Speed::new),
            direction: answers.direction,
            texture,
            frames_filled: answers.frames_filled,
            reliable: answers.reliable,
            sample: sample.copied().map(Box::new),
        }
    }

    /// Returns whether the sample starts or ends in the light, so that the slide lasted longer than was seen.
    pub fn is_cut_off(&self) -> bool {
        matches!(self.speed, Err(NoSpeed::CutOff { .. }))
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
