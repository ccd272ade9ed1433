//! ln by a chord table on the mantissa: only integers and 32-bit multiplies, no divisions, monotone.

use super::constant::ln;
use super::{LN_FRACTION_BITS, Ln};

/// The log kernel by chords between `SEGMENTS` + 1 points of ln(1 + m). `SEGMENTS` is a power of two from 16 to 256.
///
/// A chord is at most 1 / (8 · `SEGMENTS`²) below the curve. Half of that is added back to every inner point (not to ln
/// 1, which stays 0). So 256 segments (1 KiB of flash) are within 1.7e-6 of ln, and 32 segments (128 bytes) within
/// 1.3e-4 (tested below). The unit of a feature is 4.9e-4.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fixed<const SEGMENTS: usize = 256>;

/// ln 2 in units of 2^-26.
const LN_2: u32 = scaled(2.0);

/// Returns ln `x` in units of 2^-26.
const fn scaled(x: f64) -> u32 {
    (ln(x) * (1_u64 << LN_FRACTION_BITS) as f64 + 0.5) as u32
}

impl<const SEGMENTS: usize> Fixed<SEGMENTS> {
    /// log2 of the segments.
    const BITS: u32 = SEGMENTS.trailing_zeros();
    /// Fraction bits within a segment: a segment's rise, below 2^26 / `SEGMENTS`, times the fraction fits 32 bits.
    const FRACTION_BITS: u32 = 6 + Self::BITS;

    /// ln(1 + i / `SEGMENTS`), raised by half a chord's error.
    const TABLE: [u32; SEGMENTS] = {
        assert!(SEGMENTS.is_power_of_two() && SEGMENTS >= 16 && SEGMENTS <= 256);
        let mut table = [0; SEGMENTS];
        let mut i = 1;
        while i < SEGMENTS {
            let chord = 1.0 / (16.0 * (SEGMENTS + i) as f64 * (SEGMENTS + i) as f64);
            table[i] = scaled(1.0 + i as f64 / SEGMENTS as f64) + (chord * (1_u64 << LN_FRACTION_BITS) as f64) as u32;
            i += 1;
        }
        table
    };
}

impl<const SEGMENTS: usize> Ln for Fixed<SEGMENTS> {
    #[inline(always)]
    fn ln(&self, x: u32) -> i32 {
        let zeros = x.leading_zeros();
        // The mantissa without its leading one, left-aligned.
        let mantissa = (x << (zeros & 31)) << 1;
        let segment = (mantissa >> (32 - Self::BITS)) as usize;
        let fraction = (mantissa << Self::BITS) >> (32 - Self::FRACTION_BITS);
        let low = Self::TABLE.get(segment).copied().unwrap_or(0);
        let high = Self::TABLE.get(segment + 1).copied().unwrap_or(LN_2);
        let rise = ((high - low) * fraction) >> Self::FRACTION_BITS;
        ((31 - (zeros & 31)) * LN_2 + low + rise) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worst<const SEGMENTS: usize>() -> f64 {
        let unit = f64::from(1 << LN_FRACTION_BITS);
        (1..1 << 20)
            .chain((20..32).flat_map(|e| (0..4096).map(move |i| (1 << e) + (i << (e - 12)) + i)))
            .map(|x: u32| (f64::from(Fixed::<SEGMENTS>.ln(x)) / unit - f64::from(x).ln()).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn errors_are_as_documented() {
        assert!(worst::<256>() < 1.7e-6, "{}", worst::<256>());
        assert!(worst::<32>() < 1.3e-4, "{}", worst::<32>());
    }

    #[test]
    fn powers_of_two_are_multiples_of_ln_2() {
        for e in 0..32 {
            assert_eq!(Fixed::<256>.ln(1 << e), e * LN_2 as i32);
        }
    }
}
