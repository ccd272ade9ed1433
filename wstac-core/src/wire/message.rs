//! What a board and a host tell each other.

use serde::{Deserialize, Serialize};

use super::Text;
use crate::direction::{self, Direction};
use crate::features::Features;
use crate::green::any::PixelFormat;
use crate::layout::FrameSize;
use crate::model::file::Task;
use crate::params::{FEATURES, SAMPLE_FRAMES};
use crate::rate::FrameRate;
use crate::sample::Sample;
use crate::speed::{self, LitSpan, NoSpeed, Speed, SpeedConfig};
use crate::texture::Texture;
use crate::trigger::{Event, InterruptedSample, StreamEnd, TriggerConfig};

/// From a board to a host. What `wstac run` would print of the same frames, in the same order but for an event whose sample
/// is wanted, which comes after it; and how the board is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Message<'a> {
    /// What the board is: sent when it starts and when it is asked.
    #[serde(borrow)]
    Hello(Hello<'a>),
    /// The features of a frame, where they are wanted.
    Features {
        /// Number of the feature frame.
        #[serde(serialize_with = "super::numbers::long")]
        frame: u64,
        /// In units of 2^-11.
        #[serde(with = "super::numbers::one")]
        features: Features,
    },
    /// Frames of an event's sample, where they are wanted: all parts come before the event ([`sample_parts`]).
    SamplePart {
        /// Number of the first frame of the sample: that of the event.
        #[serde(serialize_with = "super::numbers::long")]
        frame: u64,
        /// Which frame of the sample this part starts with: 0, 10, 20 … 60.
        first: u8,
        /// Its frames, in units of 2^-11.
        #[serde(with = "super::numbers::part")]
        features: [Features; SAMPLE_PART],
    },
    /// An event and its answers.
    #[serde(borrow)]
    Event(Answers<'a>),
    /// What a model that needs no more frames says of a sample that is still being captured.
    Texture {
        /// Number of the first frame of the sample: that of the event to come.
        #[serde(serialize_with = "super::numbers::long")]
        frame: u64,
        /// Frames of the sample that were looked at.
        frames: u8,
        /// The model's answer.
        #[serde(borrow)]
        texture: TextureAnswer<'a>,
    },
    /// A sample that a long gap interrupted.
    InterruptedSample(InterruptedSample),
    /// Camera frames that were lost or unusable, since the last such message.
    Lost {
        /// How many.
        #[serde(serialize_with = "super::numbers::long")]
        frames: u64,
    },
    /// Something went wrong, or right again.
    #[serde(borrow)]
    Fault(Fault<'a>),
    /// How the stream stands: sent about once a second, so that a silent board is one that is gone.
    Status {
        /// Its frames, baseline and the sample under way.
        stream: StreamEnd,
        /// Camera frames that were lost or unusable since the board started.
        #[serde(serialize_with = "super::numbers::long")]
        dropped: u64,
    },
    /// How the stream ended: nothing follows.
    End {
        /// Its frames, baseline and the sample that was under way.
        stream: StreamEnd,
        /// Camera frames that were lost or unusable since the board started.
        #[serde(serialize_with = "super::numbers::long")]
        dropped: u64,
    },
}

/// What a board is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hello<'a> {
    /// Name of the firmware.
    #[serde(borrow)]
    pub firmware: Text<'a, 31>,
    /// Version of the firmware.
    #[serde(borrow)]
    pub version: Text<'a, 31>,
    /// Size of the frames that taxels are summed in.
    pub size: FrameSize,
    /// Their pixel format.
    pub format: PixelFormat,
    /// The camera's frame rate.
    pub rate: FrameRate,
    /// How events are found.
    pub trigger: TriggerConfig,
    /// The texture models; none in places that are left.
    pub models: [Option<ModelFacts>; 3],
    /// Number of the frame that comes next: 0 where the board has just started.
    #[serde(serialize_with = "super::numbers::long")]
    pub frame: u64,
}

/// A texture model of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModelFacts {
    /// What it tells apart.
    pub task: Task,
    /// How many classes there are.
    pub classes: u8,
    /// Frames of a sample that it needs, from the first on: 1 to 70.
    pub frames: u8,
}

