//! The weighted sums of a block of rows. They read each part of the sample once.
//!
//! The plain code is right anywhere. If 32 bits are enough, a host's compiler makes packed instructions of it. A
//! Cortex-M4 or M7 has packed multiply-accumulate instructions, which no compiler finds here: two products and their
//! sum to 64 bits are one instruction. Ten rows of 700 take 7,277 instructions (`ci/boards m4 FILE SAMPLES`) instead of
//! 22,017. Both ways are tested to give the same sums.

use super::rows::{BLOCK, INT8};

/// Returns the words of a row of weights of this size.
pub(super) const fn row_words(inputs: usize, number: u16) -> usize {
    if number == INT8 { inputs.div_ceil(4) } else { inputs / 2 }
}

/// Returns the sums of a block of rows, whose words take turns, with weights of the size `NUMBER`.
#[inline(always)]
pub(super) fn block<const NUMBER: u16>(
    start: [i64; BLOCK],
    weights: &[u32],
    inputs: &[i16],
    fits_32_bits: bool,
) -> [i64; BLOCK] {
    #[cfg(dsp)]
    {
        let _ = fits_32_bits;
        if NUMBER == INT8 { packed::int8(start, weights, inputs) } else { packed::int16(start, weights, inputs) }
    }
    #[cfg(not(dsp))]
    both(start, sums::<NUMBER, BLOCK>(weights, inputs, fits_32_bits))
}

/// Returns the sums of rows by plain code, in 32 bits if that is enough.
#[inline(always)]
pub(super) fn sums<const NUMBER: u16, const ROWS: usize>(
    weights: &[u32],
    inputs: &[i16],
    fits_32_bits: bool,
) -> [i64; ROWS] {
    match (NUMBER, fits_32_bits) {
        (INT8, true) => plain::int8::<i32, ROWS>(weights, inputs).map(i64::from),
        (INT8, false) => plain::int8(weights, inputs),
        (_, true) => plain::int16::<i32, ROWS>(weights, inputs).map(i64::from),
        (_, false) => plain::int16(weights, inputs),
    }
}

/// Returns the sums of two blocks' sums. With a bias of at most 2^62 none of them overflows.
#[inline(always)]
pub(super) fn both(one: [i64; BLOCK], other: [i64; BLOCK]) -> [i64; BLOCK] {
    [one[0].wrapping_add(other[0]), one[1].wrapping_add(other[1])]
}

mod plain {
    /// A number that products are summed up in.
    pub(super) trait Sum: Copy + Default {
        /// Returns the sum and two products of int16, which together may just exceed 32 bits.
        #[must_use]
        fn add(self, one: i32, other: i32) -> Self;
    }

    impl Sum for i32 {
        #[inline(always)]
        fn add(self, one: i32, other: i32) -> Self {
            self.wrapping_add(one.wrapping_add(other))
        }
    }

    impl Sum for i64 {
        #[inline(always)]
        fn add(self, one: i32, other: i32) -> Self {
            self.wrapping_add(Self::from(one)).wrapping_add(Self::from(other))
        }
    }

    #[inline(always)]
    pub(super) fn int16<S: Sum, const ROWS: usize>(weights: &[u32], inputs: &[i16]) -> [S; ROWS] {
        let mut sums = [S::default(); ROWS];
        for (words, &[first, second]) in weights.as_chunks::<ROWS>().0.iter().zip(inputs.as_chunks::<2>().0) {
            for (sum, &word) in sums.iter_mut().zip(words) {
                *sum = sum
                    .add(i32::from(word as i16) * i32::from(first), i32::from((word >> 16) as i16) * i32::from(second));
            }
        }
        sums
    }

    #[inline(always)]
    pub(super) fn int8<S: Sum, const ROWS: usize>(weights: &[u32], inputs: &[i16]) -> [S; ROWS] {
        let mut sums = [S::default(); ROWS];
        // `chunks` does not serve: its panic for empty chunks was left over in code for a Cortex-M4.
        let (fours, left) = inputs.as_chunks::<4>();
        let mut last = [0; 4];
        for (input, &given) in last.iter_mut().zip(left) {
            *input = given;
        }
        let last = if left.is_empty() { None } else { Some(&last) };
        for (words, inputs) in weights.as_chunks::<ROWS>().0.iter().zip(fours.iter().chain(last)) {
            let four = inputs.map(i32::from);
            for (sum, word) in sums.iter_mut().zip(words) {
                let [first, third, second, fourth] = word.to_le_bytes().map(|byte| i32::from(byte.cast_signed()));
                *sum = sum.add(first * four[0], second * four[1]).add(third * four[2], fourth * four[3]);
            }
        }
        sums
    }
}

#[cfg(dsp)]
mod packed {
    #![allow(unsafe_code)]

    use super::BLOCK;
    use crate::params::FEATURES;

    /// The number of inputs of an iteration of the loop: a frame.
    const TURN: usize = FEATURES;

