//! NV12, YU12, YUV422P, YUV444P: a plane of luma, then chroma.

use super::ycbcr::Conversion;
use super::{Block, Encoder, Frame};

/// The arrangement of chroma; each sample is the mean of its cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Chroma {
    /// NV12: Cb Cr pairs for 2 × 2 pixels.
    Interleaved,
    /// YU12: planes of Cb and Cr for 2 × 2 pixels.
    Quarter,
    /// YUV422P: planes of Cb and Cr for 2 × 1 pixels.
    Half,
    /// YUV444P: planes of Cb and Cr.
    Full,
}

#[derive(Debug)]
pub(super) struct Planar {
    pub(super) conversion: Conversion,
    pub(super) chroma: Chroma,
}

impl Encoder for Planar {
    fn cell(&self) -> [usize; 2] {
        match self.chroma {
            Chroma::Interleaved | Chroma::Quarter => [2, 2],
            Chroma::Half => [2, 1],
            Chroma::Full => [1, 1],
        }
    }

    fn encode(&self, block: &Block<'_>, frame: &mut Frame) {
        let rows = block.rows(0).zip(block.rows(1)).zip(block.rows(2));
        for (((y, red), (_, green)), (_, blue)) in rows {
            let row = frame.row(y, block.left, block.width).iter_mut();
            for (((luma, &red), &green), &blue) in row.zip(red).zip(green).zip(blue) {
                *luma = self.conversion.luma([red, green, blue]);
            }
        }
        match self.chroma {
            Chroma::Interleaved => self.encode_pairs(block, frame),
            Chroma::Quarter => self.encode_planes::<2, 2>(block, frame),
            Chroma::Half => self.encode_planes::<2, 1>(block, frame),
            Chroma::Full => self.encode_planes::<1, 1>(block, frame),
        }
    }
}

impl Planar {
    /// Writes the Cb Cr pairs of 2 × 2 pixels.
    fn encode_pairs(&self, block: &Block<'_>, frame: &mut Frame) {
        let row = frame.plane_row(0, frame.bytes_per_row, block.top / 2, block.left, block.width);
        for (pair, sum) in row.as_chunks_mut().0.iter_mut().zip(sums::<2, 2>(block)) {
            *pair = [0, 1].map(|which| self.conversion.chroma(which, sum, 0.25));
        }
    }

    /// Writes the planes of Cb and Cr.
    fn encode_planes<const COLUMNS: usize, const ROWS: usize>(&self, block: &Block<'_>, frame: &mut Frame) {
        let share = 1.0 / (COLUMNS * ROWS) as f32;
        let bytes_per_row = frame.bytes_per_row.div_ceil(COLUMNS);
        let plane = bytes_per_row * frame.height.div_ceil(ROWS);
        let (x, y, cells) = (block.left / COLUMNS, block.top / ROWS, block.width / COLUMNS);
        for which in [0, 1] {
            let row = frame.plane_row(which * plane, bytes_per_row, y, x, cells);
            for (byte, sum) in row.iter_mut().zip(sums::<COLUMNS, ROWS>(block)) {
                *byte = self.conversion.chroma(which, sum, share);
            }
        }
    }
}

/// Sums the colors over each cell of a block that is `ROWS` rows high: up to 4 · 255.
fn sums<'a, const COLUMNS: usize, const ROWS: usize>(
    block: &Block<'a>,
) -> impl Iterator<Item = [u16; 3]> + use<'a, COLUMNS, ROWS> {
    let cells = |values: &'a [u16]| {
        // If there is no second row, the first one takes its place and does not count.
        let (first, second) = values.split_at(values.len() / ROWS);
        let second = if ROWS == 2 { second } else { first };
        let pairs = first.as_chunks::<COLUMNS>().0.iter().zip(second.as_chunks::<COLUMNS>().0);
        pairs.map(|(first, second)| first.iter().sum::<u16>() + if ROWS == 2 { second.iter().sum() } else { 0 })
    };
    let [red, green, blue] = block.colors.map(cells);
    red.zip(green).zip(blue).map(|((red, green), blue)| [red, green, blue])
}
