//! Sums one byte of each pixel: a mask selects it, and one instruction adds pairs of bytes to 16-bit sums.
//!
//! Its gain has not yet been measured on real hardware.

use core::arch::aarch64::{
    uint8x16_t, uint16x8_t, vaddvq_u32, vandq_u8, vdupq_n_u16, vdupq_n_u32, vpadalq_u8, vpadalq_u16,
};

use super::{VECTOR, vector};
use crate::green::simd::{MASKS, Selected, Wide};

/// Vectors whose sums of two bytes fit 16 bits.
const PART: usize = 128;

/// Sums the bytes at `PLACE` of every `PERIOD` bytes of rows.
#[target_feature(enable = "neon")]
pub(super) fn sum<const PERIOD: usize, const PLACE: usize>(wide: Wide<'_, VECTOR>) -> u32 {
    let [first, second, third] = const { &Selected::<VECTOR, PERIOD, PLACE>::MASKS };
    let masks = [vector(first), vector(second), vector(third)];
    // A row ends at a multiple of the period, so its last vector starts as if at byte -16, which repeats byte 32.
    let tail = vandq_u8(vector(&wide.tail()), masks[MASKS - 1]);
    let (before, mut rows) = (wide.before(), wide.rows());
    let mut sum = vdupq_n_u32(0);
    for _ in 0..wide.block().rows() {
        let Some((whole, last)) = rows.vectors::<VECTOR, 0>(before) else { break };
        let mut turn = masks;
        for part in whole.chunks(PART) {
            let mut pairs = vdupq_n_u16(0);
            for bytes in part {
                pairs = add(pairs, bytes, turn[0]);
                turn = if VECTOR.is_multiple_of(PERIOD) { turn } else { [turn[1], turn[2], turn[0]] };
            }
            sum = vpadalq_u16(sum, pairs);
        }
        sum = vpadalq_u16(sum, add(vdupq_n_u16(0), last, tail));
    }
    vaddvq_u32(sum)
}

/// Adds the bytes that a mask selects to eight 16-bit sums.
#[inline]
#[target_feature(enable = "neon")]
fn add(sum: uint16x8_t, bytes: &[u8; VECTOR], mask: uint8x16_t) -> uint16x8_t {
    vpadalq_u8(sum, vandq_u8(vector(bytes), mask))
}
