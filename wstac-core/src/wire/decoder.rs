//! Turns the bytes of a link into messages. After garbage it starts again at the next zero.

use core::fmt;

use super::{LONGEST, Payload, Quantity, VERSION};
use crate::crc::crc32;

/// Finds frames in the bytes of a link. `N` is the length of the longest frame that it takes. For a board, which
/// receives only requests, 16 bytes are enough.
///
/// ```
/// use wstac_core::wire::{Decoder, LONGEST, Request, encode};
///
/// let mut decoder = Decoder::<16>::new();
/// let mut buffer = [0; LONGEST];
/// let bytes = b"garbage".iter().chain(encode(&Request::Features(true), 0, &mut buffer));
/// let mut requests = 0;
/// for &byte in bytes {
///     if let Some(Ok(received)) = decoder.push::<Request>(byte) {
///         assert_eq!(received.message, Request::Features(true));
///         requests += 1;
///     }
/// }
/// assert_eq!(requests, 1);
/// ```
#[derive(Clone, Debug)]
pub struct Decoder<const N: usize = LONGEST> {
    /// The present frame without its COBS codes.
    bytes: [u8; N],
    length: usize,
    /// Bytes of the COBS block that are still to come.
    left: u8,
    /// Whether the next code, if one comes, stands for a zero.
    zero: bool,
    state: Arrived,
    /// The next expected sequence number.
    next: Option<u16>,
    /// Messages that were lost before a message that could not be read.
    lost: u16,
}

/// The part of a frame that has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Arrived {
    Nothing,
    Some,
    TooMuch,
}

/// A message that arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Received<P> {
    /// The message.
    pub message: P,
    /// The number of messages that the sender sent since the last received one and that did not arrive.
    pub lost: u16,
    /// Whether it is the first message of a sender that has just started. Then no message was lost before it.
    pub first: bool,
}

/// The reason why a frame is no message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DecodeError {
    /// The frame's bytes are not the bytes that were sent, or never were a frame.
    Damaged,
    /// The frame has another version of the link than [`VERSION`]: this one.
    Version(u8),
    /// The frame arrived whole, but its message is unknown here.
    Unknown,
    /// The frame arrived whole, but its message has a number that is impossible.
    Impossible(Quantity),
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Damaged => f.write_str("the frame is damaged: its bytes are not the bytes that were sent"),
            Self::Version(found) => write!(f, "version of the link is {found}, expected {VERSION}"),
            Self::Unknown => f.write_str("the message is unknown to this version of the software"),
            Self::Impossible(quantity) => write!(f, "the message has an impossible {quantity}"),
        }
    }
}

impl core::error::Error for DecodeError {}

impl<const N: usize> Default for Decoder<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Decoder<N> {
    /// Creates a decoder before its first byte.
    pub const fn new() -> Self {
        Self { bytes: [0; N], length: 0, left: 0, zero: false, state: Arrived::Nothing, next: None, lost: 0 }
    }

    /// Takes the next byte. If the byte ends a frame, returns its message, or the reason why the frame is no message.
    pub fn push<'a, P: Payload<'a>>(&'a mut self, byte: u8) -> Option<Result<Received<P>, DecodeError>> {
        if byte != 0 {
            self.take(byte);
            return None;
        }
        let (length, left, state) = (self.length, self.left, self.state);
        (self.length, self.left, self.zero, self.state) = (0, 0, false, Arrived::Nothing);
        match state {
            Arrived::Nothing => None,
            Arrived::Some if left == 0 => Some(self.read(length)),
            Arrived::Some | Arrived::TooMuch => Some(Err(DecodeError::Damaged)),
        }
    }

    /// Takes a byte that is not 0.
    fn take(&mut self, byte: u8) {
        if self.left > 0 {
            self.left -= 1;
            self.store(byte);
            return;
        }
        if self.state == Arrived::Nothing {
            self.state = Arrived::Some;
        }
        if self.zero {
            self.store(0);
        }
        self.left = byte.saturating_sub(1);
        self.zero = byte < u8::MAX;
    }

    fn store(&mut self, byte: u8) {
        match self.bytes.get_mut(self.length) {
            Some(place) => {
                *place = byte;
                self.length += 1;
            }
            None => self.state = Arrived::TooMuch,
        }
    }

    fn read<'a, P: Payload<'a>>(&'a mut self, length: usize) -> Result<Received<P>, DecodeError> {
        let frame = self.bytes.get(..length).unwrap_or_default();
        let (checked, sum) = frame.split_last_chunk::<4>().ok_or(DecodeError::Damaged)?;
        if crc32(checked.iter().copied()) != u32::from_le_bytes(*sum) {
            return Err(DecodeError::Damaged);
        }
        let (&version, rest) = checked.split_first().ok_or(DecodeError::Damaged)?;
        if version != VERSION {
            return Err(DecodeError::Version(version));
        }
        let (sequence, rest) = postcard::take_from_bytes::<u16>(rest).map_err(|_| DecodeError::Unknown)?;
        let message = postcard::from_bytes::<P>(rest);
        let ahead = sequence.wrapping_sub(self.next.unwrap_or(sequence));
        // Far behind does not mean far ahead: the sender has started again, and the messages that it has sent since are
        // lost.
        let lost = if ahead > u16::MAX / 2 { sequence } else { ahead };
        self.next = Some(sequence.wrapping_add(1));
        self.lost = self.lost.saturating_add(lost);
        let message = message.map_err(|_| DecodeError::Unknown)?;
        message.check().map_err(DecodeError::Impossible)?;
        let lost = core::mem::take(&mut self.lost);
        // A board that has had no frame yet answers with the same hello, but with another sequence number.
        let first = sequence == 0 && message.starts();
        Ok(Received { lost: if first { 0 } else { lost }, first, message })
    }
}
