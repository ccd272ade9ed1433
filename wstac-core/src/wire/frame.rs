//! Turns a message's bytes into a frame: CRC and COBS are computed as the bytes come, without a second buffer.

use postcard::ser_flavors::Flavor;
use postcard::{Error, Result};

use super::{LONGEST, Payload, VERSION};
use crate::crc;

/// Writes the frame of a [`Message`](super::Message) or a [`Request`](super::Request) to the first bytes of `buffer`
/// and returns them. A sender adds one to `sequence` with each frame, and wraps.
pub fn encode<'b, 'm>(message: &impl Payload<'m>, sequence: u16, buffer: &'b mut [u8; LONGEST]) -> &'b [u8] {
    let frame = Frame { buffer: &mut *buffer, code: 1, end: 2, crc: u32::MAX };
    // Every message fits (a test has the longest of each), so no byte is left out here.
    let length = postcard::serialize_with_flavor(&(VERSION, sequence, message), frame).unwrap_or(0);
    buffer.get(..length).unwrap_or_default()
}

/// A frame under way. Its zero at the start and its first code already have their places.
struct Frame<'b> {
    buffer: &'b mut [u8; LONGEST],
    /// The place of the present block's code, which is the distance from there to the next zero.
    code: usize,
    end: usize,
    crc: u32,
}

/// The code of the longest block, which stands for no zero.
const LONGEST_BLOCK: usize = u8::MAX as usize;

impl Frame<'_> {
    fn set(&mut self, at: usize, byte: u8) -> Result<()> {
        *self.buffer.get_mut(at).ok_or(Error::SerializeBufferFull)? = byte;
        Ok(())
    }

    /// Adds a byte in COBS.
    fn put(&mut self, byte: u8) -> Result<()> {
        if byte == 0 {
            self.close()
        } else {
            self.set(self.end, byte)?;
            self.end += 1;
            // A block of 254 bytes ends without a zero.
            if self.end - self.code == LONGEST_BLOCK { self.close() } else { Ok(()) }
        }
    }

    /// Ends the block with a zero, or without one if it is the longest.
    fn close(&mut self) -> Result<()> {
        self.set(self.code, (self.end - self.code) as u8)?;
        self.code = self.end;
        self.end += 1;
        Ok(())
    }
}

impl Flavor for Frame<'_> {
    type Output = usize;

    // It is called from every field of every message. Inlined, the calls would make up most of the code.
    #[inline(never)]
    fn try_push(&mut self, byte: u8) -> Result<()> {
        self.crc = crc::step(self.crc, byte);
        self.put(byte)
    }

    #[inline(never)]
    fn try_extend(&mut self, bytes: &[u8]) -> Result<()> {
        bytes.iter().try_for_each(|&byte| self.try_push(byte))
    }

    fn finalize(mut self) -> Result<usize> {
        (!self.crc).to_le_bytes().into_iter().try_for_each(|byte| self.put(byte))?;
        self.close()?;
        self.set(0, 0)?;
        self.set(self.code, 0)?;
        Ok(self.end)
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    /// Decodes COBS as its paper describes it.
    fn decoded(mut bytes: &[u8]) -> Vec<u8> {
        let mut content = Vec::new();
        while let [code, rest @ ..] = bytes {
            let (block, rest) = rest.split_at(usize::from(*code) - 1);
            content.extend(block);
            if *code < u8::MAX && !rest.is_empty() {
                content.push(0);
            }
            bytes = rest;
        }
        content
    }

    #[test]
    fn blocks_of_any_length_are_decoded_as_they_were_put() {
        for length in 0..275 {
            for zero in [None, Some(0), Some(7), Some(length / 2), Some(253), Some(254), Some(length)] {
                let mut content: Vec<u8> = (0..length).map(|at| (at % 255 + 1) as u8).collect();
                if let Some(place) = zero.and_then(|at| content.get_mut(at)) {
                    *place = 0;
                }
                let mut buffer = [0xAA; LONGEST];
                let mut frame = Frame { buffer: &mut buffer, code: 1, end: 2, crc: u32::MAX };
                frame.try_extend(&content).unwrap();
                content.extend((!frame.crc).to_le_bytes());
                let end = frame.finalize().unwrap();
                assert_eq!((buffer[0], buffer[end - 1]), (0, 0));
                assert!(!buffer[1..end - 1].contains(&0), "{length} {zero:?}");
                assert_eq!(decoded(&buffer[1..end - 1]), content, "{length} {zero:?}");
            }
        }
    }
}
