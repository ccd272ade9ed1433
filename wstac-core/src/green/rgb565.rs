//! RGB565: 16-bit little-endian words with 6 bits of green, widened to 8.

use super::{GreenChannel, sum_pixels};
use crate::frame::{Rows, Run};

/// The format RGB565, with G = 255.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rgb565;

impl GreenChannel for Rgb565 {
    type Sum = u32;

    fn full_scale(&self) -> u32 {
        255
    }

    fn row_bytes(&self, width: u16) -> usize {
        2 * usize::from(width)
    }

    #[inline(always)]
    fn add_run(&self, sum: &mut u32, rows: &Rows<'_>, run: Run) {
        let bytes = rows.row(run.y, 2 * usize::from(run.x), 2 * usize::from(run.width));
        *sum += sum_pixels(bytes, run.stride, |&word| {
            let green = u32::from(u16::from_le_bytes(word)) >> 5 & 0x3F;
            green << 2 | green >> 4
        });
    }

    fn total(&self, sum: &u32, _pixels: u32) -> u32 {
        *sum
    }
}
