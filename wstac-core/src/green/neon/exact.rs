//! Exact green of 16 pixels at a time, in lanes of 16 bits.
//!
//! `simd::factors` explains the numbers. Widening instructions multiply chroma and add the products up; one shifts and
//! accumulates.
//! w is the high half of a 32-bit lane, for one cell. Luma is split into the first pixels of cells and the second ones,
//! so that w serves both as it is.
//!
//! The quotient of p · y + w by 73 is the high half of twice a product with 2^21 / 73, shifted right by 6.
//! The shift narrows to bytes and clamps to 0..=255.
//!
//! Its gain has not yet been measured on real hardware.

use core::arch::aarch64::{
    int16x8_t, int32x4_t, uint8x8_t, uint8x16_t, vaddvq_u32, vandq_u8, vandq_u16, vcombine_u8, vdup_n_u8, vdupq_n_s32,
    vdupq_n_u16, vdupq_n_u32, vget_high_u8, vget_low_s16, vget_low_u8, vmlal_high_n_s16, vmlal_n_s16, vmlaq_n_s16,
    vmull_high_n_s16, vmull_n_s16, vmull_u8, vpadalq_u16, vpaddlq_u8, vqdmulhq_n_s16, vqmovun_s16, vqshrun_n_s16,
    vreinterpretq_s16_u16, vreinterpretq_u16_u8, vshrn_high_n_s32, vshrn_n_s32, vshrq_n_u16, vsraq_n_s32, vuzp1_u8,
    vuzp1q_u8, vuzp2_u8, vuzp2q_u8,
};

use super::{VECTOR, half, vector};
use crate::green::simd::cells::{Bytes, Cells, Chroma, Row, Vectors, WithPairs, WithPlanes};
use crate::green::simd::{BlockRows, Factors, LEAST_CELLS as CELLS};

#[target_feature(enable = "neon")]
pub(super) fn sum(cells: &Cells<'_>, factors: &Factors) -> u32 {
    if factors.luma == 1 { of_range::<false>(cells, factors) } else { of_range::<true>(cells, factors) }
}

#[inline]
#[target_feature(enable = "neon")]
fn of_range<const LIMITED: bool>(cells: &Cells<'_>, factors: &Factors) -> u32 {
    match cells.chroma {
        Chroma::Within(_) => of_rows::<Vectors<'_, 32>, LIMITED>(factors, cells),
        Chroma::Pairs(..) => of_rows::<WithPairs<'_, 16>, LIMITED>(factors, cells),
        Chroma::Planes(..) => of_rows::<WithPlanes<'_, 8, 16>, LIMITED>(factors, cells),
    }
}

/// Sums rows of cells, of which some pixels of the first and of the last do not count. `LIMITED` means p/q = 85/73;
/// otherwise it is 1.
#[inline]
#[target_feature(enable = "neon")]
fn of_rows<'a, R: Row<'a, 8, 16, 32>, const LIMITED: bool>(factors: &Factors, cells: &Cells<'a>) -> u32 {
    let (count, place, [left, right]) = (cells.in_row(), cells.place(), cells.outside);
    // Whole vectors, then one that ends with the row.
    let before = count.saturating_sub(1) / CELLS;
    let old = 2 * (CELLS * (before + 1)).saturating_sub(count);
    let every = vector(&counted(0, 0));
    let head = vector(&counted(left, 0));
    let tail = vector(&counted(old + if before == 0 { left } else { 0 }, right));
    let mut sum = vdupq_n_u32(0);
    let mut rows = BlockRows::new(cells.luma);
    for number in 0..cells.luma.rows() {
        let Some(row) = rows.next().and_then(|luma| R::new(cells, luma, number)) else { break };
        let mut counts = head;
        for index in 0..before {
            let Some(cells) = row.cells(index) else { break };
            let green = vandq_u8(green::<LIMITED>(factors, place, cells), counts);
            sum = vpadalq_u16(sum, vpaddlq_u8(green));
            counts = every;
        }
        let green = vandq_u8(green::<LIMITED>(factors, place, row.last()), tail);
        sum = vpadalq_u16(sum, vpaddlq_u8(green));
    }
    vaddvq_u32(sum)
}

