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
use crate::green::simd::{BlockRows, Cells, Chroma};

/// Cells of a vector.
const CELLS: usize = 8;

/// The numbers that a conversion multiplies by.
#[derive(Clone, Copy, Debug)]
pub(in crate::green) struct Factors {
    /// p.
    luma: i8,
    /// The 7 bits that Cb and Cr are multiplied by first.
    scale: [i8; 2],
    /// The factors of the results, with 16 fraction bits.
    high: [i16; 2],
    /// What is missing in the factors, with 32 fraction bits.
    low: [i16; 2],
    /// What Cb = Cr = 0 makes, with 16 fraction bits.
    offset: i32,
}

impl Factors {
    /// Splits q B and q C, which have 48 fraction bits. `offset` has 16.
    pub(in crate::green) const fn new(luma: i32, chroma: [i64; 2], offset: i32) -> Self {
        let (cb, cr) = (split(chroma[0]), split(chroma[1]));
        Self { luma: luma as i8, scale: [cb.0, cr.0], high: [cb.1, cr.1], low: [cb.2, cr.2], offset }
    }

    /// Returns w as the lanes find it, with another offset.
    #[cfg(test)]
    pub(in crate::green) fn w(&self, chroma: [u8; 2], offset: i32) -> i32 {
        let sum = |factors: [i16; 2]| {
            let one = |n: usize| i32::from(chroma[n]) * i32::from(self.scale[n]) * i32::from(factors[n]);
            one(0) + one(1)
        };
        (sum(self.high) + (sum(self.low) >> 16) + self.offset + offset) >> 16
    }
}

/// Splits −`factor` into s · (h · 2^−16 + l · 2^−32), with the s of 7 bits that comes nearest.
const fn split(factor: i64) -> (i8, i16, i16) {
    let (mut nearest, mut least) = ((0, 0, 0), i64::MAX);
    let mut scale = 1;
    while scale < 128 {
        // The factor with 32 fraction bits, over the scale.
        let unit = scale << 16;
        let quotient = -((factor + unit / 2) / unit);
        let high = (quotient + (1 << 15)) >> 16;
        let error = (factor + quotient * unit).abs();
        if high >= i16::MIN as i64 && error < least {
            (nearest, least) = ((scale as i8, high as i16, (quotient - (high << 16)) as i16), error);
        }
        scale += 1;
    }
    nearest
}

/// Sums the green of cells.
#[target_feature(enable = "avx2")]
pub(super) fn sum(cells: &Cells<'_>, factors: &Factors) -> u32 {
    if factors.luma == 1 { of_range::<false>(cells, factors) } else { of_range::<true>(cells, factors) }
}

#[inline]
#[target_feature(enable = "avx2")]
fn of_range<const LIMITED: bool>(cells: &Cells<'_>, factors: &Factors) -> u32 {
    let (luma, mut rows) = (cells.luma, BlockRows::new(cells.luma));
    match cells.chroma {
        Chroma::Within(place) => {
            let lanes = Lanes::<LIMITED>::new(factors, place);
            of_rows(&lanes, cells, luma.width() / 4, |_| Vectors::<VECTOR>::new(rows.next()?))
        }
        Chroma::Pairs(pairs, shared) => {
            let lanes = Lanes::<LIMITED>::new(factors, 0);
            let row = |row| Some((Vectors::<16>::new(rows.next()?)?, Vectors::<16>::new(pairs.row(shared.row(row)))?));
            of_rows(&lanes, cells, luma.width() / 2, row)
        }
        Chroma::Planes([cb, cr], shared) => {
            let lanes = Lanes::<LIMITED>::new(factors, 0);
            let row = |row| {
                let chroma = shared.row(row);
                let chroma = [Vectors::<8>::new(cb.row(chroma))?, Vectors::<8>::new(cr.row(chroma))?];
                Some((Vectors::<16>::new(rows.next()?)?, chroma))
            };
            of_rows(&lanes, cells, luma.width() / 2, row)
        }
    }
}

/// The bytes of 8 cells.
#[derive(Clone, Copy)]
enum Bytes<'a> {
    /// Luma and chroma within each other.
    Packed(&'a [u8; VECTOR]),
    /// Luma, and Cb Cr pairs.
    Pairs(&'a [u8; 16], &'a [u8; 16]),
    /// Luma, Cb and Cr.
    Planes(&'a [u8; 16], [&'a [u8; 8]; 2]),
}

/// A row of bytes as vectors of `N`.
#[derive(Clone, Copy)]
struct Vectors<'a, const N: usize> {
    whole: &'a [[u8; N]],
    /// The last `N` bytes, which repeat bytes of the vector before unless the row is whole vectors.
    last: &'a [u8; N],
}

impl<'a, const N: usize> Vectors<'a, N> {
    #[inline(always)]
    fn new(row: &'a [u8]) -> Option<Self> {
        Some(Self { whole: row.as_chunks().0, last: row.last_chunk()? })
    }
}

/// A row of cells.
trait Row: Copy {
    /// Returns the bytes of 8 cells, of which `index` times as many lie before them.
    fn cells(&self, index: usize) -> Option<Bytes<'_>>;

    /// Returns the bytes of the last 8 cells.
    fn last(&self) -> Bytes<'_>;
}

impl Row for Vectors<'_, VECTOR> {
    #[inline(always)]
    fn cells(&self, index: usize) -> Option<Bytes<'_>> {
        self.whole.get(index).map(Bytes::Packed)
    }

    #[inline(always)]
    fn last(&self) -> Bytes<'_> {
        Bytes::Packed(self.last)
    }
}

impl Row for (Vectors<'_, 16>, Vectors<'_, 16>) {
    #[inline(always)]
    fn cells(&self, index: usize) -> Option<Bytes<'_>> {
        Some(Bytes::Pairs(self.0.whole.get(index)?, self.1.whole.get(index)?))
    }

    #[inline(always)]
    fn last(&self) -> Bytes<'_> {
        Bytes::Pairs(self.0.last, self.1.last)
    }
}

impl Row for (Vectors<'_, 16>, [Vectors<'_, 8>; 2]) {
    #[inline(always)]
    fn cells(&self, index: usize) -> Option<Bytes<'_>> {
        let [cb, cr] = &self.1;
        Some(Bytes::Planes(self.0.whole.get(index)?, [cb.whole.get(index)?, cr.whole.get(index)?]))
    }

    #[inline(always)]
    fn last(&self) -> Bytes<'_> {
        Bytes::Planes(self.0.last, [self.1[0].last, self.1[1].last])
    }
}

/// Sums rows of `count` cells, of which some pixels of the first and of the last do not count.
#[inline]
#[target_feature(enable = "avx2")]
fn of_rows<const LIMITED: bool, R: Row>(
    lanes: &Lanes<LIMITED>,
    cells: &Cells<'_>,
    count: usize,
    mut row: impl FnMut(usize) -> Option<R>,
) -> u32 {
    let [left, right] = cells.outside;
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
    for index in 0..cells.luma.rows() {
        let Some(row) = row(index) else { break };
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
