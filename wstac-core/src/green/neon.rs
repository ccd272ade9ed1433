//! NEON kernels: 16 bytes per instruction, on aarch64.
//!
//! Every aarch64 machine that the compiler builds for by default has NEON, so nothing is detected at run time.
//! The three loops are those of `avx2`, with the instructions that NEON has for them: pairwise addition into wider
//! lanes, and shifts that accumulate or narrow.
//!
//! Loads take arrays that slices have checked. The only unsafe code is the calls into these functions, and two casts
//! from arrays to vectors.
//!
//! The kernels are tested under an emulator, by `ci/crates aarch64`. Their speed has not yet been measured on real
//! hardware.
#![allow(unsafe_code)]

mod bytes;
mod exact;
mod places;

use core::arch::aarch64::{uint8x8_t, uint8x16_t};

use super::simd::{Cells, Factors, Places, Wide};
use crate::frame::Block;

/// Bytes of a vector.
const VECTOR: usize = 16;

/// Stands for a machine that has NEON: all that this code is compiled for.
#[derive(Clone, Copy, Debug)]
pub struct Simd(());

#[expect(clippy::unused_self, reason = "the value is the proof")]
impl Simd {
    pub(super) fn name(self) -> &'static str {
        "NEON"
    }

    /// Returns the proof. A program built with `--cfg wstac_plain` never does, so that both ways can be timed and
    /// tested.
    #[inline(always)]
    pub(super) fn get() -> Option<Self> {
        cfg!(not(wstac_plain)).then_some(Self(()))
    }

    /// Sums the bytes at `PLACE` of every `PERIOD` bytes of each row, or returns `None` if rows are narrower than a
    /// vector.
    ///
    /// Rows are whole periods of 1 to 4 bytes. The sum is below 2^32 if there are fewer than 2^24 bytes.
    #[inline(always)]
    pub(super) fn sum<const PERIOD: usize, const PLACE: usize>(self, block: Block<'_>) -> Option<u32> {
        const { assert!(PERIOD > 0 && PERIOD <= 4 && PLACE < PERIOD) }
        let wide = Wide::new(block)?;
        // SAFETY: the machine has NEON.
        Some(unsafe { bytes::sum::<PERIOD, PLACE>(wide) })
    }

    /// Sums bytes by their place in each group of four, or returns `None` if rows are too narrow or too wide.
    ///
    /// Rows are whole groups of four, or of two if both halves of a group mean the same.
    /// Each sum is below 2^32 if there are fewer than 2^24 bytes.
    #[inline(always)]
    pub(super) fn places(self, block: Block<'_>) -> Option<Places> {
        let wide = Wide::new(block).filter(|_| block.width() <= places::MOST_WIDTH)?;
        // SAFETY: the machine has NEON.
        Some(unsafe { places::sums(wide) })
    }

    /// Sums the green of cells, of which each row has at least [`LEAST_CELLS`](super::simd::LEAST_CELLS).
    #[inline(always)]
    pub(super) fn exact(self, cells: &Cells<'_>, factors: &Factors) -> u32 {
        // SAFETY: the machine has NEON.
        unsafe { exact::sum(cells, factors) }
    }
}

#[inline]
#[target_feature(enable = "neon")]
fn vector(bytes: &[u8; VECTOR]) -> uint8x16_t {
    // SAFETY: both types have 16 bytes, and any bits are valid in both.
    unsafe { core::mem::transmute(*bytes) }
}

#[inline]
#[target_feature(enable = "neon")]
fn half(bytes: [u8; VECTOR / 2]) -> uint8x8_t {
    // SAFETY: both types have 8 bytes, and any bits are valid in both.
    unsafe { core::mem::transmute(bytes) }
}
