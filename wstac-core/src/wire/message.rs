//! The messages between a board and a host.

use core::num::NonZeroU8;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

#[cfg(not(feature = "settings"))]
use self::{Never as SetAnswer, Never as Settings, Never as SettingsInUse};
#[cfg(not(feature = "learn"))]
use self::{Never as LearnedTextures, Never as Learning, Never as TextureName};
#[cfg(not(feature = "models"))]
use self::{Never as BoardModel, Never as ModelId, Never as ModelPiece};
#[cfg(feature = "models")]
use super::{BoardModel, ModelId, ModelPiece};
#[cfg(feature = "learn")]
use super::{LearnedTextures, Learning, TextureName};
use super::{PictureEnd, PicturePart, Text};
#[cfg(feature = "settings")]
use super::{Settings, SettingsInUse};
use crate::features::Features;
use crate::green::any::PixelFormat;
use crate::law::{Answer, EventLaw, has_texture, velocity};
use crate::layout::FrameSize;
use crate::model::file::Task;
use crate::paper::direction::Direction;
use crate::paper::sample::Sample;
use crate::paper::speed::Speed;
use crate::paper::trigger::{ContactEnd, Event, InterruptedSample, StreamEnd, TriggerConfig};
use crate::params::{FEATURES, SAMPLE_FRAMES};
use crate::rate::FrameRate;
use crate::reason::Reason;
use crate::texture::Texture;
use crate::touch::motion::{Contact, Velocity};
use crate::touch::slip::Slip;
use crate::touch::wave::{Basis, Extent};

