//! Vector kernels for hosts: AVX2 and AVX-512 on x86-64, and NEON on aarch64.
//!
//! The loops of most pixel formats come down to three kernels:
//!
//! | kernel | sums | formats |
//! | --- | --- | --- |
//! | `bytes` | one byte of each pixel | GREY, RGB24, 32-bit RGB, luma and chroma planes |
//! | `places` | bytes by their place in each group of four | Y16, `linear` YUYV, UYVY and NV12 |
//! | `exact` | green of every pixel, rounded and clamped | `exact` YUYV, UYVY, NV12, YU12 and YUV422P |
//!
//! Each format keeps its plain code, which other machines run and which every kernel is tested to equal (`vs_scalar`).
//! On x86-64, AVX2 and AVX-512 are detected when the first frame arrives. Every aarch64 machine has NEON, so the
//! compiler decides.
//! `docs/SIGNAL.md` has the measured gain on a whole frame.

pub(super) mod cells;
mod factors;
#[cfg(test)]
pub(super) mod tests;
#[cfg(test)]
mod vs_scalar;

use crate::frame::Block;
pub(super) use cells::add_block;
pub(super) use cells::{Cells, Chroma, Shared};
pub(super) use factors::Factors;

#[cfg(target_arch = "x86_64")]
pub(super) use super::avx2::Simd;
#[cfg(target_arch = "aarch64")]
pub(super) use super::neon::Simd;

/// Rows between the row that is summed and the row whose cache lines are requested.
#[cfg(target_arch = "x86_64")]
pub(super) const AHEAD: usize = 8;

/// Cells that the `exact` kernels take at once, and so those of the narrowest row.
pub(super) const LEAST_CELLS: usize = 8;

/// The number of bytes whose sum always fits 16 bits.
pub(super) const ROOM: usize = 257;

/// Sums of bytes by their place in each group of four.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places {
    /// Sums over all bytes of the rows.
    pub(super) all: [u32; 4],
    /// Sums over the first four bytes of each row.
    pub(super) first: [u32; 4],
    /// Sums over the last four bytes of each row.
    pub(super) last: [u32; 4],
}

/// Vectors after which the bytes of any period repeat.
pub(super) const MASKS: usize = 3;

/// Selects the bytes at `PLACE` of every `PERIOD` in vectors of `N` bytes.
pub(super) struct Selected<const N: usize, const PERIOD: usize, const PLACE: usize>;

impl<const N: usize, const PERIOD: usize, const PLACE: usize> Selected<N, PERIOD, PLACE> {
    /// Masks of the first three vectors of a row. Later vectors repeat them.
    pub(super) const MASKS: [[u8; N]; MASKS] = {
        let mut masks = [[0; N]; MASKS];
        let mut at = PLACE;
        while at < N * MASKS {
            masks[at / N][at % N] = u8::MAX;
            at += PERIOD;
        }
        masks
    };
}

/// A block whose rows are at least one vector of `N` bytes wide.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wide<'a, const N: usize>(Block<'a>);

impl<'a, const N: usize> Wide<'a, N> {
    /// Returns the block, or `None` if it is narrower than a vector.
    #[inline(always)]
    pub(super) fn new(block: Block<'a>) -> Option<Self> {
        (block.width() >= N).then_some(Self(block))
    }

    #[inline(always)]
    pub(super) fn block(self) -> Block<'a> {
        self.0
    }

    /// Returns the number of vectors before the last one of a row.
    #[inline(always)]
    pub(super) fn before(self) -> usize {
        (self.0.width() - 1) / N
    }

    #[inline(always)]
    pub(super) fn rows(self) -> BlockRows<'a> {
        BlockRows::new(self.0)
    }

    /// Returns a mask of the bytes of the last vector that the vector before it does not have.
    #[inline(always)]
    pub(super) fn tail(self) -> [u8; N] {
        // In bytes, of which the compiler makes vectors.
        let old = (N - 1 - (self.0.width() - 1) % N) as u8;
        core::array::from_fn(|index| if (index as u8) < old { 0 } else { u8::MAX })
    }
}

/// The rows of a block, one after the other. All of its code is inlined, so that kernels keep their vectors in
/// registers.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockRows<'a> {
    /// The bytes from the next row on.
    rest: &'a [u8],
    bytes_per_row: usize,
    width: usize,
}

impl<'a> BlockRows<'a> {
    #[inline(always)]
    pub(super) fn new(block: Block<'a>) -> Self {
        Self { rest: block.bytes(), bytes_per_row: block.bytes_per_row(), width: block.width() }
    }

    #[inline(always)]
    pub(super) fn next(&mut self) -> Option<&'a [u8]> {
        let row = self.rest.get(..self.width)?;
        self.rest = self.rest.get(self.bytes_per_row..).unwrap_or_default();
        Some(row)
    }

    /// Returns the next row as vectors of `N` bytes: `BEFORE` of them, or `before` if that is 0, and the last vector.
    ///
    /// The last vector ends with the row. It repeats bytes of the vector before it unless the row is whole vectors.
    #[inline(always)]
    pub(super) fn vectors<const N: usize, const BEFORE: usize>(
        &mut self,
        before: usize,
    ) -> Option<(&'a [[u8; N]], &'a [u8; N])> {
        let row = self.next()?;
        let whole = row.as_chunks().0;
        let whole = if BEFORE == 0 { whole.get(..before)? } else { whole.first_chunk::<BEFORE>()? };
        Some((whole, row.last_chunk()?))
    }
}
