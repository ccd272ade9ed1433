//! GREY, Y10, Y12, Y16, and mosaics of the same depths: one value for each pixel.

use super::{Block, Encoder, Frame};

/// The encoder of one byte for each pixel.
#[derive(Debug)]
pub(super) struct Bytes;

impl Encoder for Bytes {
    fn is_colored(&self) -> bool {
        false
    }

    fn encode(&self, block: &Block<'_>, frame: &mut Frame) {
        for (byte, &value) in frame.row(block.top, block.left, block.width).iter_mut().zip(block.colors[1]) {
            *byte = value as u8;
        }
    }
}

/// The encoder of one little-endian 16-bit word for each pixel.
#[derive(Debug)]
pub(super) struct Words;

impl Encoder for Words {
    fn is_colored(&self) -> bool {
        false
    }

    fn encode(&self, block: &Block<'_>, frame: &mut Frame) {
        let words = frame.row(block.top, 2 * block.left, 2 * block.width).as_chunks_mut().0;
        for (word, value) in words.iter_mut().zip(block.colors[1]) {
            *word = value.to_le_bytes();
        }
    }
}
