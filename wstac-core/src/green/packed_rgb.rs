//! RGB24, BGR24 and the 32-bit orders: the green byte of each pixel.

#[cfg(simd)]
use super::simd::Simd;
use super::{GreenChannel, sum_pixels};
use crate::frame::{Rows, Run};

/// The formats whose pixels have `BYTES` bytes, of which byte `GREEN` is green; G = 255.
#[derive(Clone, Copy, Debug, Default)]
pub struct PackedRgb<const BYTES: usize, const GREEN: usize>;

/// RGB24 and BGR24: three bytes per pixel, green in the middle.
pub type Rgb24 = PackedRgb<3, 1>;
/// R G B X and B G R X: four bytes per pixel, green second.
pub type Rgbx32 = PackedRgb<4, 1>;
/// X R G B and X B G R: four bytes per pixel, green third.
pub type Xrgb32 = PackedRgb<4, 2>;

impl<const BYTES: usize, const GREEN: usize> GreenChannel for PackedRgb<BYTES, GREEN> {
    type Sum = u32;

    fn full_scale(&self) -> u32 {
        255
    }

    fn row_bytes(&self, width: u16) -> usize {
        BYTES * usize::from(width)
    }

    #[inline(always)]
    fn add_run(&self, sum: &mut u32, rows: &Rows<'_>, run: Run) {
        const { assert!(GREEN < BYTES) }
        let bytes = rows.row(run.y, BYTES * usize::from(run.x), BYTES * usize::from(run.width));
        *sum += sum_pixels::<BYTES>(bytes, run.stride, |pixel| u32::from(pixel[GREEN]));
    }

    #[cfg(simd)]
    #[inline(always)]
    fn add_block(&self, sum: &mut u32, rows: &Rows<'_>, run: Run, count: u16) {
        let block = rows.block(run.y, count, BYTES * usize::from(run.x), BYTES * usize::from(run.width));
        match block.zip(Simd::get()).and_then(|(block, simd)| simd.sum::<BYTES, GREEN>(block)) {
            Some(green) => *sum += green,
            None => super::row_by_row(self, sum, rows, run, count),
        }
    }

    fn total(&self, sum: &u32, _pixels: u32) -> u32 {
        *sum
    }
}