/// A message from a board to a host.
///
/// The messages are what `wstac run` would print for the same frames, in the same order, and the state of the board.
/// One exception is an event whose sample is wanted: it comes after its sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Message<'a> {
    /// Describes the board. It is sent when the board starts and when a host asks.
    #[serde(borrow)]
    Hello(Hello<'a>),
    /// The features of a frame, if they are wanted.
    Features {
        /// The number of the feature frame.
        #[serde(serialize_with = "super::numbers::long")]
        frame: u64,
        /// The features in units of 2^-11.
        #[serde(with = "super::numbers::one")]
        features: Features,
    },
    /// Frames of an event's sample, if they are wanted. All parts come before the event ([`sample_parts`]).
    SamplePart {
        /// The number of the first frame of the sample, which is that of the event.
        #[serde(serialize_with = "super::numbers::long")]
        frame: u64,
        /// The frame of the sample that this part starts with: 0, 10, 20 … 60.
        first: u8,
        /// The frames of the part, in units of 2^-11.
        #[serde(with = "super::numbers::part")]
        features: [Features; SAMPLE_PART],
    },
    /// An event and its answers.
    #[serde(borrow)]
    Event(Answers<'a>),
    /// The answer of a model that needs no more frames, for a sample that is still being captured.
    Texture {
        /// The number of the first frame of the sample, which is that of the event to come.
        #[serde(serialize_with = "super::numbers::long")]
        frame: u64,
        /// The number of frames of the sample that the model used.
        frames: u8,
        /// The model's answer.
        #[serde(borrow)]
        texture: TextureAnswer<'a>,
    },
    /// A sample that a long gap interrupted.
    InterruptedSample(InterruptedSample),
    /// Camera frames that were lost or unusable since the last such message.
    Lost {
        /// The number of frames.
        #[serde(serialize_with = "super::numbers::long")]
        frames: u64,
    },
    /// A fault, or its end.
    #[serde(borrow)]
    Fault(Fault<'a>),
    /// The state of the stream. It is sent about once per second, so that a silent board is a lost board.
    Status {
        /// The stream's frames, baseline and sample under way.
        stream: StreamEnd,
        /// The number of camera frames that were lost or unusable since the board started.
        #[serde(serialize_with = "super::numbers::long")]
        dropped: u64,
    },
    /// The end of the stream. No message follows.
    End {
        /// The stream's frames, baseline and the sample that was under way.
        stream: StreamEnd,
        /// The number of camera frames that were lost or unusable since the board started.
        #[serde(serialize_with = "super::numbers::long")]
        dropped: u64,
    },
    /// The end of the touch of an event.
    ContactEnd(ContactEnd),
    /// Speed and direction of a frame while something slides, if they are wanted.
    Motion {
        /// The number of the feature frame.
        #[serde(serialize_with = "super::numbers::long")]
        frame: u64,
        /// Speed and direction with their standard deviations.
        velocity: Velocity,
        /// What they are known by; `None` by ten sums, and from a board before version 0.4.
        #[serde(deserialize_with = "super::numbers::newest")]
        basis: Option<Basis>,
    },
    /// The state of the board itself. It is sent after each [`Message::Status`].
    Telemetry(Telemetry),
    /// A part of a picture that was asked for.
    #[serde(borrow)]
    PicturePart(PicturePart<'a>),
    /// The end of a picture that was asked for.
    PictureEnd(PictureEnd),
    /// The board's clock: the answer to [`Request::Time`].
    Time {
        /// The time of the request, as the host gave it.
        #[serde(serialize_with = "super::numbers::long")]
        host_us: u64,
        /// The microseconds since the board started.
        #[serde(serialize_with = "super::numbers::long")]
        board_us: u64,
    },
    // Each has its number also where a feature is missing: then its content has no value.
    /// The settings that the board uses: the answer to [`Request::Settings`].
    Settings(SettingsInUse),
    /// The answer to [`Request::Set`]. If the settings are kept, the board starts again and uses them.
    Set(SetAnswer),
    /// The state of learning a texture.
    Learning(#[serde(deserialize_with = "super::numbers::apart")] Learning),
    /// The textures that the board has learned: the answer to [`Request::Textures`] and [`Request::ForgetTexture`].
    Textures(#[serde(deserialize_with = "super::numbers::apart")] LearnedTextures),
    /// The board's model, and the one that is being sent: the answer to every request about models.
    Model(BoardModel),
    /// A held part begins to slip. A board without the memory for it sends none.
    Slip(Slip),
    /// The answer to [`Request::Bootloader`]: the boot loader that the board starts now, or `None` if it has none.
    Bootloader(Option<Bootloader>),
}

/// A boot loader that takes a new program over USB.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Bootloader {
    /// It is a drive for UF2 files.
    Uf2,
    /// It speaks DFU.
    Dfu,
}

/// The answer to [`Request::Set`].
#[cfg(feature = "settings")]
type SetAnswer = Result<(), super::Refusal>;

/// The content of a message whose feature is missing: it has no value, so such a message is unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(clippy::exhaustive_enums, reason = "it has no value")]
pub enum Never {}

impl<'de> Deserialize<'de> for Never {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        never(deserializer)
    }
}

/// Refuses whatever comes: to read it first would take code for each variant.
fn never<'de, D: Deserializer<'de>, T>(_: D) -> Result<T, D::Error> {
    Err(D::Error::custom("it has no value"))
}

/// The state of a board, as far as the board knows it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Telemetry {
    /// The milliseconds since the start.
    #[serde(serialize_with = "super::numbers::long")]
    pub uptime_ms: u64,
    /// The measured frame rate in frames per 1000 seconds; 0 while no frames come.
    #[serde(serialize_with = "super::numbers::maybe")]
    pub millihertz: Option<u32>,
    /// The number of frames that were lost because pixels came faster than they were taken.
    #[serde(serialize_with = "super::numbers::maybe")]
    pub overruns: Option<u32>,
    /// The number of starts since power was on, without the first.
    #[serde(serialize_with = "super::numbers::maybe")]
    pub restarts: Option<u32>,
    /// The greatest depth of the stack in bytes.
    #[serde(serialize_with = "super::numbers::maybe")]
    pub stack: Option<u32>,
    /// The temperature of the chip in tenths of a degree Celsius.
    pub temperature: Option<i16>,
    /// The number of the next event: [`Outbox::next_event`](super::Outbox::next_event).
    pub events: u16,
    /// How far the oldest event that the board keeps is behind the next one: [`Outbox::kept`](super::Outbox::kept).
    pub kept: u8,
    /// The requests that the board has taken. If one was lost, a host sends it again.
    pub wanted: Wanted,
    /// The time of the last frame; `None` if the board does not know it.
    pub last_frame: Option<FrameTime>,
}

/// The time of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
// It is exhaustive: a frame and its time.
pub struct FrameTime {
    /// The number of the feature frame.
    #[serde(serialize_with = "super::numbers::long")]
    pub frame: u64,
    /// The microseconds from the start of the board to the frame's end.
    #[serde(serialize_with = "super::numbers::long")]
    pub board_us: u64,
}

/// The outputs that are wanted of a board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
#[expect(clippy::struct_excessive_bools, reason = "each is a request of its own")]
pub struct Wanted {
    /// Every frame's features.
    pub features: bool,
    /// Every event's sample.
    pub samples: bool,
    /// Speed and direction of every frame.
    pub motion: bool,
    /// Events that were not acknowledged, again.
    pub kept_events: bool,
}

/// The description of a board.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
// It is exhaustive: another field would be another version of the link.
pub struct Hello<'a> {
    /// The name of the firmware.
    #[serde(borrow)]
    pub firmware: Text<'a, 31>,
    /// The version of the firmware.
    #[serde(borrow)]
    pub version: Text<'a, 31>,
    /// The size of the frames that taxels are summed in.
    pub size: FrameSize,
    /// The pixel format of the frames.
    pub format: PixelFormat,
    /// The camera's frame rate.
    pub rate: FrameRate,
    /// The parameters that events are found with.
    pub trigger: TriggerConfig,
    /// The texture models; unused places are `None`.
    pub models: [Option<ModelFacts>; 3],
    /// The number of the next frame: 0 if the board has just started.
    #[serde(serialize_with = "super::numbers::long")]
    pub frame: u64,
    /// The revision of the firmware's source, such as the beginning of a commit's hash; empty if it is not known.
    #[serde(borrow)]
    pub revision: Text<'a, 15>,
    /// The unique number of the chip, its lowest word first; `None` if the chip has none.
    pub id: Option<[u32; 3]>,
}

/// A texture model of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ModelFacts {
    /// The task of the model: what it tells apart.
    pub task: Task,
    /// The number of classes.
    pub classes: u8,
    /// The number of frames of a sample that it needs, from the first on: 1 to 70.
    pub frames: u8,
}

