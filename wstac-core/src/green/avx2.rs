//! AVX2, 32 bytes an instruction, where the machine that the program runs on has it: found out when the first frame comes.
//!
//! A program for x86-64 is compiled for what all such machines have, 16 bytes at a time and no multiplication of 32 bits. Allowing AVX2 alone does not help
//! much: compilers gather the same byte of many pixels one by one. So the three loops that formats come down to are written out: `bytes`, `places`, `exact`.
//! Microseconds from a frame of 1280 × 720, 202,500 pixels under taxels, to its features, on one core of an AMD EPYC 7003
//! (`docs/SIGNAL.md` has these beside a plain read of the same bytes):
//!
//! | | plain | here |
//! | --- | ---: | ---: |
//! | GREY | 23 | 4.1 |
//! | YUYV `Linear` | 105 | 8.7 |
//! | YUYV `Exact` | 377 | 38 |
//! | RGB24 | 61 | 15 |
//! | Y16 | 27 | 8.4 |
//!
//! All are tested to give the sums of the plain ways, which other machines take.
#![allow(unsafe_code)]

mod bytes;
mod exact;
mod pairs;
mod places;

use core::arch::x86_64::{__m256i, _MM_HINT_T0, _mm_prefetch, _mm256_loadu_si256, _mm256_storeu_si256};

use crate::frame::Block;
pub(super) use exact::Factors;
pub(super) use pairs::add_block;
pub use pairs::{Cells, Chroma, Shared};
pub(super) use places::Places;

cpufeatures::new!(avx2, "avx2");

/// Bytes of a vector.
const VECTOR: usize = 32;

/// Rows ahead of the one that is summed whose lines are asked for: of YUYV `Linear`, a fifth less time.
const AHEAD: usize = 8;

/// The proof that the machine has AVX2.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

#[expect(clippy::unused_self, reason = "it is the proof")]
impl Avx2 {
    /// The proof, if the machine has it.
    #[inline(always)]
    pub(super) fn get() -> Option<Self> {
        avx2::get().then_some(Self(()))
    }

    /// The sum of the bytes at `PLACE` of every `PERIOD` bytes of a row, 1 to 4; rows are whole periods. Nothing where they are narrower than a vector. Below
    /// 2^32 if there are fewer than 2^24 bytes.
    #[inline(always)]
    pub(super) fn sum<const PERIOD: usize, const PLACE: usize>(self, block: Block<'_>) -> Option<u32> {
        const { assert!(PERIOD > 0 && PERIOD <= 4 && PLACE < PERIOD) }
        let wide = Wide::new(block)?;
        // SAFETY: the machine has AVX2.
        Some(unsafe { bytes::sum::<PERIOD, PLACE>(wide) })
    }

    /// The sums of the bytes at each place of every four bytes of a row; rows are whole fours, or pairs whose places mean the same. Nothing where they
    /// are narrower than a vector, or too wide. Below 2^32 if there are fewer than 2^24 bytes.
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

/// Asks for the lines of so many bytes.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::green::ycbcr::{Colour, Conversion, Exact, Matrix, Range};
    use std::vec::Vec;

    /// Bytes that are often the highest, and a width, rows and bytes from row to row: some beyond what 16 bits hold the sums of.
    fn blocks() -> impl Iterator<Item = (Vec<u8>, usize, usize, usize)> {
        let mut seed = 1_u32;
        let mut next = move |below: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((u64::from(seed) * u64::from(below)) >> 32) as usize
        };
        (0..1_500).map(move |turn| {
            let width = VECTOR + next(if turn % 50 == 0 { 9_000 } else { 300 });
            let rows = 1 + next(if turn % 50 == 1 { 700 } else { 60 });
            let pitch = width + next(9);
            let most = if turn % 3 == 0 { 1 } else { 256 };
            let bytes = (0..(rows - 1) * pitch + width).map(|_| 255 - next(most) as u8).collect();
            (bytes, pitch, width, rows)
        })
    }

    fn plain(block: Block<'_>, period: usize, place: usize) -> u32 {
        block.each_row().flat_map(|row| row.iter().skip(place).step_by(period)).map(|&byte| u32::from(byte)).sum()
    }

    #[test]
    fn sums_are_the_plain_ones() {
        let Some(avx2) = Avx2::get() else { return };
        for (bytes, pitch, width, rows) in blocks() {
            let block = |period| Block::new(&bytes, pitch, width / period * period, rows).unwrap();
            assert_eq!(avx2.sum::<1, 0>(block(1)), Some(plain(block(1), 1, 0)), "{width} bytes in {rows} rows");
            if width < 2 * VECTOR {
                continue;
            }
            assert_eq!(avx2.sum::<3, 1>(block(3)), Some(plain(block(3), 3, 1)), "{width} bytes in {rows} rows");
            assert_eq!(avx2.sum::<4, 2>(block(4)), Some(plain(block(4), 4, 2)), "{width} bytes in {rows} rows");
            let Some(places) = avx2.places(block(4)) else {
                assert!(width > places::MOST_WIDTH);
                continue;
            };
            for place in 0..4 {
                assert_eq!(places.all[place], plain(block(4), 4, place), "{width} bytes in {rows} rows");
                let ends = |at: usize| block(4).each_row().map(|row| u32::from(row[at])).sum::<u32>();
                assert_eq!(places.first[place], ends(place));
                assert_eq!(places.last[place], ends(block(4).width() - 4 + place));
            }
        }
    }

    #[test]
    fn exact_green_is_that_of_the_plain_way_for_all_2_to_the_24_triples() {
        let Some(avx2) = Avx2::get() else { return };
        for matrix in [Matrix::Bt601, Matrix::Bt709] {
            for range in [Range::Limited, Range::Full] {
                let exact = Exact::new(Colour { matrix, range });
                for chroma in 0..=u16::MAX {
                    let [cb, cr] = chroma.to_le_bytes();
                    // Sixteen at a time: an offset that is off by one, or a quotient that is too large, cannot cancel out.
                    for first in (0..=255).step_by(16) {
                        let bytes: [_; exact::CELLS] = core::array::from_fn(|cell| {
                            let y = first + 2 * cell as u8;
                            [y, cb, y + 1, cr]
                        });
                        let luma = Block::new(bytes.as_flattened(), VECTOR, VECTOR, 1).unwrap();
                        let cells = Cells { luma, chroma: Chroma::Within(0), beside: [0, 0] };
                        let (mut sum, mut one) = (0, 0);
                        assert!(exact.add_cells(&mut sum, &cells, avx2));
                        (first..=first + 15).for_each(|y| exact.add(&mut one, y, exact.chroma(cb, cr)));
                        assert_eq!(sum, one, "{matrix:?} {range:?} {first} {cb} {cr}");
                    }
                }
            }
        }
    }
}
