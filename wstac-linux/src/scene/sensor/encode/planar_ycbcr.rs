//! NV12, YU12, YUV422P, YUV444P: a plane of luma, then chroma.

use super::ycbcr::Conversion;
use super::{Block, Encoder, Frame};

/// How chroma lies; each sample is the mean of its cell.
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

/// A planar format.
#[derive(Debug)]
pub(super) struct Planar {
    pub(super) conversion: Conversion,
    pub(super) chroma: Chroma,
}

impl Encoder for Planar {
    fn is_coloured(&self) -> bool {
        true
    }

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
                *luma = self.conversion.luma([red, green, blue].map(i32::from));
            }
        }
        self.encode_chroma(block, frame);
    }
}

impl Planar {
    fn encode_chroma(&self, block: &Block<'_>, frame: &mut Frame) {
        let [columns, rows] = self.cell();
        let log_count = (columns * rows).trailing_zeros();
        let (x, y, cells) = (block.left / columns, block.top / rows, block.width / columns);
        let chroma = (0..cells).map(|cell| {
            let sum = block.colours.map(|values| cell_sum(values, block.width, [columns, rows], cell));
            self.conversion.chroma(sum, log_count)
        });
        if self.chroma == Chroma::Interleaved {
            let pairs = frame.plane_row(0, frame.bytes_per_row, y, 2 * x, 2 * cells).as_chunks_mut().0;
            for (pair, chroma) in pairs.iter_mut().zip(chroma) {
                *pair = chroma;
            }
            return;
        }
        let bytes_per_row = frame.bytes_per_row.div_ceil(columns);
        let plane = bytes_per_row * frame.height.div_ceil(rows);
        for (cell, [cb, cr]) in chroma.enumerate() {
            for (offset, value) in [(0, cb), (plane, cr)] {
                if let [byte] = frame.plane_row(offset, bytes_per_row, y, x + cell, 1) {
                    *byte = value;
                }
            }
        }
    }
}

/// Sum of a colour over the pixels of a cell.
#[inline(always)]
fn cell_sum(values: &[u16], width: usize, [columns, rows]: [usize; 2], cell: usize) -> i32 {
    let row = |row: usize| {
        let at = row * width + cell * columns;
        values.get(at..at + columns).unwrap_or_default().iter().map(|&value| i32::from(value)).sum::<i32>()
    };
    (0..rows).map(row).sum()
}
