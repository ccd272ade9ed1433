//! Sums bytes by their place in each group of four.
//!
//! The bytes are read as 16-bit words. One sum adds the words and loses carries; another adds their high bytes.
//! The low bytes are the difference. That takes two instructions for 16 bytes.
//! The first four bytes of each row and the last four are also summed on their own, for cells of which one pixel
//! counts.
//!
//! Its gain has not yet been measured on real hardware.

use core::arch::aarch64::{
    uint8x16_t, uint16x8_t, uint32x4_t, vaddq_u16, vaddq_u32, vaddvq_u32, vandq_u8, vandq_u32, vcombine_u8,
    vdupq_n_u16, vdupq_n_u32, vget_high_u8, vget_low_u8, vgetq_lane_u32, vreinterpretq_u16_u8, vreinterpretq_u32_u16,
    vshlq_n_u16, vsraq_n_u16, vsraq_n_u32, vsubq_u16,
};

use super::{VECTOR, vector};
use crate::green::simd::{Places, ROOM, Wide};

/// Bytes of the widest row whose sums fit 16 bits.
pub(super) const MOST_WIDTH: usize = VECTOR * ROOM;

/// Sums a block that is no wider than [`MOST_WIDTH`].
#[target_feature(enable = "neon")]
pub(super) fn sums(wide: Wide<'_, VECTOR>) -> Places {
    let (before, mut rows, tail) = (wide.before(), wide.rows(), vector(&wide.tail()));
    let (mut lanes, mut ends) = (Lanes::new(), Lanes::new());
    let (mut sums, mut end_sums) = ([vdupq_n_u32(0); 4], [vdupq_n_u32(0); 4]);
    let mut room = ROOM;
    for _ in 0..wide.block().rows() {
        let Some((whole, last)) = rows.vectors::<VECTOR, 0>(before) else { break };
        if room <= before {
            lanes.move_to(&mut sums);
            ends.move_to(&mut end_sums);
            room = ROOM;
        }
        room -= before + 1;
        for bytes in whole {
            lanes.add(vector(bytes));
        }
        let (first, last) = (vector(whole.first().unwrap_or(last)), vector(last));
        lanes.add(vandq_u8(last, tail));
        ends.add(vcombine_u8(vget_low_u8(first), vget_high_u8(last)));
    }
    lanes.move_to(&mut sums);
    ends.move_to(&mut end_sums);
    Places {
        all: sums.map(|sum| vaddvq_u32(sum)),
        first: end_sums.map(|sum| vgetq_lane_u32::<0>(sum)),
        last: end_sums.map(|sum| vgetq_lane_u32::<3>(sum)),
    }
}

/// Sums of words and of their high bytes, modulo 2^16.
#[derive(Clone, Copy)]
struct Lanes {
    total: uint16x8_t,
    high: uint16x8_t,
}

impl Lanes {
    #[inline]
    #[target_feature(enable = "neon")]
    fn new() -> Self {
        Self { total: vdupq_n_u16(0), high: vdupq_n_u16(0) }
    }

    #[inline]
    #[target_feature(enable = "neon")]
    fn add(&mut self, bytes: uint8x16_t) {
        let words = vreinterpretq_u16_u8(bytes);
        self.total = vaddq_u16(self.total, words);
        self.high = vsraq_n_u16::<8>(self.high, words);
    }

    /// Adds the sums to 32-bit sums and clears them.
    #[inline]
    #[target_feature(enable = "neon")]
    fn move_to(&mut self, sums: &mut [uint32x4_t; 4]) {
        let low = vreinterpretq_u32_u16(vsubq_u16(self.total, vshlq_n_u16::<8>(self.high)));
        let high = vreinterpretq_u32_u16(self.high);
        let first = vdupq_n_u32(0xFFFF);
        sums[0] = vaddq_u32(sums[0], vandq_u32(low, first));
        sums[1] = vaddq_u32(sums[1], vandq_u32(high, first));
        sums[2] = vsraq_n_u32::<16>(sums[2], low);
        sums[3] = vsraq_n_u32::<16>(sums[3], high);
        *self = Self::new();
    }
}
