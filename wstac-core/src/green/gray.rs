//! GREY: one byte per pixel, taken as green.

use super::{GreenChannel, byte_sums, sum_pixels};
use crate::frame::{Rows, Run};

/// The format GREY, with G = 255.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gray;

impl GreenChannel for Gray {
    type Sum = u32;

    fn full_scale(&self) -> u32 {
        255
    }

    fn row_bytes(&self, width: u16) -> usize {
        usize::from(width)
    }

    #[inline(always)]
    fn add_run(&self, sum: &mut u32, rows: &Rows<'_>, run: Run) {
        let bytes = rows.row(run.y, usize::from(run.x), usize::from(run.width));
        *sum += sum_pixels(bytes, run.stride, |&[value]| u32::from(value));
    }

    #[inline(always)]
    fn add_block(&self, sum: &mut u32, rows: &Rows<'_>, run: Run, count: u16) {
        if let Some(block) = rows.block(run.y, count, usize::from(run.x), usize::from(run.width)) {
            *sum += byte_sums::sum(block);
        }
    }

    fn total(&self, sum: &u32, _pixels: u32) -> u32 {
        *sum
    }
}
