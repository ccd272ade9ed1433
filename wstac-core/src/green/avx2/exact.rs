//! Exact green of 32 pixels at a time, in lanes of 16 bits.
//!
//! As in `ycbcr`, round(G) = ⌊(p · y + w) / q⌋ with w = ⌊o − q B · Cb − q C · Cr⌋.
//!
//! **w.** A lane of 32 bits holds w with 16 fraction bits, for one cell. A factor q B of 22 bits is the product of 7 bits and 15 bits:
//! one instruction multiplies each chroma byte by its 7 bits, and one multiplies the result by 15 bits and adds up Cb and Cr.
//! A product like that is not q B exactly. The difference has a factor of 15 bits more, whose product is shifted right by 16 and added.
//! So few bits are enough for each of the four conversions: all 2^24 triples are tested.
//! The high half of the lane is w, and a shuffle copies it to both pixels of the cell.
//!
//! **The quotient.** p · y + w fits 16 bits, and so does its quotient by 73: the high half of a product with 2^21 / 73, shifted right by 5.
//! Two vectors are packed into one, which clamps to 0..=255, and the bytes are added up.
//!
//! That takes 25 instructions for 32 pixels, beside loads. YUYV takes 0.52 of the time of the previous kernel, which took 38.

use core::arch::x86_64::{
    __m128i, __m256i, _mm_cvtsi32_si128, _mm_cvtsi64_si128, _mm_unpacklo_epi8, _mm256_add_epi16, _mm256_add_epi32,
    _mm256_add_epi64, _mm256_and_si256, _mm256_cvtepu8_epi16, _mm256_madd_epi16, _mm256_maddubs_epi16,
    _mm256_mulhi_epi16, _mm256_mullo_epi16, _mm256_packus_epi16, _mm256_sad_epu8, _mm256_set1_epi16, _mm256_set1_epi32,
    _mm256_setzero_si256, _mm256_shuffle_epi8, _mm256_sra_epi16, _mm256_srai_epi32,
};

use core::hint::black_box;

use super::{VECTOR, half, numbers, prefetch, vector};
use crate::green::simd::cells::{Bytes, CellRows, Cells, Chroma, PackedRows, PairRows, PlaneRows, Row};
use crate::green::simd::{Factors, LEAST_CELLS as CELLS};

/// Sums the green of cells.
#[target_feature(enable = "avx2")]
pub(super) fn sum(cells: &Cells<'_>, factors: &Factors) -> u32 {
    if factors.luma == 1 { of_range::<false>(cells, factors) } else { of_range::<true>(cells, factors) }
}

#[inline]
#[target_feature(enable = "avx2")]
fn of_range<const LIMITED: bool>(cells: &Cells<'_>, factors: &Factors) -> u32 {
    let lanes = Lanes::<LIMITED>::new(factors, cells.place());
    match cells.chroma {
        Chroma::Within(_) => of_rows(&lanes, cells, PackedRows::new(cells.luma)),
        Chroma::Pairs(pairs, shared) => of_rows(&lanes, cells, PairRows::new(cells.luma, pairs, shared)),
        Chroma::Planes(planes, shared) => of_rows(&lanes, cells, PlaneRows::new(cells.luma, planes, shared)),
    }
}

/// Sums rows of cells, of which some pixels of the first and of the last do not count.
#[inline]
#[target_feature(enable = "avx2")]
fn of_rows<'a, const LIMITED: bool>(lanes: &Lanes<LIMITED>, cells: &Cells<'a>, mut rows: impl CellRows<'a>) -> u32 {
    let (count, [left, right]) = (cells.in_row(), cells.outside);
    // Whole pairs of vectors, then one or two vectors of which the last ends with the row.
    let before = count.saturating_sub(1) / (2 * CELLS);
    let rest = count.saturating_sub(2 * CELLS * before);
    let old = (2 * CELLS).saturating_sub(rest) % CELLS;
    let in_rest = if before == 0 { left } else { 0 };
    let every = vector(&counted([0, 0], [0, 0]));
    let head = vector(&counted([left, 0], [0, 0]));
    let tail = vector(&if rest > CELLS {
        counted([in_rest, 0], [2 * old, right])
    } else {
        counted([2 * old + in_rest, right], [2 * CELLS, 0])
    });
    let mut sum = _mm256_setzero_si256();
    for _ in 0..cells.luma.rows() {
        let Some(row) = rows.next() else { break };
        match (row.last(), cells.chroma) {
            (Bytes::Packed(luma), _) => prefetch(luma, cells.luma),
            (Bytes::Pairs(luma, chroma), Chroma::Pairs(pairs, _)) => {
                prefetch(luma, cells.luma);
                prefetch(chroma, pairs);
            }
            (Bytes::Pairs(luma, _) | Bytes::Planes(luma, _), _) => prefetch(luma, cells.luma),
        }
        let mut counts = head;
        for index in 0..before {
            let (Some(first), Some(second)) = (row.cells(2 * index), row.cells(2 * index + 1)) else { break };
            sum = add(sum, [lanes.green(first), lanes.green(second)], counts);
            counts = every;
        }
        let end = lanes.green(row.last());
        let green = match row.cells(2 * before) {
            Some(first) if rest > CELLS => [lanes.green(first), end],
            _ => [end, end],
        };
        sum = add(sum, green, tail);
    }
    let [a, _, b, _, c, _, d, _] = numbers(sum);
    a.wrapping_add(b).wrapping_add(c).wrapping_add(d)
}

