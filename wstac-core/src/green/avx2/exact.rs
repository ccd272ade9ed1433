//! Exact green of 16 pixels at a time, in lanes of 16 bits.
//!
//! As in `ycbcr`, round(G) = ⌊(p · y + w) / q⌋ with w = ⌊o − q B b − q C r⌋. One instruction multiplies Cb and Cr by factors of 16 bits and
//! adds the products up; with factors of 30 bits, in a high and a low part of 15, that is two for a cell. So many bits are enough for each of
//! the four colors: all 2^24 triples are tested. p · y + w is within 16 bits, and so is its quotient: the high half of a product with 2^21 / q.

use core::arch::x86_64::{
    __m128i, __m256i, _mm_cvtsi32_si128, _mm_loadl_epi64, _mm_loadu_si128, _mm_unpacklo_epi8, _mm256_add_epi16,
    _mm256_add_epi32, _mm256_add_epi64, _mm256_and_si256, _mm256_cvtepu8_epi16, _mm256_madd_epi16, _mm256_mulhi_epi16,
    _mm256_mullo_epi16, _mm256_packus_epi16, _mm256_sad_epu8, _mm256_set1_epi16, _mm256_set1_epi32,
    _mm256_setzero_si256, _mm256_shuffle_epi8, _mm256_sra_epi16, _mm256_srai_epi32, _mm256_srli_epi16,
};

use super::{AHEAD, Cells, Chroma, VECTOR, load, prefetch, quads, vector};
use crate::frame::Block;

/// Cells of a vector.
pub(super) const CELLS: usize = 8;
/// Bits of the low part of chroma's factors.
const LOW: u32 = 15;

/// What a conversion multiplies by. Chroma's factors have 9 fraction bits in the high part if p is not 1, and 15 if it is.
#[derive(Clone, Copy, Debug)]
pub(in crate::green) struct Factors {
    /// p.
    pub(in crate::green) luma: i16,
    /// −q B and −q C, high and low part.
    pub(in crate::green) cb: (i16, i16),
    pub(in crate::green) cr: (i16, i16),
    /// What Cb = Cr = 0 makes, high and low part.
    pub(in crate::green) offset: (i32, i32),
    /// What the quotient of p/q = 85/73 is shifted by at last. That it is read and not known keeps the compiler from making eight instructions
    /// of two.
    shift: i32,
}

impl Factors {
    /// Fraction bits of the high part, of factors that are below 2^6 or below 1.
    pub(in crate::green) const fn high_bits(luma: i32) -> u32 {
        if luma == 1 { 15 } else { 9 }
    }

    /// Of −q B, −q C and the offset for chroma's zero level, all with `high_bits` + 15 fraction bits.
    pub(in crate::green) const fn new(luma: i32, cb: i64, cr: i64, zero: i64) -> Self {
        const MASK: i64 = (1 << LOW) - 1;
        let offset = zero - 128 * (cb + cr);
        Self {
            luma: luma as i16,
            cb: ((cb >> LOW) as i16, (cb & MASK) as i16),
            cr: ((cr >> LOW) as i16, (cr & MASK) as i16),
            offset: ((offset >> LOW) as i32, (offset & MASK) as i32),
            shift: 5,
        }
    }

    /// What the lanes make of Cb and Cr.
    #[cfg(test)]
    pub(in crate::green) fn w(&self, cb: u8, cr: u8) -> i32 {
        let sum = |cb_factor: i16, cr_factor: i16, offset| {
            i32::from(cb) * i32::from(cb_factor) + i32::from(cr) * i32::from(cr_factor) + offset
        };
        let high = sum(self.cb.0, self.cr.0, self.offset.0);
        (high + (sum(self.cb.1, self.cr.1, self.offset.1) >> LOW)) >> Self::high_bits(i32::from(self.luma))
    }
}

/// The sum of the green of cells.
#[target_feature(enable = "avx2")]
pub(super) fn sum(cells: &Cells<'_>, factors: &Factors) -> u32 {
    if factors.luma == 1 { of_range::<false>(cells, factors) } else { of_range::<true>(cells, factors) }
}

