//! YUYV and UYVY: four bytes for two pixels.

use super::ycbcr::Conversion;
use super::{Block, Encoder, Frame};

/// Cells of four bytes with luma at bytes `LUMA` and `LUMA` + 2; chroma is the mean of both pixels.
#[derive(Debug)]
pub(super) struct PackedPairs<const LUMA: usize>(pub(super) Conversion);

impl<const LUMA: usize> Encoder for PackedPairs<LUMA> {
    fn cell(&self) -> [usize; 2] {
        [2, 1]
    }

    fn encode(&self, block: &Block<'_>, frame: &mut Frame) {
        let [red, green, blue] = block.colors.map(|values| values.as_chunks::<2>().0);
        let cells = frame.row(block.top, 2 * block.left, 2 * block.width).as_chunks_mut::<4>().0;
        for (((cell, red), green), blue) in cells.iter_mut().zip(red).zip(green).zip(blue) {
            let [first, second] = [0, 1].map(|k| self.0.luma([red[k], green[k], blue[k]]));
            let sum = [red[0] + red[1], green[0] + green[1], blue[0] + blue[1]];
            let [cb, cr] = [0, 1].map(|which| self.0.chroma(which, sum, 0.5));
            *cell = if LUMA == 0 { [first, cb, second, cr] } else { [cb, first, cr, second] };
        }
    }
}