/// Returns a mask of two packed vectors of 16 pixels that leaves out some pixels at both ends of each.
#[inline(always)]
fn counted(first: [usize; 2], second: [usize; 2]) -> [u8; VECTOR] {
    // Packing takes eight pixels of the first vector, eight of the second, and again.
    core::array::from_fn(|index| {
        let pixel = index / 16 * 8 + index % 8;
        let [left, right] = if index % 16 < 8 { first } else { second };
        if pixel >= left && pixel + right < 2 * CELLS { u8::MAX } else { 0 }
    })
}

/// Clamps the green of 32 pixels to 0..=255 and adds those that count to four 64-bit sums.
#[inline]
#[target_feature(enable = "avx2")]
fn add(sum: __m256i, [first, second]: [__m256i; 2], counts: __m256i) -> __m256i {
    let bytes = _mm256_and_si256(_mm256_packus_epi16(first, second), counts);
    _mm256_add_epi64(sum, _mm256_sad_epu8(bytes, _mm256_setzero_si256()))
}

/// [`Factors`] in all lanes. `LIMITED` means p/q = 85/73; otherwise it is 1.
#[derive(Clone, Copy)]
struct Lanes<const LIMITED: bool> {
    /// Takes luma out of packed bytes and multiplies it.
    luma: __m256i,
    /// Takes chroma out of packed bytes and multiplies it.
    scale: __m256i,
    high: __m256i,
    low: __m256i,
    offset: __m256i,
    /// Copies each cell's w to both pixels.
    both: __m256i,
    shift: __m128i,
    /// Multiplies luma that lies apart.
    words_luma: __m256i,
    /// Multiplies chroma that lies apart.
    words_scale: __m256i,
}

impl<const LIMITED: bool> Lanes<LIMITED> {
    /// `place` is that of luma in each pair of packed bytes.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn new(factors: &Factors, place: usize) -> Self {
        let pairs = |[cb, cr]: [i16; 2]| _mm256_set1_epi32(i32::from(cb as u16) | i32::from(cr) << 16);
        let (luma, [cb, cr]) = (factors.luma, factors.scale);
        let (luma, scale) =
            if place == 0 { ([luma, 0, luma, 0], [0, cb, 0, cr]) } else { ([0, luma, 0, luma], [cb, 0, cr, 0]) };
        let packed = |bytes: [i8; 4]| _mm256_set1_epi32(i32::from_le_bytes(bytes.map(|byte| byte as u8)));
        let both: [u8; VECTOR] = core::array::from_fn(|index| (index % 16 / 4 * 4 + 2 + index % 2) as u8);
        Self {
            luma: packed(luma),
            scale: packed(scale),
            high: pairs(factors.high),
            low: pairs(factors.low),
            offset: _mm256_set1_epi32(factors.offset),
            // The compiler must not know these, or it makes two shuffles of one, and eight instructions of a product and a shift.
            both: vector(black_box(&both)),
            shift: _mm_cvtsi32_si128(black_box(5)),
            words_luma: _mm256_set1_epi16(i16::from(factors.luma)),
            words_scale: pairs(factors.scale.map(i16::from)),
        }
    }

    /// Returns the green of 16 pixels before it is clamped, in lanes of 16 bits.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn green(&self, cells: Bytes<'_>) -> __m256i {
        let (luma, chroma) = self.multiplied(cells);
        let high = _mm256_add_epi32(_mm256_madd_epi16(chroma, self.high), self.offset);
        let w = _mm256_add_epi32(high, _mm256_srai_epi32::<16>(_mm256_madd_epi16(chroma, self.low)));
        let n = _mm256_add_epi16(luma, _mm256_shuffle_epi8(w, self.both));
        if LIMITED {
            // ⌊n / 73⌋ of -32768..=32262, because 28729 · 73 = 2^21 + 65. Below 0 it is not above 0, which is enough.
            _mm256_sra_epi16(_mm256_mulhi_epi16(n, _mm256_set1_epi16(28_729)), self.shift)
        } else {
            n
        }
    }

    /// Returns p · y of 16 pixels and the scaled Cb, Cr pairs of 8 cells, in lanes of 16 bits.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn multiplied(&self, cells: Bytes<'_>) -> (__m256i, __m256i) {
        let (luma, chroma) = match cells {
            Bytes::Packed(bytes) => {
                let bytes = vector(bytes);
                return (_mm256_maddubs_epi16(bytes, self.luma), _mm256_maddubs_epi16(bytes, self.scale));
            }
            Bytes::Pairs(luma, chroma) => (half(luma), half(chroma)),
            Bytes::Planes(luma, [cb, cr]) => (half(luma), _mm_unpacklo_epi8(quarter(*cb), quarter(*cr))),
        };
        let (luma, chroma) = (_mm256_cvtepu8_epi16(luma), _mm256_cvtepu8_epi16(chroma));
        let luma = if LIMITED { _mm256_mullo_epi16(luma, self.words_luma) } else { luma };
        (luma, _mm256_mullo_epi16(chroma, self.words_scale))
    }
}

/// Returns a vector that starts with 8 bytes.
#[inline]
#[target_feature(enable = "avx2")]
fn quarter(bytes: [u8; 8]) -> __m128i {
    _mm_cvtsi64_si128(i64::from_le_bytes(bytes))
}
