//! YUYV and UYVY: four bytes for two pixels.

use super::ycbcr::Conversion;
use super::{Block, Encoder, Frame};

/// Cells of four bytes with luma at bytes `LUMA` and `LUMA` + 2; chroma is the mean of both pixels'.
#[derive(Debug)]
pub(super) struct PackedPairs<const LUMA: usize>(pub(super) Conversion);

impl<const LUMA: usize> Encoder for PackedPairs<LUMA> {
    fn is_coloured(&self) -> bool {
        true
    }

    fn cell(&self) -> [usize; 2] {
        [2, 1]
    }

    fn encode(&self, block: &Block<'_>, frame: &mut Frame) {
        let [red, green, blue] = block.colours.map(|values| values.as_chunks::<2>().0);
        let cells = frame.row(block.top, 2 * block.left, 2 * block.width).as_chunks_mut::<4>().0;
        for (((cell, red), green), blue) in cells.iter_mut().zip(red).zip(green).zip(blue) {
            let [first, second] = [0, 1].map(|k| [red[k], green[k], blue[k]].map(i32::from));
            let sum = [first[0] + second[0], first[1] + second[1], first[2] + second[2]];
            let ([cb, cr], [first, second]) = (self.0.chroma(sum, 1), [first, second].map(|pixel| self.0.luma(pixel)));
            *cell = if LUMA == 0 { [first, cb, second, cr] } else { [cb, first, cr, second] };
        }
    }
}