/// An event's answers: all of an event but its sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answers<'a> {
    /// Number of the first frame of the sample.
    #[serde(serialize_with = "super::numbers::long")]
    pub frame: u64,
    /// Lit frames, last less first; nothing where no frame is lit.
    pub duration: Option<u8>,
    /// Sliding speed, or why there is none.
    pub speed: Result<Speed, NoSpeed>,
    /// Sliding direction, or why there is none, and how sure it is.
    pub direction: Direction,
    /// What texture models say; none in places that are left.
    #[serde(borrow)]
    pub textures: [Option<TextureAnswer<'a>>; 3],
    /// Frames of the sample that were filled: 0 to 70.
    pub frames_filled: u8,
    /// The baseline was quiet and without a long gap, and at most a tenth of the sample was filled.
    pub reliable: bool,
}

impl<'a> Answers<'a> {
    /// Works out an event's speed and direction; textures are for [`Answers::with_texture`].
    pub fn new(event: &Event<'_>, config: &SpeedConfig) -> Self {
        Self {
            frame: event.frame,
            duration: speed::duration(event, config).map(LitSpan::frames),
            speed: speed::speed(event, config),
            direction: direction::direction(event),
            textures: [None; 3],
            frames_filled: event.frames_filled,
            reliable: event.reliable,
        }
    }

    /// The same with what one more model says. There is room for three; a fourth is left out.
    #[must_use]
    pub fn with_texture(mut self, texture: impl Into<TextureAnswer<'a>>) -> Self {
        if let Some(place) = self.textures.iter_mut().find(|place| place.is_none()) {
            *place = Some(texture.into());
        }
        self
    }
}

/// What a texture model says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureAnswer<'a> {
    /// What the model tells apart.
    pub task: Task,
    /// The class's name.
    #[serde(borrow)]
    pub label: Text<'a>,
}

impl<'m> From<Texture<'m>> for TextureAnswer<'m> {
    fn from(texture: Texture<'m>) -> Self {
        Self { task: texture.task, label: texture.label.into() }
    }
}

/// What happens to a board.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Fault<'a> {
    /// Pixels came faster than they were taken; the frame is lost.
    Overrun,
    /// A frame did not begin or end when it should have; the frame is lost.
    LostSync,
    /// The camera sends no pixels.
    SensorSilent,
    /// The camera does not answer on its bus.
    SensorGone,
    /// The camera is none that the firmware knows.
    SensorUnknown {
        /// What it says it is.
        id: u16,
    },
    /// The camera sends frames again.
    SensorBack,
    /// Why the board started again: the text of a panic, or the name of a fault.
    #[serde(borrow)]
    LastRun(Text<'a, 191>),
    /// The camera answers, but does not keep what is written to it.
    SensorRefuses {
        /// The register that holds something else.
        register: u8,
    },
}

/// From a host to a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Request {
    /// Asks for a [`Message::Hello`].
    Hello,
    /// Whether every frame's features are wanted; at first they are not.
    Features(bool),
    /// Whether every event's sample is wanted; at first it is not.
    Samples(bool),
}

/// Frames of a sample in one message.
pub const SAMPLE_PART: usize = 10;
const _: () = assert!(SAMPLE_FRAMES.is_multiple_of(SAMPLE_PART));

/// The seven messages that carry an event's sample; the event comes after them.
pub fn sample_parts(frame: u64, sample: Sample<'_>) -> impl Iterator<Item = Message<'static>> {
    (0..SAMPLE_FRAMES).step_by(SAMPLE_PART).map(move |first| {
        let mut features = [[0; FEATURES]; SAMPLE_PART];
        for (place, numbers) in features.iter_mut().zip(sample.frames().skip(first)) {
            *place = *numbers;
        }
        Message::SamplePart { frame, first: first as u8, features }
    })
}
