//! NV12, YU12, YUV422P, YUV444P: a plane of luma, then chroma. They take whole frames.

use super::GreenChannel;
use super::packed_ycbcr::add_pairs;
#[cfg(simd)]
use super::simd::{self, Chroma, Shared};
use super::ycbcr::{Conversion, Exact};
use crate::frame::{Rows, Run};

/// The format NV12: luma, then rows of Cb Cr pairs for every 2 × 2 pixels. Both have the same bytes from row to row. G
/// = 255.
#[derive(Clone, Copy, Debug)]
pub struct Nv12<C = Exact> {
    conversion: C,
}

impl<C> Nv12<C> {
    /// Creates the format with this conversion to green.
    pub const fn new(conversion: C) -> Self {
        Self { conversion }
    }
}

impl<C: Conversion> GreenChannel for Nv12<C> {
    type Sum = C::Sum;

    fn full_scale(&self) -> u32 {
        255
    }

    fn row_bytes(&self, width: u16) -> usize {
        2 * usize::from(width.div_ceil(2))
    }

    fn chroma_bytes(&self, bytes_per_row: usize, rows: u16) -> Option<usize> {
        Some(bytes_per_row.saturating_mul(usize::from(rows.div_ceil(2))))
    }

    #[inline(always)]
    fn add_run(&self, sum: &mut C::Sum, rows: &Rows<'_>, run: Run) {
        let span = Span::of(run);
        let luma = rows.row(run.y, span.first, span.pixels);
        let chroma = rows.plane_row(0, rows.bytes_per_row(), run.y / 2, span.first, span.pixels);
        let cells = luma.as_chunks::<2>().0.iter().zip(chroma.as_chunks::<2>().0);
        add_pairs(&self.conversion, sum, run, cells.map(|(&[first, second], &[cb, cr])| [first, second, cb, cr]));
    }

    #[cfg(simd)]
    #[inline(always)]
    fn add_block(&self, sum: &mut C::Sum, rows: &Rows<'_>, run: Run, count: u16) {
        let parts = |first, cells| {
            let shared = Shared::new(run.y, 1);
            let luma = rows.block(run.y, count, 2 * first, 2 * cells)?;
            let (y, count) = (run.y >> 1, shared.rows(count));
            let pairs = rows.plane_block(0, rows.bytes_per_row(), (y, count), (2 * first, 2 * cells))?;
            Some((luma, Chroma::Pairs(pairs, shared)))
        };
        if !simd::add_block(&self.conversion, sum, run, parts) {
            super::row_by_row(self, sum, rows, run, count);
        }
    }

    fn total(&self, sum: &C::Sum, pixels: u32) -> u32 {
        self.conversion.total(sum, pixels)
    }
}

/// The formats of luma, then a plane of Cb, then one of Cr. One chroma sample is for two columns and `2^VERTICAL` rows.
/// Chroma rows take half of luma's bytes from row to row, rounded up. G = 255.
#[derive(Clone, Copy, Debug)]
pub struct PlanarPairs<C, const VERTICAL: u32> {
    conversion: C,
}

/// The format YU12 (I420): chroma for 2 × 2 pixels.
pub type Yu12<C = Exact> = PlanarPairs<C, 1>;
/// The format YUV422P: chroma for 2 × 1 pixels.
pub type Yuv422p<C = Exact> = PlanarPairs<C, 0>;

impl<C, const VERTICAL: u32> PlanarPairs<C, VERTICAL> {
    /// Creates the format with this conversion to green.
    pub const fn new(conversion: C) -> Self {
        Self { conversion }
    }
}

impl<C: Conversion, const VERTICAL: u32> GreenChannel for PlanarPairs<C, VERTICAL> {
    type Sum = C::Sum;

    fn full_scale(&self) -> u32 {
        255
    }

    fn row_bytes(&self, width: u16) -> usize {
        usize::from(width)
    }

    fn chroma_bytes(&self, bytes_per_row: usize, rows: u16) -> Option<usize> {
        Some(bytes_per_row.div_ceil(2).saturating_mul(2 * usize::from(rows.div_ceil(1 << VERTICAL))))
    }

