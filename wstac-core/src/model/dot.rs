//! The weighted sums of a block of rows, which read each part of the sample once.
//!
//! The plain way is right anywhere, and where 32 bits are enough a host's compiler makes packed instructions of it. A
//! Cortex-M4 or M7 has packed multiply-accumulate of its own, which no compiler finds here: two products and their sum to 64 bits are
//! one instruction. Both ways are tested to give the same sums.

use super::linear_svm::BLOCK;

/// The sums of a block of rows with int16 weights.
#[inline(always)]
pub(super) fn int16(weights: &[u32], rows: usize, inputs: &[i16], fits_32_bits: bool) -> [i64; BLOCK] {
    #[cfg(dsp)]
    if rows == BLOCK {
        let (packed, left) = packed::int16(weights, inputs);
        let rest = plain::int16::<i64>(left.0, rows, left.1);
        return [0, 1].map(|row| packed[row].wrapping_add(rest[row]));
    }
    if fits_32_bits {
        plain::int16::<i32>(weights, rows, inputs).map(i64::from)
    } else {
        plain::int16::<i64>(weights, rows, inputs)
    }
}

/// The sums of a block of rows with int8 weights.
#[inline(always)]
pub(super) fn int8(weights: &[u32], rows: usize, inputs: &[i16], fits_32_bits: bool) -> [i64; BLOCK] {
    #[cfg(dsp)]
    if rows == BLOCK {
        let (packed, left) = packed::int8(weights, inputs);
        let rest = plain::int8::<i64>(left.0, rows, left.1);
        return [0, 1].map(|row| packed[row].wrapping_add(rest[row]));
    }
    if fits_32_bits {
        plain::int8::<i32>(weights, rows, inputs).map(i64::from)
    } else {
        plain::int8::<i64>(weights, rows, inputs)
    }
}

pub(super) mod plain {
    use super::BLOCK;

    /// A number that products are summed up in.
    pub(in super::super) trait Sum: Copy + Default {
        /// The sum and two products of int16, which together may just exceed 32 bits.
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
    pub(in super::super) fn int16<S: Sum>(weights: &[u32], rows: usize, inputs: &[i16]) -> [S; BLOCK] {
        let mut sums = [S::default(); BLOCK];
        let products = |sum: S, word: u32, [first, second]: [i16; 2]| {
            sum.add(i32::from(word as i16) * i32::from(first), i32::from((word >> 16) as i16) * i32::from(second))
        };
        let (pairs, _) = inputs.as_chunks::<2>();
        if rows == BLOCK {
            for (words, &pair) in weights.as_chunks::<BLOCK>().0.iter().zip(pairs) {
                sums = [0, 1].map(|row| products(sums[row], words[row], pair));
            }
        } else {
            for (&word, &pair) in weights.iter().zip(pairs) {
                sums[0] = products(sums[0], word, pair);
            }
        }
        sums
    }

    #[inline(always)]
    pub(in super::super) fn int8<S: Sum>(weights: &[u32], rows: usize, inputs: &[i16]) -> [S; BLOCK] {
        let mut sums = [S::default(); BLOCK];
        for (words, inputs) in weights.chunks_exact(rows.max(1)).zip(inputs.chunks(4)) {
            let mut four = [0; 4];
            for (input, &given) in four.iter_mut().zip(inputs) {
                *input = i32::from(given);
            }
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

    /// Inputs of a turn of the loop.
    const TURN: usize = 10;

    /// Sums of whole turns, and the weights and inputs that are left.
    type Part<'a> = ([i64; BLOCK], (&'a [u32], &'a [i16]));

    #[inline(always)]
    pub(super) fn int16<'a>(weights: &'a [u32], inputs: &'a [i16]) -> Part<'a> {
        let turns = (inputs.len() / TURN).min(weights.len() / TURN);
        if turns == 0 {
            return ([0; BLOCK], (weights, inputs));
        }
        // SAFETY: so many turns of ten words and ten inputs are there.
        let sums = unsafe { turns_of_int16(weights.as_ptr(), inputs.as_ptr(), turns) };
        (sums, (weights.get(turns * TURN..).unwrap_or_default(), inputs.get(turns * TURN..).unwrap_or_default()))
    }

    #[inline(always)]
    pub(super) fn int8<'a>(weights: &'a [u32], inputs: &'a [i16]) -> Part<'a> {
        const TURN: usize = 4;
        let turns = (inputs.len() / TURN).min(weights.len() / BLOCK);
        if turns == 0 {
            return ([0; BLOCK], (weights, inputs));
        }
        // SAFETY: so many turns of two words and four inputs are there.
        let sums = unsafe { turns_of_int8(weights.as_ptr(), inputs.as_ptr(), turns) };
        (sums, (weights.get(turns * BLOCK..).unwrap_or_default(), inputs.get(turns * TURN..).unwrap_or_default()))
    }

    /// On a Cortex-M4, 20 instructions for 20 products. Weights are aligned, as LDM wants them; the sample need not be.
    ///
    /// # Safety
    /// `turns`, not 0, times ten words and ten inputs are there.
    #[inline(never)]
    unsafe fn turns_of_int16(weights: *const u32, inputs: *const i16, turns: usize) -> [i64; BLOCK] {
        let (low0, high0, low1, high1): (u32, u32, u32, u32);
        // SAFETY: a turn reads ten words of weights and ten inputs. R6 is saved, as the compiler may need it.
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
                inout("r8") 0_u32 => low0, inout("r10") 0_u32 => high0,
                inout("r11") 0_u32 => low1, inout("r12") 0_u32 => high1,
                options(readonly),
            );
        }
        sums([low0, high0, low1, high1])
    }

    /// On a Cortex-M4, 13 instructions for 8 products: weights are widened on the way.
    ///
    /// # Safety
    /// `turns`, not 0, times two words and four inputs are there.
    #[inline(never)]
    unsafe fn turns_of_int8(weights: *const u32, inputs: *const i16, turns: usize) -> [i64; BLOCK] {
        let (low0, high0, low1, high1): (u32, u32, u32, u32);
        // SAFETY: a turn reads two words of weights and four inputs. R6 is saved, as the compiler may need it.
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
                inout("r8") 0_u32 => low0, inout("r10") 0_u32 => high0,
                inout("r11") 0_u32 => low1, inout("r12") 0_u32 => high1,
                options(readonly),
            );
        }
        sums([low0, high0, low1, high1])
    }

    fn sums([low0, high0, low1, high1]: [u32; 4]) -> [i64; BLOCK] {
        [(low0, high0), (low1, high1)].map(|(low, high)| (u64::from(low) | u64::from(high) << 32).cast_signed())
    }
}