    #[inline(always)]
    pub(super) fn int16(start: [i64; BLOCK], weights: &[u32], inputs: &[i16]) -> [i64; BLOCK] {
        let turns = (inputs.len() / TURN).min(weights.len() / TURN);
        if turns == 0 {
            return start;
        }
        // SAFETY: so many iterations of ten words and ten inputs are there; inputs are those of whole frames.
        unsafe { turns_of_int16(start, weights.as_ptr(), inputs.as_ptr(), turns) }
    }

    #[inline(always)]
    pub(super) fn int8(start: [i64; BLOCK], weights: &[u32], inputs: &[i16]) -> [i64; BLOCK] {
        let turns = (inputs.len() / 4).min(weights.len() / BLOCK);
        let mut sums = start;
        if turns > 0 {
            // SAFETY: so many iterations of two words and four inputs are there.
            sums = unsafe { turns_of_int8(start, weights.as_ptr(), inputs.as_ptr(), turns) };
        }
        // If the number of frames is odd, two inputs are left.
        let left = (weights.get(turns * BLOCK..).unwrap_or_default(), inputs.get(turns * 4..).unwrap_or_default());
        let rest = super::plain::int8::<i64, BLOCK>(left.0, left.1);
        super::both(sums, rest)
    }

    /// Sums int16 products: 20 instructions for 20 products on a Cortex-M4. Weights are aligned, as LDM needs them; the
    /// sample need not be.
    ///
    /// # Safety
    /// `turns` times ten words and ten inputs are there, and `turns` is not 0.
    #[inline(never)]
    unsafe fn turns_of_int16(
        start: [i64; BLOCK],
        weights: *const u32,
        inputs: *const i16,
        turns: usize,
    ) -> [i64; BLOCK] {
        let [(mut low0, mut high0), (mut low1, mut high1)] = start.map(|sum| (sum as u32, (sum >> 32) as u32));
        // SAFETY: an iteration reads ten words of weights and ten inputs. R6 is saved, as the compiler may need it.
        unsafe {
            core::arch::asm!(
                "push {{r6}}",
                "mov r6, lr",
                "2:",
                ".rept 2",
                "ldm r0!, {{r2, r3, r4, r5}}",
                "ldr lr, [r1], #4",
                "smlald r8, r10, r2, lr",
                "smlald r11, r12, r3, lr",
                "ldr lr, [r1], #4",
                "smlald r8, r10, r4, lr",
                "smlald r11, r12, r5, lr",
                ".endr",
                "ldm r0!, {{r2, r3}}",
                "ldr lr, [r1], #4",
                "smlald r8, r10, r2, lr",
                "smlald r11, r12, r3, lr",
                "cmp r1, r6",
                "bne 2b",
                "pop {{r6}}",
                inout("r0") weights => _,
                inout("r1") inputs => _,
                inout("lr") inputs.add(turns * TURN) => _,
                out("r2") _, out("r3") _, out("r4") _, out("r5") _,
                inout("r8") low0, inout("r10") high0,
                inout("r11") low1, inout("r12") high1,
                options(readonly),
            );
        }
        sums([low0, high0, low1, high1])
    }

    /// Sums int8 products: 13 instructions for 8 products on a Cortex-M4. Weights are widened on the way.
    ///
    /// # Safety
    /// `turns` times two words and four inputs are there, and `turns` is not 0.
    #[inline(never)]
    unsafe fn turns_of_int8(
        start: [i64; BLOCK],
        weights: *const u32,
        inputs: *const i16,
        turns: usize,
    ) -> [i64; BLOCK] {
        let [(mut low0, mut high0), (mut low1, mut high1)] = start.map(|sum| (sum as u32, (sum >> 32) as u32));
        // SAFETY: an iteration reads two words of weights and four inputs. R6 is saved, as the compiler may need it.
        unsafe {
            core::arch::asm!(
                "push {{r6}}",
                "mov r6, lr",
                "2:",
                "ldm r0!, {{r2, r3}}",
                "ldr r4, [r1], #4",
                "ldr r5, [r1], #4",
                "sxtb16 lr, r2",
                "smlald r8, r10, lr, r4",
                "sxtb16 lr, r2, ror #8",
                "smlald r8, r10, lr, r5",
                "sxtb16 lr, r3",
                "smlald r11, r12, lr, r4",
                "sxtb16 lr, r3, ror #8",
                "smlald r11, r12, lr, r5",
                "cmp r1, r6",
                "bne 2b",
                "pop {{r6}}",
                inout("r0") weights => _,
                inout("r1") inputs => _,
                inout("lr") inputs.add(4 * turns) => _,
                out("r2") _, out("r3") _, out("r4") _, out("r5") _,
                inout("r8") low0, inout("r10") high0,
                inout("r11") low1, inout("r12") high1,
                options(readonly),
            );
        }
        sums([low0, high0, low1, high1])
    }

    fn sums([low0, high0, low1, high1]: [u32; 4]) -> [i64; BLOCK] {
        [(low0, high0), (low1, high1)].map(|(low, high)| (u64::from(low) | u64::from(high) << 32).cast_signed())
    }
}