/// Returns a mask of 16 pixels that leaves out some at both ends: the first pixels of cells, then the second ones.
#[inline(always)]
fn counted(left: usize, right: usize) -> [u8; VECTOR] {
    core::array::from_fn(|index| {
        let pixel = index % CELLS * 2 + index / CELLS;
        if pixel >= left && pixel + right < 2 * CELLS { u8::MAX } else { 0 }
    })
}

/// Returns the green of 16 pixels: the first pixels of cells, then the second ones.
#[inline]
#[target_feature(enable = "neon")]
fn green<const LIMITED: bool>(factors: &Factors, place: usize, cells: Bytes<'_, 8, 16, 32>) -> uint8x16_t {
    let (luma, cb, cr) = split(place, cells);
    let [cb_scale, cr_scale] = factors.scale.map(|scale| vdup_n_u8(scale as u8));
    let cb = vreinterpretq_s16_u16(vmull_u8(cb, cb_scale));
    let cr = vreinterpretq_s16_u16(vmull_u8(cr, cr_scale));
    let offset = vdupq_n_s32(factors.offset);
    let ([cb_high, cr_high], [cb_low, cr_low]) = (factors.high, factors.low);
    let (cb_first, cr_first) = (vget_low_s16(cb), vget_low_s16(cr));
    let first = with_low(
        vmlal_n_s16(vmlal_n_s16(offset, cb_first, cb_high), cr_first, cr_high),
        vmlal_n_s16(vmull_n_s16(cb_first, cb_low), cr_first, cr_low),
    );
    let last = with_low(
        vmlal_high_n_s16(vmlal_high_n_s16(offset, cb, cb_high), cr, cr_high),
        vmlal_high_n_s16(vmull_high_n_s16(cb, cb_low), cr, cr_low),
    );
    let w = vshrn_high_n_s32::<16>(vshrn_n_s32::<16>(first), last);
    let words = vreinterpretq_u16_u8(luma);
    let [even, odd] = [vandq_u16(words, vdupq_n_u16(0xFF)), vshrq_n_u16::<8>(words)];
    let [even, odd] =
        [even, odd].map(|y| clamped::<LIMITED>(vmlaq_n_s16(w, vreinterpretq_s16_u16(y), factors.luma.into())));
    vcombine_u8(even, odd)
}

/// Adds a sum with 32 fraction bits to one with 16.
#[inline]
#[target_feature(enable = "neon")]
fn with_low(high: int32x4_t, low: int32x4_t) -> int32x4_t {
    vsraq_n_s32::<16>(high, low)
}

/// Divides p · y + w by q and clamps it to 0..=255.
#[inline]
#[target_feature(enable = "neon")]
fn clamped<const LIMITED: bool>(n: int16x8_t) -> uint8x8_t {
    if LIMITED {
        // ⌊n / 73⌋ of -32768..=32262, because 28729 · 73 = 2^21 + 65. Below 0 it is not above 0, which is enough.
        vqshrun_n_s16::<6>(vqdmulhq_n_s16(n, 28_729))
    } else {
        vqmovun_s16(n)
    }
}

/// Returns the luma of 16 pixels, and the Cb and the Cr of 8 cells. `place` is that of luma in each pair of packed
/// bytes.
#[inline]
#[target_feature(enable = "neon")]
fn split(place: usize, cells: Bytes<'_, 8, 16, 32>) -> (uint8x16_t, uint8x8_t, uint8x8_t) {
    let (luma, pairs) = match cells {
        Bytes::Packed(bytes) => {
            let [first, last] =
                [0, VECTOR].map(|at| bytes.get(at..).and_then(<[u8]>::first_chunk).unwrap_or(&[0; VECTOR]));
            let (first, last) = (vector(first), vector(last));
            let (even, odd) = (vuzp1q_u8(first, last), vuzp2q_u8(first, last));
            if place == 0 { (even, odd) } else { (odd, even) }
        }
        Bytes::Pairs(luma, pairs) => (vector(luma), vector(pairs)),
        Bytes::Planes(luma, [cb, cr]) => return (vector(luma), half(*cb), half(*cr)),
    };
    let (first, last) = (vget_low_u8(pairs), vget_high_u8(pairs));
    (luma, vuzp1_u8(first, last), vuzp2_u8(first, last))
}