    #[inline(always)]
    fn add_run(&self, sum: &mut C::Sum, rows: &Rows<'_>, run: Run) {
        let span = Span::of(run);
        let bytes_per_row = rows.bytes_per_row().div_ceil(2);
        let plane = bytes_per_row * usize::from(rows.height().div_ceil(1 << VERTICAL));
        let (y, first, cells) = (run.y >> VERTICAL, span.first / 2, span.pixels / 2);
        let cb = rows.plane_row(0, bytes_per_row, y, first, cells);
        let cr = rows.plane_row(plane, bytes_per_row, y, first, cells);
        // The last column of an odd width has no right neighbor. The value that is read in its place is not counted.
        let luma = rows.row_to_end(run.y, span.first);
        let pairs = (0..cb.len().min(cr.len())).map(|cell| {
            let at = |bytes: &[u8], index: usize| bytes.get(index).copied().unwrap_or(0);
            [at(luma, 2 * cell), at(luma, 2 * cell + 1), at(cb, cell), at(cr, cell)]
        });
        add_pairs(&self.conversion, sum, run, pairs);
    }

    #[cfg(simd)]
    #[inline(always)]
    fn add_block(&self, sum: &mut C::Sum, rows: &Rows<'_>, run: Run, count: u16) {
        let parts = |first, cells| {
            let shared = Shared::new(run.y, VERTICAL);
            let luma = rows.block(run.y, count, 2 * first, 2 * cells)?;
            let (y, count) = (run.y >> VERTICAL, shared.rows(count));
            let bytes_per_row = rows.bytes_per_row().div_ceil(2);
            let plane = bytes_per_row * usize::from(rows.height().div_ceil(1 << VERTICAL));
            let cb = rows.plane_block(0, bytes_per_row, (y, count), (first, cells))?;
            let cr = rows.plane_block(plane, bytes_per_row, (y, count), (first, cells))?;
            Some((luma, Chroma::Planes([cb, cr], shared)))
        };
        if !simd::add_block(&self.conversion, sum, run, parts) {
            super::row_by_row(self, sum, rows, run, count);
        }
    }

    fn total(&self, sum: &C::Sum, pixels: u32) -> u32 {
        self.conversion.total(sum, pixels)
    }
}

/// The format YUV444P: luma, Cb and Cr planes of the same size; G = 255.
#[derive(Clone, Copy, Debug)]
pub struct Yuv444p<C = Exact> {
    conversion: C,
}

impl<C> Yuv444p<C> {
    /// Creates the format with this conversion to green.
    pub const fn new(conversion: C) -> Self {
        Self { conversion }
    }
}

impl<C: Conversion> GreenChannel for Yuv444p<C> {
    type Sum = C::Sum;

    fn full_scale(&self) -> u32 {
        255
    }

    fn row_bytes(&self, width: u16) -> usize {
        usize::from(width)
    }

    fn chroma_bytes(&self, bytes_per_row: usize, rows: u16) -> Option<usize> {
        Some(bytes_per_row.saturating_mul(2 * usize::from(rows)))
    }

    #[inline(always)]
    fn add_run(&self, sum: &mut C::Sum, rows: &Rows<'_>, run: Run) {
        let (x, width, bytes_per_row) = (usize::from(run.x), usize::from(run.width), rows.bytes_per_row());
        let luma = rows.row(run.y, x, width);
        let cb = rows.plane_row(0, bytes_per_row, run.y, x, width);
        let cr = rows.plane_row(rows.luma_bytes(), bytes_per_row, run.y, x, width);
        for ((&y, &cb), &cr) in luma.iter().zip(cb).zip(cr).step_by(usize::from(run.stride.get())) {
            self.conversion.add(sum, y, self.conversion.chroma(cb, cr));
        }
    }

    fn total(&self, sum: &C::Sum, pixels: u32) -> u32 {
        self.conversion.total(sum, pixels)
    }
}

/// The pairs of columns that a run touches.
struct Span {
    /// The first column of the first pair.
    first: usize,
    /// The number of columns of all pairs, which is even.
    pixels: usize,
}

impl Span {
    fn of(run: Run) -> Self {
        let first = usize::from(run.x & !1);
        let end = (usize::from(run.x) + usize::from(run.width)).next_multiple_of(2);
        Self { first, pixels: end - first }
    }
}
