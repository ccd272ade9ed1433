//! The link from a board to a host. Messages are in frames whose beginning is found again after any garbage.
//!
//! A board sends [`Message`]s and takes [`Request`]s. Neither side waits for an answer, so a link in one direction
//! works, too. If the host acknowledges events, an event that was lost or damaged is sent again: see [`Outbox`].
//!
//! ```
//! use wstac_core::law::ByCoherence;
//! use wstac_core::paper::trigger::Event;
//! use wstac_core::wire::{self, Answers, Message};
//!
//! fn send(event: &Event, law: &ByCoherence, sequence: &mut u16, uart: &mut impl FnMut(&[u8])) {
//!     let mut buffer = [0; wire::LONGEST];
//!     uart(wire::encode(&Message::Event(Answers::new(event, law)), *sequence, &mut buffer));
//!     *sequence = sequence.wrapping_add(1);
//! }
//! ```
//!
//! ## Bytes
//! A frame is `00`, then the content in [COBS](https://doi.org/10.1109/90.769765), then `00`. No other byte of it is 0.
//! The leading zero keeps garbage out of the first message behind it. The content is, in this order:
//!
//! | bytes | content |
//! | --- | --- |
//! | 1 | [`VERSION`] |
//! | 1–3 | the sender's sequence number, one more with each message, 0 again after 65,535; a varint |
//! | 1–… | the message as [postcard] writes it: its number, then its fields |
//! | 4 | CRC-32 (IEEE) of all bytes before, the lowest first |
//!
//! The number of a message is that of its variant of [`Message`] or [`Request`]. Variants and fields are in the order
//! of the source.
//!
//! [postcard]: https://postcard.jamesmunns.com/wire-format
//!
//! In postcard, `u8` and `bool` are one byte. Larger integers are varints: seven bits per byte, the lowest first, with
//! bit 7 set in all but the last. Signed ones are zigzag (0, −1, 1, −2 …). `f32` is its four bytes, the lowest first.
//! An option is 0, or 1 and the value. A result is 0 and the value, or 1 and the error. An enum is its variant's number
//! and the variant's fields. Text is its length in bytes and the bytes.
//!
//! Only features differ from postcard's numbers. They are a byte string: its length, 20 or 200, and two bytes per
//! feature, the lower first. Features are dark most of the time, and as varints they would then take three bytes.
//!
//! ## Impossible numbers
//! A whole frame may still have numbers that nothing can have, from a board that is wrong. A receiver refuses such a
//! message ([`DecodeError::Impossible`]): a speed that is not above 0 or not finite, an angle outside 0 ≤ degrees <
//! 360, a standard deviation below 0, a confidence above 1, more frames than a sample has, a feature above ln 5, a
//! speed of a touch that does not slide, a slip before its onset, more slides than are needed, and a frame number or
//! count above 2^53.
//!
//! ## Versions
//! New messages, and new fields at a message's end, leave [`VERSION`] as it is. A receiver skips messages that it does
//! not know ([`DecodeError::Unknown`]), and bytes behind the fields that it knows. Any other change increases the
//! version. Then a receiver reads no message and reports it ([`DecodeError::Version`]).
//!
//! Version 2 added to [`Answers`]: the kind of the touch, its first lit frame and its first dark one, and standard
//! deviations of speed and direction. Since then a direction is any angle, a [`Hello`]'s trigger says whether it gives
//! one event per touch, and [`Message::ContactEnd`] says when the light has left.
//!
//! Version 3 added to [`TextureAnswer`] a confidence, and whether the texture is known.
//!
//! Version 4 added to [`Answers`] the event's number and what the board still keeps, and to [`Hello`] the revision and
//! the chip's number. Since then there are [`Message::Telemetry`], [`Request::KeepEvents`] and
//! [`Request::Acknowledge`], [`Request::Picture`] asks for a picture, [`Request::Time`] for the board's clock,
//! `Request::Set` sets the board's settings, and the register of [`Fault::SensorRefuses`] has 16 bits.
//!
//! Since then, without another version: `Request::Textures` and those behind it are about textures that a board learns,
//! and `Request::Model` and those behind it about models that are sent to a board; [`BoardModel`] ends with the
//! newest layout of model files that the board reads. `LearnedTextures` has ten names, and had eight in builds before
//! the release of 0.4. [`Answers`] ends with the reason why
//! it is not reliable, what it is known by, and how many frames of the sample had arrived. [`Message::Slip`] says that
//! a held part begins to slip. [`Fault::SensorDiffers`] says what a camera sends instead of what it is set to; before,
//! that was a [`Fault::SensorRefuses`], which ends with the values since then. [`Fault::SensorGone`] ends with the
//! lines of the bus. [`Request::Bootloader`] starts a board's boot loader, and [`Message::Bootloader`] says which.

mod decoder;
mod frame;
#[cfg(feature = "learn")]
mod learned;
mod message;
#[cfg(feature = "models")]
mod models;
pub(crate) mod numbers;
mod outbox;
mod picture;
mod possible;
#[cfg(feature = "settings")]
mod settings;
mod text;

pub use decoder::{DecodeError, Decoder, Received};
pub use frame::encode;
#[cfg(feature = "learn")]
pub use learned::{
    LEARNING_MS, LONGEST_TEXTURE_NAME, LearnedTextures, Learning, LearningStep, MOST_TEXTURES, NotLearned, NotTaken,
    TextureName,
};
pub use message::{
    Answers, Bootloader, BusLines, Fault, FrameNumbers, FramePart, FrameTime, Hello, Message, ModelFacts, Never,
    RegisterValues, Request, SAMPLE_PART, Telemetry, TextureAnswer, Wanted, sample_parts,
};
#[cfg(feature = "models")]
pub use models::{AcceptedModels, BoardModel, MODEL_PIECE, ModelId, ModelKind, ModelPiece, ModelRefusal, ModelStep};
pub use outbox::{Outbox, RESEND_MS, TRIES};
pub use picture::{PICTURE_PART, PictureEnd, PicturePart};
pub use possible::Quantity;
#[cfg(feature = "settings")]
pub use settings::{LONGEST_REQUEST, Refusal, Settings, SettingsInUse};
pub use text::Text;

use serde::{Deserialize, Serialize};

/// The version of the bytes on the link, in the first byte of every frame.
pub const VERSION: u8 = 4;

/// The number of bytes of the longest frame, its zeros included. Any message fits.
pub const LONGEST: usize = 314;

/// The content of a frame: [`Message`] or [`Request`], and no other type.
pub trait Payload<'a>: Serialize + Deserialize<'a> + sealed::Sealed {
    /// Returns whether a sender begins with it, if it is the sender's first message.
    fn starts(&self) -> bool {
        false
    }

    /// Checks that all numbers are possible.
    ///
    /// # Errors
    /// Returns the first quantity that is not.
    fn check(&self) -> Result<(), Quantity> {
        Ok(())
    }
}

impl Payload<'_> for Request {}

impl<'a> Payload<'a> for Message<'a> {
    fn starts(&self) -> bool {
        matches!(self, Self::Hello(hello) if hello.frame == 0)
    }

    fn check(&self) -> Result<(), Quantity> {
        possible::check(self)
    }
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Request {}
    impl Sealed for super::Message<'_> {}
}

#[cfg(test)]
mod tests;