#[inline]
#[target_feature(enable = "avx2")]
fn of_range<const LIMITED: bool>(cells: &Cells<'_>, factors: &Factors) -> u32 {
    let (lanes, luma) = (Lanes::<LIMITED>::new(factors), cells.luma);
    let ahead = |row: &[u8], block: Block<'_>| {
        let row = row.as_ptr().wrapping_add(AHEAD * block.bytes_per_row());
        prefetch(row, block.width());
        prefetch(row.wrapping_add(block.width() - 1), 1);
    };
    let rows = luma.each_row().enumerate().inspect(|(_, row)| ahead(row, luma));
    match cells.chroma {
        Chroma::Within(0) => of_rows(lanes, luma.width() / 4, cells.beside, rows.map(|(_, row)| Packed::<0>(row))),
        Chroma::Within(_) => of_rows(lanes, luma.width() / 4, cells.beside, rows.map(|(_, row)| Packed::<1>(row))),
        Chroma::Pairs(pairs, shared) => {
            let rows = rows.map(|(y, luma)| Pairs { luma, chroma: pairs.row(shared.row(y)) });
            of_rows(lanes, luma.width() / 2, cells.beside, rows.inspect(|row| ahead(row.chroma, pairs)))
        }
        Chroma::Planes([cb, cr], shared) => {
            let rows = rows.map(|(y, luma)| Planes { luma, cb: cb.row(shared.row(y)), cr: cr.row(shared.row(y)) });
            of_rows(lanes, luma.width() / 2, cells.beside, rows)
        }
    }
}

/// A row of cells.
trait Row {
    /// 16 pixels' luma from cell `first` on, and the Cb, Cr pairs of 8 cells; lanes of 16 bits.
    ///
    /// # Safety
    /// The machine has AVX2.
    unsafe fn cells(&self, first: usize) -> (__m256i, __m256i);
}

/// The sum of rows of as many cells, of which some pixels of the first and of the last do not count.
#[inline]
#[target_feature(enable = "avx2")]
fn of_rows<const LIMITED: bool>(
    lanes: Lanes<LIMITED>,
    count: usize,
    beside: [usize; 2],
    rows: impl Iterator<Item = impl Row>,
) -> u32 {
    let before = count.saturating_sub(1) / CELLS;
    let last = count.saturating_sub(CELLS);
    let old = CELLS - (count - CELLS * before);
    let every = vector(&green_bytes(0, 0));
    let head = vector(&green_bytes(beside[0], 0));
    let tail = vector(&green_bytes(2 * old + if before == 0 { beside[0] } else { 0 }, beside[1]));
    let mut sum = _mm256_setzero_si256();
    for row in rows {
        let mut counts = head;
        for index in 0..before {
            // SAFETY: the machine has AVX2.
            sum = _mm256_add_epi64(sum, lanes.green(unsafe { row.cells(CELLS * index) }, counts));
            counts = every;
        }
        // SAFETY: the machine has AVX2.
        sum = _mm256_add_epi64(sum, lanes.green(unsafe { row.cells(last) }, tail));
    }
    quads(sum).iter().sum::<u64>() as u32
}

/// Which of the bytes count that the green of 16 pixels is packed into, twice in each half of a vector: once, all pixels but so many at both ends.
#[inline(always)]
fn green_bytes(left: usize, right: usize) -> [u8; VECTOR] {
    let mut mask = [0; VECTOR];
    for (index, byte) in mask.iter_mut().enumerate() {
        let pixel = index / 16 * 8 + index % 8;
        let counts = index % 16 < 8 && pixel >= left && pixel + right < 2 * CELLS;
        *byte = if counts { u8::MAX } else { 0 };
    }
    mask
}

/// [`Factors`] in all lanes. `LIMITED`: p/q = 85/73; otherwise 1.
#[derive(Clone, Copy)]
struct Lanes<const LIMITED: bool> {
    luma: __m256i,
    high: __m256i,
    low: __m256i,
    high_offset: __m256i,
    low_offset: __m256i,
    /// Moves each cell's w to both its pixels.
    both: __m256i,
    shift: __m128i,
}

impl<const LIMITED: bool> Lanes<LIMITED> {
    #[inline]
    #[target_feature(enable = "avx2")]
    fn new(factors: &Factors) -> Self {
        let pairs = |cb: i16, cr: i16| _mm256_set1_epi32(i32::from(cb as u16) | i32::from(cr) << 16);
        let mut both = [0; VECTOR];
        for (index, byte) in both.iter_mut().enumerate() {
            *byte = (index % 16 / 4 * 4 + index % 2) as u8;
        }
        Self {
            luma: _mm256_set1_epi16(factors.luma),
            high: pairs(factors.cb.0, factors.cr.0),
            low: pairs(factors.cb.1, factors.cr.1),
            high_offset: _mm256_set1_epi32(factors.offset.0),
            low_offset: _mm256_set1_epi32(factors.offset.1),
            both: vector(&both),
            shift: _mm_cvtsi32_si128(factors.shift),
        }
    }

