//! e^x of fixed-point numbers by three small tables. It turns features back into light.

use crate::ln::constant;
use crate::params::FEATURE_FRACTION_BITS;

/// Fraction bits of the argument.
pub(crate) const EXP_FRACTION_BITS: u32 = 20;
/// Fraction bits that the argument has more than a feature.
pub(crate) const EXTRA_BITS: u32 = EXP_FRACTION_BITS - FEATURE_FRACTION_BITS;
/// The number one, as a result.
pub(crate) const EXP_ONE: u32 = 1 << 31;

/// Steps of 1/8, down to e^-18: below the range of a feature, −16 − ln 5.
const COARSE: [u32; 145] = table(8.0);
/// Steps of 1/256.
const MIDDLE: [u32; 32] = table(256.0);
/// Steps of 1/8192.
const FINE: [u32; 32] = table(8192.0);

/// Returns a table of e^(-i / `steps`) in units of 2^-31.
const fn table<const N: usize>(steps: f64) -> [u32; N] {
    let mut table = [0; N];
    let mut i = 0;
    while i < N {
        table[i] = (constant::exp(-(i as f64) / steps) * EXP_ONE as f64 + 0.5) as u32;
        i += 1;
    }
    table
}

/// Returns a feature with the fraction bits of the argument.
pub(crate) fn widened(feature: i16) -> i32 {
    i32::from(feature) << EXTRA_BITS
}

/// Returns e^-`x` in units of 2^-31 for `x` ≥ 0 in units of 2^-20; 0 from 18.1 on. The error is below 4 units.
pub(crate) fn exp_of_negative(x: u32) -> u32 {
    let Some(&coarse) = COARSE.get((x >> 17) as usize) else { return 0 };
    let entry = |table: &[u32], index: u32| u64::from(table.get(index as usize).copied().unwrap_or(0));
    let middle = entry(&MIDDLE, x >> 12 & 31);
    let fine = entry(&FINE, x >> 7 & 31);
    // e^-r = 1 − r for r < 2^-13, off by less than 2^-27 of a result.
    let rest = u64::from(EXP_ONE - ((x & 127) << (31 - EXP_FRACTION_BITS)));
    let product = |a: u64, b: u64| (a * b + (1 << 30)) >> 31;
    product(product(coarse.into(), middle), product(fine, rest)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_within_the_stated_error_over_the_whole_range() {
        for x in (0..20 << EXP_FRACTION_BITS).step_by(61) {
            let expected = (-f64::from(x) / f64::from(1 << EXP_FRACTION_BITS)).exp() * f64::from(EXP_ONE);
            let expected = if x >> 17 > 144 { 0.0 } else { expected };
            let found = f64::from(exp_of_negative(x));
            // Four units of rounding, and 2^-27 of the result for the linear rest.
            assert!((found - expected).abs() <= 4.0 + expected / f64::from(1 << 27), "{x}: {found} {expected}");
        }
    }
}
