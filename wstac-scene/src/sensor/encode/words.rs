//! GREY, Y10, Y12, Y16, and mosaics of the same depths: one value for each pixel.

use super::{Block, Encoder, Frame};

/// The encoder of one little-endian word of `BYTES` bytes, 1 or 2, for each pixel.
#[derive(Debug)]
pub(super) struct Words<const BYTES: usize>;

impl<const BYTES: usize> Encoder for Words<BYTES> {
    fn is_colored(&self) -> bool {
        false
    }

    fn encode(&self, block: &Block<'_>, frame: &mut Frame) {
        let words = frame.row(block.top, BYTES * block.left, BYTES * block.width).as_chunks_mut::<BYTES>().0;
        for (word, value) in words.iter_mut().zip(block.colors[1]) {
            word.iter_mut().zip(value.to_le_bytes()).for_each(|(byte, of)| *byte = of);
        }
    }
}