impl ModelFacts {
    /// Creates the description of a model for this task, with `classes` classes, that needs `frames` frames of a
    /// sample.
    #[inline]
    pub const fn new(task: Task, classes: u8, frames: u8) -> Self {
        Self { task, classes, frames }
    }
}

/// An event's answers: all of an event except its sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Answers<'a> {
    /// The number of the first frame of the sample.
    #[serde(serialize_with = "super::numbers::long")]
    pub frame: u64,
    /// The first lit frame of the touch, counted from `frame`; `None` by a law of durations. It may lie before the
    /// sample.
    pub touch: Option<i16>,
    /// The first dark frame behind the touch, counted from `frame`; `None` if the light has not left, or by a law of
    /// durations.
    pub end: Option<u8>,
    /// The kind of the touch; `None` by a law of durations.
    pub contact: Option<Contact>,
    /// The duration in frames, from the first lit frame to the last; `None` if no frame is lit, or if the sample does
    /// not show the touch's begin and end.
    pub duration: Option<u8>,
    /// The sliding speed, or the reason why there is none.
    pub speed: Result<Speed, Reason>,
    /// The sliding direction, or the reason why there is none.
    pub direction: Direction,
    /// The answers of texture models; unused places are `None`.
    #[serde(borrow)]
    pub textures: [Option<TextureAnswer<'a>>; 3],
    /// The number of frames of the sample that were filled: 0 to 70.
    pub frames_filled: u8,
    /// Whether the answers are reliable: see [`Answer::reliable`](crate::law::Answer::reliable).
    pub reliable: bool,
    /// The number of the event: 0 for the first since the start, and 0 again after 65,535. An event that is sent again
    /// has the same.
    pub number: u16,
    /// How far the oldest event that the board keeps is behind this one. Older ones than that are not sent again.
    pub kept: u8,
    /// Why the touch is unclear, or why its answers are not reliable; `None` if they are, by a law of durations, and
    /// from a board before version 0.4.
    #[serde(deserialize_with = "super::numbers::newest")]
    pub doubt: Option<Reason>,
    /// What speed and direction are known by; `None` unless 25 taxels tell them, and from a board before version 0.4.
    #[serde(deserialize_with = "super::numbers::newest")]
    pub basis: Option<Basis>,
    /// Where and how wide the touch is across its motion; `None` unless 25 taxels tell the velocity, and from a board
    /// before version 0.4.
    #[serde(deserialize_with = "super::numbers::newest")]
    pub extent: Option<Extent>,
    /// The number of frames of the sample that had arrived, 1 to 69, if the touch was answered before the others
    /// ([`AtOnce`](crate::touch::at_once::AtOnce)).
    #[serde(deserialize_with = "super::numbers::newest")]
    pub frames: Option<NonZeroU8>,
}

