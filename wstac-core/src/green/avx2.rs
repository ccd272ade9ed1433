//! AVX2, 32 bytes an instruction, where the machine that the program runs on has it: found out when the first frame comes.
//!
//! A program for x86-64 is compiled for what all such machines have, 16 bytes at a time and no multiplication of 32 bits. Allowing AVX2 alone
//! does not help much: compilers gather the same byte of many pixels one by one. So the three loops that formats come down to are written out:
//! `bytes`, `places`, `exact`.
//!
//! What they gain is in `docs/SIGNAL.md`: the same built with and without, beside a plain read of the same bytes, by `ci/bench`.
//!
//! All are tested to give the sums of the plain ways, which other machines take.
#![allow(unsafe_code)]

#[cfg(test)]
mod beside;
mod bytes;
mod exact;
mod pairs;
mod places;
#[cfg(test)]
mod tests;

use core::arch::x86_64::{__m256i, _MM_HINT_T0, _mm_prefetch, _mm256_loadu_si256, _mm256_storeu_si256};

use crate::frame::Block;
pub(super) use exact::Factors;
pub(super) use pairs::add_block;
pub use pairs::{Cells, Chroma, Shared};
pub(super) use places::Places;

cpufeatures::new!(avx2, "avx2");

/// Bytes of a vector.
const VECTOR: usize = 32;

/// Rows ahead of the one that is summed whose cache lines are asked for.
const AHEAD: usize = 8;

/// The proof that the machine has AVX2.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

#[expect(clippy::unused_self, reason = "it is the proof")]
impl Avx2 {
    /// The proof, if the machine has it. A program built with `--cfg wstac_plain` takes the plain ways everywhere, so that both can be timed
    /// and tested.
    #[inline(always)]
    pub(super) fn get() -> Option<Self> {
        (cfg!(not(wstac_plain)) && avx2::get()).then_some(Self(()))
    }

    /// The sum of the bytes at `PLACE` of every `PERIOD` bytes of a row, 1 to 4; rows are whole periods. Nothing where they are narrower than a
    /// vector. Below 2^32 if there are fewer than 2^24 bytes.
    #[inline(always)]
    pub(super) fn sum<const PERIOD: usize, const PLACE: usize>(self, block: Block<'_>) -> Option<u32> {
        const { assert!(PERIOD > 0 && PERIOD <= 4 && PLACE < PERIOD) }
        let wide = Wide::new(block)?;
        // SAFETY: the machine has AVX2.
        Some(unsafe { bytes::sum::<PERIOD, PLACE>(wide) })
    }

    /// The sums of the bytes at each place of every four bytes of a row; rows are whole fours, or pairs whose places mean the same. Nothing where
    /// they are narrower than a vector, or too wide. Below 2^32 if there are fewer than 2^24 bytes.
    #[inline(always)]
    pub(super) fn places(self, block: Block<'_>) -> Option<Places> {
        let wide = Wide::new(block).filter(|_| block.width() <= places::MOST_WIDTH)?;
        // SAFETY: the machine has AVX2.
        Some(unsafe { places::sums(wide) })
    }

    /// The sum of the green of cells, 8 of them a row at least.
    #[inline(always)]
    pub(super) fn exact(self, cells: &Cells<'_>, factors: &Factors) -> u32 {
        // SAFETY: the machine has AVX2.
        unsafe { exact::sum(cells, factors) }
    }
}

/// A block that is a vector wide at least.
#[derive(Clone, Copy)]
struct Wide<'a>(Block<'a>);

impl<'a> Wide<'a> {
    #[inline(always)]
    fn new(block: Block<'a>) -> Option<Self> {
        (block.width() >= VECTOR).then_some(Self(block))
    }

    /// How many vectors come before the last one of a row.
    fn before(self) -> usize {
        (self.0.width() - 1) / VECTOR
    }

    /// Where the last vector of a row starts: it ends with the row, and may have bytes of the one before.
    fn last(self) -> usize {
        self.0.width() - VECTOR
    }

    /// Which bytes of the last vector are not in the one before.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn tail(self) -> __m256i {
        const BYTES: [u8; 2 * VECTOR] = {
            let mut bytes = [0; 2 * VECTOR];
            let mut at = VECTOR;
            while at < bytes.len() {
                bytes[at] = u8::MAX;
                at += 1;
            }
            bytes
        };
        let new = (self.0.width() - 1) % VECTOR + 1;
        vector(BYTES.get(new..).and_then(<[u8]>::first_chunk).unwrap_or(&[0; VECTOR]))
    }
}

/// The vector at `at`.
///
/// # Safety
/// 32 bytes can be read there.
#[inline]
#[target_feature(enable = "avx2")]
unsafe fn load(at: *const u8) -> __m256i {
    // SAFETY: as the caller promises.
    unsafe { _mm256_loadu_si256(at.cast()) }
}

/// Asks for the cache lines of the first of so many bytes and of every 64th from there.
#[inline]
#[target_feature(enable = "avx2")]
fn prefetch(at: *const u8, bytes: usize) {
    let mut line = 0;
    while line < bytes {
        _mm_prefetch::<_MM_HINT_T0>(at.wrapping_add(line).cast());
        line += 64;
    }
}

/// A vector of these bytes.
#[inline]
#[target_feature(enable = "avx2")]
fn vector(bytes: &[u8; VECTOR]) -> __m256i {
    // SAFETY: so many bytes are there.
    unsafe { load(bytes.as_ptr()) }
}

/// The four 64-bit numbers of a vector.
#[inline]
#[target_feature(enable = "avx2")]
fn quads(vector: __m256i) -> [u64; 4] {
    let mut quads = [0; 4];
    // SAFETY: there is room for 32 bytes.
    unsafe { _mm256_storeu_si256(quads.as_mut_ptr().cast(), vector) };
    quads
}
