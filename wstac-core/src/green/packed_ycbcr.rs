//! YUYV and UYVY: four bytes for two pixels, which share one chroma sample.

use super::GreenChannel;
use super::ycbcr::{Conversion, Exact};
use crate::frame::{Rows, Run, Stride};

/// The formats of cells of four bytes with luma at bytes `LUMA` and `LUMA` + 2; G = 255.
#[derive(Clone, Copy, Debug)]
pub struct PackedYcbcr<C, const LUMA: usize> {
    conversion: C,
}

/// The format YUYV: Y₀ Cb Y₁ Cr.
pub type Yuyv<C = Exact> = PackedYcbcr<C, 0>;
/// The format UYVY: Cb Y₀ Cr Y₁.
pub type Uyvy<C = Exact> = PackedYcbcr<C, 1>;

impl<C, const LUMA: usize> PackedYcbcr<C, LUMA> {
    /// Creates the format with this conversion to green.
    pub const fn new(conversion: C) -> Self {
        const { assert!(LUMA < 2) }
        Self { conversion }
    }
}

impl<C: Conversion, const LUMA: usize> GreenChannel for PackedYcbcr<C, LUMA> {
    type Sum = C::Sum;

    fn full_scale(&self) -> u32 {
        255
    }

    fn row_bytes(&self, width: u16) -> usize {
        4 * usize::from(width.div_ceil(2))
    }

    #[inline(always)]
    fn add_run(&self, sum: &mut C::Sum, rows: &Rows<'_>, run: Run) {
        let first = usize::from(run.x / 2);
        let end = (usize::from(run.x) + usize::from(run.width)).div_ceil(2);
        let cells = rows.row(run.y, 4 * first, 4 * (end - first)).as_chunks::<4>().0;
        let chroma = 1 - LUMA;
        let cells = cells.iter().map(|cell| [cell[LUMA], cell[LUMA + 2], cell[chroma], cell[chroma + 2]]);
        add_pairs(&self.conversion, sum, run, cells);
    }

    #[cfg(simd)]
    #[inline(always)]
    fn add_block(&self, sum: &mut C::Sum, rows: &Rows<'_>, run: Run, count: u16) {
        use super::simd::{self, Chroma};
        let parts = |first, cells| Some((rows.block(run.y, count, 4 * first, 4 * cells)?, Chroma::Within(LUMA)));
        if !simd::add_block(&self.conversion, sum, run, parts) {
            super::row_by_row(self, sum, rows, run, count);
        }
    }

    fn total(&self, sum: &C::Sum, pixels: u32) -> u32 {
        self.conversion.total(sum, pixels)
    }
}

/// Adds a run of pixels, of which each even one and the next share a chroma sample. `cells` are Y₀, Y₁, Cb, Cr of every
/// pair that the run touches.
#[inline(always)]
pub(super) fn add_pairs<C: Conversion>(
    conversion: &C,
    sum: &mut C::Sum,
    run: Run,
    mut cells: impl ExactSizeIterator<Item = [u8; 4]>,
) {
    let mut left = run.stride.counted(run.width);
    if run.stride != Stride::One {
        let mut column = run.x & 1;
        for [first, second, cb, cr] in cells {
            let chroma = conversion.chroma(cb, cr);
            while column < 2 && left > 0 {
                conversion.add(sum, if column == 0 { first } else { second }, chroma);
                column += run.stride.get();
                left -= 1;
            }
            column = column.wrapping_sub(2);
        }
        return;
    }
    if run.x & 1 == 1
        && let Some([_, second, cb, cr]) = cells.next()
    {
        conversion.add(sum, second, conversion.chroma(cb, cr));
        left = left.saturating_sub(1);
    }
    let mut gathered = C::Sum::default();
    core::mem::swap(sum, &mut gathered);
    for [first, second, cb, cr] in cells.by_ref().take(usize::from(left / 2)) {
        let chroma = conversion.chroma(cb, cr);
        conversion.add(&mut gathered, first, chroma);
        conversion.add(&mut gathered, second, chroma);
    }
    *sum = gathered;
    if left & 1 == 1
        && let Some([first, _, cb, cr]) = cells.next()
    {
        conversion.add(sum, first, conversion.chroma(cb, cr));
    }
}