impl<'a> Answers<'a> {
    /// Computes an event's answers by a law. [`Answers::with_texture`] adds textures, and an
    /// [`Outbox`](super::Outbox) the number.
    pub fn new(event: &Event<'_>, law: &impl EventLaw) -> Self {
        Self::of(event, &law.answer(event))
    }

    /// Takes an event's answers from that of a law.
    pub fn of(event: &Event<'_>, answer: &Answer) -> Self {
        Self {
            frame: event.frame,
            touch: event.touch_frame.map(|touch| {
                let before = event.frame.saturating_sub(touch).min(i16::MAX as u64) as i16;
                // Behind the start of the sample it is within it.
                if before > 0 { -before } else { touch.saturating_sub(event.frame).min(i16::MAX as u64) as i16 }
            }),
            end: event.end_frame.map(|end| end.saturating_sub(event.frame).min(u64::from(u8::MAX)) as u8),
            contact: answer.contact,
            duration: answer.duration,
            speed: answer.speed,
            direction: answer.direction,
            textures: [None; 3],
            frames_filled: event.frames_filled,
            reliable: answer.reliable,
            number: 0,
            kept: 0,
            doubt: answer.doubt,
            basis: answer.basis,
            extent: answer.extent,
            frames: NonZeroU8::new(event.frames).filter(|_| !event.is_event()),
        }
    }

    /// Returns the number of the frame with which the answers were complete.
    pub fn last_frame(&self) -> u64 {
        let frames = self.frames.map_or(SAMPLE_FRAMES as u64, |frames| frames.get().into());
        self.frame.saturating_add(frames - 1)
    }

    /// Returns the number of the first lit frame of the touch; `None` by a law of durations.
    pub fn touch_frame(&self) -> Option<u64> {
        self.touch.map(|touch| self.frame.saturating_add_signed(i64::from(touch)))
    }

    /// Returns the number of the first dark frame behind the touch; `None` if the light has not left, or by a law of
    /// durations.
    pub fn end_frame(&self) -> Option<u64> {
        self.end.map(|end| self.frame.saturating_add(u64::from(end)))
    }

    /// Returns the velocity by arrival times; `None` by a law of durations, or if the touch has none.
    pub fn velocity(&self) -> Option<Velocity> {
        velocity(self.speed, &self.direction)
    }

    /// Returns whether the touch has a texture: whether it slides, as far as the law tells.
    pub fn has_texture(&self) -> bool {
        has_texture(self.contact)
    }

    /// Returns the answers with one more texture answer. There is room for three; a fourth is left out.
    #[must_use]
    pub fn with_texture(mut self, texture: impl Into<TextureAnswer<'a>>) -> Self {
        if let Some(place) = self.textures.iter_mut().find(|place| place.is_none()) {
            *place = Some(texture.into());
        }
        self
    }
}

