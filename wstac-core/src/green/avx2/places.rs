//! Sums of bytes by their place among four: of 16-bit words the words themselves are added up in 16 bits, carries lost, and their high bytes;
//! what the total has more are the low bytes. That is three instructions for 32 bytes. The first four bytes of the rows and the last four are
//! summed by themselves, too: of a cell of which one pixel counts.

use core::arch::x86_64::{
    __m256i, _mm256_add_epi16, _mm256_add_epi32, _mm256_and_si256, _mm256_blend_epi32, _mm256_hadd_epi32,
    _mm256_set1_epi32, _mm256_setzero_si256, _mm256_slli_epi16, _mm256_srli_epi16, _mm256_srli_epi32,
    _mm256_storeu_si256, _mm256_sub_epi16,
};

use super::{AHEAD, VECTOR, Wide, load, prefetch};

/// Additions of bytes that 16 bits have room for.
const ROOM: usize = 257;
/// Bytes of which a row's fit.
pub(super) const MOST_WIDTH: usize = VECTOR * ROOM;

/// Sums by place.
#[derive(Clone, Copy)]
pub(in crate::green) struct Places {
    /// Of all of the rows.
    pub(in crate::green) all: [u32; 4],
    /// Of their first four bytes.
    pub(in crate::green) first: [u32; 4],
    /// Of their last four.
    pub(in crate::green) last: [u32; 4],
}

/// The sums of a block, which is no wider than [`MOST_WIDTH`].
#[target_feature(enable = "avx2")]
pub(super) fn sums(wide: Wide<'_>) -> Places {
    // Of rows of usual widths the loop over vectors is written out.
    match wide.before() {
        2 => of_vectors::<2>(wide),
        3 => of_vectors::<3>(wide),
        4 => of_vectors::<4>(wide),
        5 => of_vectors::<5>(wide),
        6 => of_vectors::<6>(wide),
        7 => of_vectors::<7>(wide),
        8 => of_vectors::<8>(wide),
        _ => of_vectors::<0>(wide),
    }
}

/// The same, with `BEFORE` vectors before the last one of a row; any number if it is 0.
#[inline]
#[target_feature(enable = "avx2")]
fn of_vectors<const BEFORE: usize>(wide: Wide<'_>) -> Places {
    let before = if BEFORE == 0 { wide.before() } else { BEFORE };
    let (last, tail) = (wide.last(), wide.tail());
    let (mut lanes, mut ends) = (Lanes::new(), Lanes::new());
    let (mut sums, mut end_sums) = ([_mm256_setzero_si256(); 4], [_mm256_setzero_si256(); 4]);
    let mut room = ROOM;
    let mut row = wide.0.bytes().as_ptr();
    for _ in 0..wide.0.rows() {
        if room <= before {
            lanes.move_to(&mut sums);
            ends.move_to(&mut end_sums);
            room = ROOM;
        }
        room -= before + 1;
        let ahead = row.wrapping_add(AHEAD * wide.0.bytes_per_row());
        prefetch(ahead, VECTOR * before + 1);
        prefetch(ahead.wrapping_add(wide.0.width() - 1), 1);
        for index in 0..before {
            // SAFETY: a block has as many rows, each with whole vectors up to there.
            lanes.add(unsafe { load(row.wrapping_add(VECTOR * index)) });
        }
        // SAFETY: these are the first and the last bytes of a row, which is a vector wide at least.
        let (first, last) = unsafe { (load(row), load(row.wrapping_add(last))) };
        lanes.add(_mm256_and_si256(last, tail));
        ends.add(_mm256_blend_epi32::<0xF0>(first, last));
        row = row.wrapping_add(wide.0.bytes_per_row());
    }
    lanes.move_to(&mut sums);
    ends.move_to(&mut end_sums);
    let [a, b, c, d] = sums;
    let fours = _mm256_hadd_epi32(_mm256_hadd_epi32(a, b), _mm256_hadd_epi32(c, d));
    let [e, f, g, h, i, j, k, l] = numbers(fours);
    let all = [e.wrapping_add(i), f.wrapping_add(j), g.wrapping_add(k), h.wrapping_add(l)];
    let [a, b, c, d] = end_sums.map(|sum| numbers(sum));
    Places { all, first: [a[0], b[0], c[0], d[0]], last: [a[7], b[7], c[7], d[7]] }
}

/// The eight 32-bit numbers of a vector.
#[inline]
#[target_feature(enable = "avx2")]
fn numbers(vector: __m256i) -> [u32; 8] {
    let mut numbers = [0; 8];
    // SAFETY: there is room for 32 bytes.
    unsafe { _mm256_storeu_si256(numbers.as_mut_ptr().cast(), vector) };
    numbers
}

/// Sums of words and of their high bytes, modulo 2^16.
#[derive(Clone, Copy)]
struct Lanes {
    total: __m256i,
    high: __m256i,
}

impl Lanes {
    #[inline]
    #[target_feature(enable = "avx2")]
    fn new() -> Self {
        Self { total: _mm256_setzero_si256(), high: _mm256_setzero_si256() }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn add(&mut self, words: __m256i) {
        self.total = _mm256_add_epi16(self.total, words);
        self.high = _mm256_add_epi16(self.high, _mm256_srli_epi16::<8>(words));
    }

    /// Adds what has been gathered to 32-bit sums, and starts anew.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn move_to(&mut self, sums: &mut [__m256i; 4]) {
        let low = _mm256_sub_epi16(self.total, _mm256_slli_epi16::<8>(self.high));
        let first = _mm256_set1_epi32(0xFFFF);
        let parts = [
            _mm256_and_si256(low, first),
            _mm256_and_si256(self.high, first),
            _mm256_srli_epi32::<16>(low),
            _mm256_srli_epi32::<16>(self.high),
        ];
        for (sum, part) in sums.iter_mut().zip(parts) {
            *sum = _mm256_add_epi32(*sum, part);
        }
        *self = Self::new();
    }
}
