//! GREY: one byte per pixel, taken as green.

use super::{GreenChannel, byte_sums, sum_pixels};
#[cfg(dsp)]
use crate::frame::Blocks;
use crate::frame::{Rows, Run};
#[cfg(dsp)]
use crate::params::COLUMNS;

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

    #[cfg(dsp)]
    #[inline(always)]
    fn add_blocks(&self, sums: &mut [u32; COLUMNS], blocks: Blocks<'_>) -> bool {
        byte_sums::SideBySide::new(&blocks).map(|side_by_side| side_by_side.add_to(sums)).is_some()
    }

    fn total(&self, sum: &u32, _pixels: u32) -> u32 {
        *sum
    }
}