/// The answer of a texture model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TextureAnswer<'a> {
    /// The task of the model: what it tells apart.
    pub task: Task,
    /// The class's name.
    #[serde(borrow)]
    pub label: Text<'a>,
    /// The probability that the class is right, in units of 2^-15; `None` for a model without a calibration.
    pub confidence: Option<u16>,
    /// Whether the touch is like those of the training; `None` if the model does not tell.
    pub known: Option<bool>,
}

impl<'a> TextureAnswer<'a> {
    /// Creates the answer of a model for this task: the class of this name. The model has no calibration.
    pub const fn new(task: Task, label: Text<'a>) -> Self {
        Self { task, label, confidence: None, known: None }
    }
}

impl<'m> From<Texture<'m>> for TextureAnswer<'m> {
    fn from(texture: Texture<'m>) -> Self {
        let Texture { task, label, confidence, known, .. } = texture;
        Self { task, label: label.into(), confidence, known }
    }
}

/// A fault of a board, or its end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Fault<'a> {
    /// Pixels came faster than they were taken. The frame is lost.
    Overrun,
    /// A frame did not begin or end when it should have. The frame is lost.
    LostSync,
    /// The camera sends no pixels.
    SensorSilent,
    /// The camera does not answer on its bus.
    SensorGone {
        /// The lines of the bus while nothing is sent; `None` from a board before version 0.4.
        #[serde(deserialize_with = "super::numbers::newest")]
        lines: Option<BusLines>,
    },
    /// The firmware does not know the camera.
    SensorUnknown {
        /// The identity that the camera reports.
        id: u16,
    },
    /// The camera sends frames again.
    SensorBack,
    /// The reason why the board started again: the text of a panic, or the name of a fault.
    #[serde(borrow)]
    LastRun(Text<'a, 191>),
    /// The camera answers, but does not keep the values that are written to it.
    SensorRefuses {
        /// The register that holds another value.
        register: u16,
        /// The values; `None` from a board before version 0.4.
        #[serde(deserialize_with = "super::numbers::newest")]
        values: Option<RegisterValues>,
    },
    /// The camera keeps its settings, but its frames are not those that the settings make.
    SensorDiffers {
        /// The part of the frames that is wrong.
        #[serde(serialize_with = "super::numbers::variant")]
        part: FramePart,
        /// The camera's address on its bus, of 7 bits.
        address: u8,
        /// The register that decides the part.
        register: u16,
        /// The numbers that were measured.
        found: FrameNumbers,
        /// The numbers that the settings make.
        expected: FrameNumbers,
    },
}

/// The lines of a camera's bus, SCL and SDA, while nothing is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum BusLines {
    /// Resistors outside of the chip pull both lines up.
    PulledUp,
    /// Both lines are high with the chip's resistors only.
    NotPulledUp,
    /// Something holds SDA low.
    DataLow,
    /// Something holds SCL low.
    ClockLow,
    /// Something holds both lines low.
    BothLow,
}

/// The part of a camera's frames that is not as its settings make it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum FramePart {
    /// The lines or the words of a frame.
    Size,
    /// The order of bytes, or color that should be fixed.
    Format,
    /// The bits of a test pattern.
    Pattern,
    /// The frames per second.
    Rate,
}

/// The values of a register that a camera does not keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
// It is exhaustive: a board makes one.
pub struct RegisterValues {
    /// The camera's address on its bus, of 7 bits.
    pub address: u8,
    /// The value that was read.
    pub found: u8,
    /// The value that was written.
    pub expected: u8,
}

/// Numbers of a camera's frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
// It is exhaustive: another field would be another version of the link.
pub struct FrameNumbers {
    /// The lines of a frame.
    #[serde(serialize_with = "super::numbers::short")]
    pub lines: u32,
    /// The words of four bytes of a frame.
    #[serde(serialize_with = "super::numbers::short")]
    pub words: u32,
    /// The frame rate in frames per 1000 seconds.
    #[serde(serialize_with = "super::numbers::short")]
    pub millihertz: u32,
}