    /// The green of 16 pixels whose packed bytes count, in four sums.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn green(&self, (luma, chroma): (__m256i, __m256i), counts: __m256i) -> __m256i {
        let low = _mm256_add_epi32(_mm256_madd_epi16(chroma, self.low), self.low_offset);
        let high = _mm256_add_epi32(_mm256_madd_epi16(chroma, self.high), self.high_offset);
        let w = _mm256_add_epi32(high, _mm256_srai_epi32::<{ LOW as i32 }>(low));
        let green = if LIMITED {
            let w = _mm256_shuffle_epi8(_mm256_srai_epi32::<9>(w), self.both);
            let n = _mm256_add_epi16(_mm256_mullo_epi16(luma, self.luma), w);
            // ⌊n / 73⌋ of -32768..=32262: 28729 · 73 = 2^21 + 65. Below 0 it need not be right, as it is not above it.
            _mm256_sra_epi16(_mm256_mulhi_epi16(n, _mm256_set1_epi16(28_729)), self.shift)
        } else {
            let w = _mm256_shuffle_epi8(_mm256_srai_epi32::<15>(w), self.both);
            _mm256_add_epi16(luma, w)
        };
        // Packing clamps to 0..=255.
        let bytes = _mm256_and_si256(_mm256_packus_epi16(green, green), counts);
        _mm256_sad_epu8(bytes, _mm256_setzero_si256())
    }
}

/// `N` bytes from byte `at` on.
#[inline(always)]
fn bytes<const N: usize>(row: &[u8], at: usize) -> &[u8; N] {
    row.get(at..).and_then(<[u8]>::first_chunk).unwrap_or(&[0; N])
}

/// Luma and chroma within each other.
struct Packed<'a, const LUMA: usize>(&'a [u8]);

impl<const LUMA: usize> Row for Packed<'_, LUMA> {
    #[inline(always)]
    unsafe fn cells(&self, first: usize) -> (__m256i, __m256i) {
        // SAFETY: as the caller promises; the bytes are there.
        unsafe {
            let words = load(bytes::<VECTOR>(self.0, 4 * first).as_ptr());
            let (low, high) = (_mm256_and_si256(words, _mm256_set1_epi16(0xFF)), _mm256_srli_epi16(words, 8));
            if LUMA == 0 { (low, high) } else { (high, low) }
        }
    }
}

/// A row of luma, and one of Cb Cr pairs.
struct Pairs<'a> {
    luma: &'a [u8],
    chroma: &'a [u8],
}

impl Row for Pairs<'_> {
    #[inline(always)]
    unsafe fn cells(&self, first: usize) -> (__m256i, __m256i) {
        // SAFETY: as the caller promises.
        unsafe { (words(half(bytes(self.luma, 2 * first))), words(half(bytes(self.chroma, 2 * first)))) }
    }
}

/// A row of luma, one of Cb and one of Cr.
struct Planes<'a> {
    luma: &'a [u8],
    cb: &'a [u8],
    cr: &'a [u8],
}

impl Row for Planes<'_> {
    #[inline(always)]
    unsafe fn cells(&self, first: usize) -> (__m256i, __m256i) {
        // SAFETY: as the caller promises.
        unsafe {
            let chroma = _mm_unpacklo_epi8(quarter(bytes(self.cb, first)), quarter(bytes(self.cr, first)));
            (words(half(bytes(self.luma, 2 * first))), words(chroma))
        }
    }
}

#[inline]
#[target_feature(enable = "avx2")]
fn words(bytes: __m128i) -> __m256i {
    _mm256_cvtepu8_epi16(bytes)
}

#[inline]
#[target_feature(enable = "avx2")]
fn half(bytes: &[u8; 16]) -> __m128i {
    // SAFETY: so many bytes are there.
    unsafe { _mm_loadu_si128(bytes.as_ptr().cast()) }
}

#[inline]
#[target_feature(enable = "avx2")]
fn quarter(bytes: &[u8; 8]) -> __m128i {
    // SAFETY: so many bytes are there.
    unsafe { _mm_loadl_epi64(bytes.as_ptr().cast()) }
}
