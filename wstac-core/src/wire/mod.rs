//! The link from a board to a host: messages in frames that find their beginning again after any garbage.
//!
//! A board sends [`Message`]s and takes [`Request`]s; nothing waits for an answer, so one direction alone works, too.
//!
//! ```
//! use wstac_core::speed::SpeedConfig;
//! use wstac_core::trigger::Event;
//! use wstac_core::wire::{self, Answers, Message};
//!
//! fn send(event: &Event, config: &SpeedConfig, sequence: &mut u16, uart: &mut impl FnMut(&[u8])) {
//!     let mut buffer = [0; wire::LONGEST];
//!     uart(wire::encode(&Message::Event(Answers::new(event, config)), *sequence, &mut buffer));
//!     *sequence = sequence.wrapping_add(1);
//! }
//! ```
//!
//! ## Bytes
//! A frame is `00`, what follows in [COBS](https://doi.org/10.1109/90.769765), and `00`; no other byte of it is 0. The zero in front keeps
//! garbage out of the first message behind it. In COBS stand, in this order:
//!
//! | bytes | what |
//! | --- | --- |
//! | 1 | [`VERSION`] |
//! | 1–3 | the sender's sequence number, one more with each message, after 65 535 again 0: a varint |
//! | 1–… | the message as [postcard](https://postcard.jamesmunns.com/wire-format) writes it: its number (that of the variant of [`Message`] or [`Request`], in the order of the source), then its fields in that order |
//! | 4 | CRC-32 (IEEE) of all bytes before, the lowest first |
//!
//! Of postcard: `u8` and `bool` are a byte; larger integers are varints, seven bits a byte, the lowest first, with bit 7 set in all but the
//! last, signed ones as zigzag (0, −1, 1, −2 …); `f32` is its four bytes, the lowest first; an option is 0, or 1 and the value; a result is 0 and
//! the value, or 1 and the error; an enum is its variant's number and the variant's fields; text is its length in bytes and the bytes.
//! Features alone are not as postcard has numbers, but a byte string: its length, 20 or 200, and two bytes a feature, the lower first. They are dark
//! most of the time, and then as varints would take three.
//!
//! ## Versions
//! New messages, and new fields at a message's end, leave [`VERSION`] as it is: a receiver passes over messages that it does not know
//! ([`DecodeError::Unknown`]) and over bytes behind the fields that it knows. Any other change counts it up; then a receiver reads nothing
//! ([`DecodeError::Version`]) and says so.

mod decoder;
mod frame;
mod message;
mod numbers;
mod text;

pub use decoder::{DecodeError, Decoder, Received};
pub use frame::encode;
pub use message::{Answers, Fault, Hello, Message, ModelFacts, Request, SAMPLE_PART, TextureAnswer, sample_parts};
pub use text::Text;

use serde::{Deserialize, Serialize};

/// Version of the bytes on the link: the first of every frame.
pub const VERSION: u8 = 1;

/// Bytes of the longest frame, its zeros included: any message fits.
pub const LONGEST: usize = 256;

/// What frames carry: [`Message`] or [`Request`], and nothing else.
pub trait Payload<'a>: Serialize + Deserialize<'a> + sealed::Sealed {
    /// Whether its sender begins with it, if it is its first message.
    fn starts(&self) -> bool;
}

impl Payload<'_> for Request {
    fn starts(&self) -> bool {
        false
    }
}

impl<'a> Payload<'a> for Message<'a> {
    fn starts(&self) -> bool {
        matches!(self, Self::Hello(hello) if hello.frame == 0)
    }
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Request {}
    impl Sealed for super::Message<'_> {}
}

/// Remainders of CRC-32 (IEEE) for every half byte: small, as flash is.
const CRC_TABLE: [u32; 16] = {
    let mut table = [0; 16];
    let mut nibble = 0;
    while nibble < 16 {
        let mut rest = nibble as u32;
        let mut bit = 0;
        while bit < 4 {
            rest = if rest & 1 == 1 { rest >> 1 ^ 0xEDB8_8320 } else { rest >> 1 };
            bit += 1;
        }
        table[nibble] = rest;
        nibble += 1;
    }
    table
};

/// Takes one more byte into a CRC-32 that starts at `u32::MAX` and is inverted at the end.
fn crc(rest: u32, byte: u8) -> u32 {
    let rest = rest ^ u32::from(byte);
    let rest = rest >> 4 ^ CRC_TABLE[(rest & 15) as usize];
    rest >> 4 ^ CRC_TABLE[(rest & 15) as usize]
}

#[cfg(test)]
mod tests;
