//! Y10, Y12, Y16: one little-endian 16-bit word per pixel, taken as green.

#[cfg(simd)]
use super::simd::{Places, Simd};
use super::{GreenChannel, full_scale, saturated_word, sum_pixels};
use crate::frame::{Rows, Run};

/// The formats of words of `BITS` significant bits, with G = 2^BITS − 1. A word above G (from a driver that sets
/// padding bits) counts as G.
#[derive(Clone, Copy, Debug, Default)]
pub struct Words<const BITS: u32>;

/// The format Y10, with G = 1023.
pub type Y10 = Words<10>;
/// The format Y12, with G = 4095.
pub type Y12 = Words<12>;
/// The format Y16, with G = 65535.
pub type Y16 = Words<16>;

impl<const BITS: u32> GreenChannel for Words<BITS> {
    type Sum = u32;

    fn full_scale(&self) -> u32 {
        full_scale(BITS)
    }

    fn row_bytes(&self, width: u16) -> usize {
        2 * usize::from(width)
    }

    #[inline(always)]
    fn add_run(&self, sum: &mut u32, rows: &Rows<'_>, run: Run) {
        let bytes = rows.row(run.y, 2 * usize::from(run.x), 2 * usize::from(run.width));
        *sum += sum_pixels(bytes, run.stride, |&word| saturated_word::<BITS>(word));
    }

    #[cfg(simd)]
    #[inline(always)]
    fn add_block(&self, sum: &mut u32, rows: &Rows<'_>, run: Run, count: u16) {
        let block = rows.block(run.y, count, 2 * usize::from(run.x), 2 * usize::from(run.width));
        // With 16 bits no word is above full scale.
        match block.filter(|_| BITS == 16).zip(Simd::get()).and_then(|(block, simd)| simd.places(block)) {
            Some(Places { all: [a, b, c, d], .. }) => *sum += a + c + ((b + d) << 8),
            None => super::row_by_row(self, sum, rows, run, count),
        }
    }

    fn total(&self, sum: &u32, _pixels: u32) -> u32 {
        *sum
    }
}