/// A request from a host to a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Request {
    /// Asks for a [`Message::Hello`].
    Hello,
    /// Says whether every frame's features are wanted. At first they are not.
    Features(bool),
    /// Says whether every event's sample is wanted. At first it is not.
    Samples(bool),
    /// Says whether speed and direction of every frame are wanted. At first they are not. A board without
    /// [`LiveMotion`](crate::touch::motion::LiveMotion) sends none.
    Motion(bool),
    /// Says whether the host acknowledges events. Then the board sends those again that were not acknowledged. At first
    /// the host does not.
    KeepEvents(bool),
    /// Acknowledges an event.
    Acknowledge {
        /// The number of the event: [`Answers::number`].
        event: u16,
    },
    /// Asks for a picture of what the camera sees, as [`PicturePart`]s and a [`PictureEnd`]. One that is being sent is
    /// given up. A board without pictures sends none.
    Picture,
    /// Asks for the board's clock. The answer repeats the host's time in microseconds, whatever its start.
    Time {
        /// The host's time.
        host_us: u64,
    },
    // Each has its number also where a feature is missing: then its content has no value, or is refused.
    /// Asks for the settings that the board uses. A board whose settings are fixed does not answer.
    #[cfg_attr(not(feature = "settings"), serde(deserialize_with = "never"))]
    Settings,
    /// Sets settings, which the board checks and keeps over resets.
    Set(Settings),
    /// Returns the board to the settings that were compiled in.
    #[cfg_attr(not(feature = "settings"), serde(deserialize_with = "never"))]
    Forget,
    /// Asks for the textures that the board has learned. A board that does not learn does not answer.
    #[cfg_attr(not(feature = "learn"), serde(deserialize_with = "never"))]
    Textures,
    /// Asks the board to learn a texture of this name from the next slides. If it learns one of this name already, it
    /// goes on. The answer is a [`Message::Learning`]. The host asks for [`Request::Textures`] about once per second,
    /// so that the board knows that somebody watches.
    Learn(TextureName),
    /// Asks the board to stop learning. What it has learned before stays.
    #[cfg_attr(not(feature = "learn"), serde(deserialize_with = "never"))]
    StopLearning,
    /// Asks the board to forget a texture that it has learned. It starts again without it.
    ForgetTexture(TextureName),
    /// Asks for the model that the board uses, and for those that it takes. A board that takes none does not answer.
    #[cfg_attr(not(feature = "models"), serde(deserialize_with = "never"))]
    Model,
    /// Says that a model will be sent in pieces. If pieces of the same model have arrived since the start, they are
    /// kept.
    SendModel(ModelId),
    /// Sends a piece of the model. The answer says where the next piece has to begin, so that a piece that is lost or
    /// comes twice does no harm. After the last one the board checks the whole model and keeps it.
    ModelPiece(ModelPiece),
    /// Asks the board to forget the models that were sent, and to use the one that is compiled in.
    #[cfg_attr(not(feature = "models"), serde(deserialize_with = "never"))]
    ForgetModel,
    /// Asks the board to start its boot loader, which takes a new program over USB. Every board with the node answers.
    Bootloader,
}

/// The number of frames of a sample in one message.
pub const SAMPLE_PART: usize = 10;
const _: () = assert!(SAMPLE_FRAMES.is_multiple_of(SAMPLE_PART));

/// Returns the seven messages that carry an event's sample. The event comes after them.
pub fn sample_parts(frame: u64, sample: Sample<'_>) -> impl Iterator<Item = Message<'static>> {
    (0..SAMPLE_FRAMES).step_by(SAMPLE_PART).map(move |first| {
        let mut features = [[0; FEATURES]; SAMPLE_PART];
        for (place, numbers) in features.iter_mut().zip(sample.frames().skip(first)) {
            *place = *numbers;
        }
        Message::SamplePart { frame, first: first as u8, features }
    })
}
