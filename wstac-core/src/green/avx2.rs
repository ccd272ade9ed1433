//! AVX2 kernels: 32 bytes per instruction, on x86-64 machines that have it. One kernel also uses AVX-512.
//!
//! A program for x86-64 is compiled for the instructions that all such machines have: 16 bytes at a time, and no 32-bit
//! multiplication.
//! Compiling the plain code for AVX2 does not help much, because compilers gather the same byte of many pixels one by
//! one.
//! So the three loops are written with intrinsics.
//!
//! The only unsafe code is the calls into these functions, which need a machine with AVX2, and three casts between
//! arrays and vectors.
//! Loads take arrays that slices have checked.
#![allow(unsafe_code)]

mod bytes;
mod exact;
mod places;

use core::arch::x86_64::{__m128i, __m256i, _MM_HINT_T0, _mm_prefetch};

use super::simd::{AHEAD, Cells, Factors, Places, Wide};
use crate::frame::Block;

cpufeatures::new!(avx2, "avx2");
cpufeatures::new!(avx512, "avx512bw");

/// Bytes of a vector.
const VECTOR: usize = 32;

/// Proves that the machine has AVX2.
#[derive(Clone, Copy, Debug)]
pub struct Simd {
    /// Whether it has AVX-512 as well, which the `exact` kernel uses.
    avx512: bool,
}

#[expect(clippy::unused_self, reason = "the value is the proof")]
impl Simd {
    pub(super) fn name(self) -> &'static str {
        if self.avx512 { "AVX-512" } else { "AVX2" }
    }

    /// Returns the proof if the machine has AVX2. A program built with `--cfg wstac_plain` never does, so that both
    /// ways can be timed and tested.
    #[inline(always)]
    pub(super) fn get() -> Option<Self> {
        #[cfg(test)]
        let allowed = !super::simd::tests::NARROW.get();
        #[cfg(not(test))]
        let allowed = true;
        (cfg!(not(wstac_plain)) && avx2::get()).then(|| Self { avx512: allowed && avx512::get() })
    }

    /// Sums the bytes at `PLACE` of every `PERIOD` bytes of each row, or returns `None` if rows are narrower than a
    /// vector.
    ///
    /// Rows are whole periods of 1 to 4 bytes. The sum is below 2^32 if there are fewer than 2^24 bytes.
    #[inline(always)]
    pub(super) fn sum<const PERIOD: usize, const PLACE: usize>(self, block: Block<'_>) -> Option<u32> {
        const { assert!(PERIOD > 0 && PERIOD <= 4 && PLACE < PERIOD) }
        let wide = Wide::new(block)?;
        // SAFETY: the machine has AVX2.
        Some(unsafe { bytes::sum::<PERIOD, PLACE>(wide) })
    }

    /// Sums bytes by their place in each group of four, or returns `None` if rows are too narrow or too wide.
    ///
    /// Rows are whole groups of four, or of two if both halves of a group mean the same.
    /// Each sum is below 2^32 if there are fewer than 2^24 bytes.
    #[inline(always)]
    pub(super) fn places(self, block: Block<'_>) -> Option<Places> {
        let wide = Wide::new(block).filter(|_| block.width() <= places::MOST_WIDTH)?;
        // SAFETY: the machine has AVX2.
        Some(unsafe { places::sums(wide) })
    }

    /// Sums the green of cells, of which each row has at least [`LEAST_CELLS`](super::simd::LEAST_CELLS).
    #[inline(always)]
    pub(super) fn exact(self, cells: &Cells<'_>, factors: &Factors) -> u32 {
        if self.avx512 && cells.in_row() >= exact::wide::CELLS {
            // SAFETY: the machine has AVX-512.
            return unsafe { exact::wide::sum(cells, factors) };
        }
        // SAFETY: the machine has AVX2.
        unsafe { exact::narrow::sum(cells, factors) }
    }
}

#[inline]
#[target_feature(enable = "avx2")]
fn vector(bytes: &[u8; VECTOR]) -> __m256i {
    // SAFETY: both types have 32 bytes, and any bits are valid in both.
    unsafe { core::mem::transmute(*bytes) }
}

#[inline]
#[target_feature(enable = "avx2")]
fn half(bytes: &[u8; VECTOR / 2]) -> __m128i {
    // SAFETY: both types have 16 bytes, and any bits are valid in both.
    unsafe { core::mem::transmute(*bytes) }
}

/// Returns the eight 32-bit numbers of a vector.
#[inline]
#[target_feature(enable = "avx2")]
fn numbers(vector: __m256i) -> [u32; 8] {
    // SAFETY: both types have 32 bytes, and any bits are valid in both.
    unsafe { core::mem::transmute(vector) }
}

/// Requests the cache lines of the row of `block` that is [`AHEAD`] rows below the row that ends with these bytes:
/// those of the first of
/// `bytes` bytes and of every 64th from there, and that of the row's last byte.
///
/// The memory need not be there.
#[inline]
#[target_feature(enable = "avx2")]
fn prefetch(last: &[u8], block: Block<'_>, bytes: usize) {
    let behind = last.as_ptr_range().end.wrapping_add(AHEAD * block.bytes_per_row());
    let first = behind.wrapping_sub(block.width());
    let mut line = 0;
    while line < bytes {
        _mm_prefetch::<_MM_HINT_T0>(first.wrapping_add(line).cast());
        line += 64;
    }
    _mm_prefetch::<_MM_HINT_T0>(behind.wrapping_sub(1).cast());
}
