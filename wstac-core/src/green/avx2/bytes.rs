//! Sums one byte of each pixel: a mask selects it, and one instruction adds eight bytes.
//!
//! A frame of 1280 × 720 takes 26 % of the plain code's time for GREY and 22 % for RGB24 (one run on an AMD EPYC of
//! family 26, frame in the cache).
//! The checks of its loads cost GREY 1 % and nothing for RGB24.

use core::arch::x86_64::{__m256i, _mm256_add_epi64, _mm256_and_si256, _mm256_sad_epu8, _mm256_setzero_si256};

use super::{VECTOR, numbers, vector};
use crate::green::simd::{MASKS, Selected, Wide};

/// Rows that are summed at the same time, so that one row's cache lines arrive while another row is summed.
const ROWS: usize = 4;

/// Sums the bytes at `PLACE` of every `PERIOD` bytes of rows.
#[target_feature(enable = "avx2")]
pub(super) fn sum<const PERIOD: usize, const PLACE: usize>(wide: Wide<'_, VECTOR>) -> u32 {
    // The loop over vectors is written out for usual widths.
    match wide.before() {
        1 => of_vectors::<PERIOD, PLACE, 1>(wide),
        2 => of_vectors::<PERIOD, PLACE, 2>(wide),
        3 => of_vectors::<PERIOD, PLACE, 3>(wide),
        4 => of_vectors::<PERIOD, PLACE, 4>(wide),
        8 => of_vectors::<PERIOD, PLACE, 8>(wide),
        _ => of_vectors::<PERIOD, PLACE, 0>(wide),
    }
}

/// Sums a block of rows with `BEFORE` vectors before the last one, or with any number if `BEFORE` is 0.
#[inline]
#[target_feature(enable = "avx2")]
fn of_vectors<const PERIOD: usize, const PLACE: usize, const BEFORE: usize>(wide: Wide<'_, VECTOR>) -> u32 {
    let [first, second, third] = const { &Selected::<VECTOR, PERIOD, PLACE>::MASKS };
    let masks = [vector(first), vector(second), vector(third)];
    // A row ends at a multiple of the period, so its last vector starts as if at byte -32, which repeats byte 64.
    let tail = _mm256_and_si256(vector(&wide.tail()), masks[MASKS - 1]);
    let mut sums = [_mm256_setzero_si256(); ROWS];
    let (before, mut rows, count) = (wide.before(), wide.rows(), wide.block().rows());
    let mut row = || rows.vectors::<VECTOR, BEFORE>(before);
    for _ in 0..count / ROWS {
        let (Some(a), Some(b), Some(c), Some(d)) = (row(), row(), row(), row()) else { break };
        let mut turn = masks;
        for (((a, b), c), d) in a.0.iter().zip(b.0).zip(c.0).zip(d.0) {
            for (sum, bytes) in sums.iter_mut().zip([a, b, c, d]) {
                *sum = add(*sum, bytes, turn[0]);
            }
            turn = next::<PERIOD>(turn);
        }
        for (sum, bytes) in sums.iter_mut().zip([a.1, b.1, c.1, d.1]) {
            *sum = add(*sum, bytes, tail);
        }
    }
    for _ in 0..count % ROWS {
        let Some((whole, last)) = row() else { break };
        let mut turn = masks;
        for bytes in whole {
            sums[0] = add(sums[0], bytes, turn[0]);
            turn = next::<PERIOD>(turn);
        }
        sums[0] = add(sums[0], last, tail);
    }
    let [a, b, c, d] = sums;
    let [a, _, b, _, c, _, d, _] = numbers(_mm256_add_epi64(_mm256_add_epi64(a, b), _mm256_add_epi64(c, d)));
    // The sum is below 2^32, so the low halves of its 64-bit parts are enough.
    a.wrapping_add(b).wrapping_add(c).wrapping_add(d)
}

/// Returns the masks with that of the next vector first. Where vectors are whole periods, all masks are the same.
#[inline]
#[target_feature(enable = "avx2")]
fn next<const PERIOD: usize>([a, b, c]: [__m256i; MASKS]) -> [__m256i; MASKS] {
    if VECTOR.is_multiple_of(PERIOD) { [a, b, c] } else { [b, c, a] }
}

/// Adds the bytes that a mask selects to four 64-bit sums.
#[inline]
#[target_feature(enable = "avx2")]
fn add(sum: __m256i, bytes: &[u8; VECTOR], mask: __m256i) -> __m256i {
    _mm256_add_epi64(sum, _mm256_sad_epu8(_mm256_and_si256(vector(bytes), mask), _mm256_setzero_si256()))
}
