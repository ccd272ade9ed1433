//! Features turned back into light, in a few instructions. The accuracy suits a comparison of lines with each other.

use crate::ln::constant;
use crate::params::FEATURE_FRACTION_BITS;

/// One, as a light: the light of a taxel at full scale.
pub(super) const ONE: i32 = 1 << 16;
/// e^i for whole i from −16 on, in units of 2^-16. No camera's feature is above ln 5, so there is no more than e².
const WHOLE: [u32; 32] = table(-16.0, 1.0, 2.0, ONE as f64);
/// Bits of a feature behind the steps of [`STEPS`].
const REST_BITS: u32 = FEATURE_FRACTION_BITS - 6;
/// e^(i / 64), in units of 2^-12.
const STEPS: [u32; 64] = table(0.0, 1.0 / 64.0, 1.0, 4096.0);

/// Returns e^(`first` + i · `step`), but at most e^(`most` − `step`), in units of 1 / `one`.
const fn table<const N: usize>(first: f64, step: f64, most: f64, one: f64) -> [u32; N] {
    let mut table = [0; N];
    let mut i = 0;
    while i < N {
        let power = first + step * i as f64;
        let power = if power < most { power } else { most - step };
        table[i] = (constant::exp(power) * one + 0.5) as u32;
        i += 1;
    }
    table
}

/// Returns e^`feature`, in units of 2^-16, for a feature in units of 2^-11. The error is below 4 · 10^-4 of the light
/// and three units. The light of five taxels is at most 5.
#[inline(always)]
pub(super) fn light(feature: i16) -> i32 {
    let feature = i32::from(feature);
    let whole = WHOLE[((feature >> FEATURE_FRACTION_BITS) + 16) as usize & 31];
    let step = STEPS[(feature >> REST_BITS) as usize & 63];
    let rest = (feature & ((1 << REST_BITS) - 1)) as u32;
    // e^r = 1 + r for r < 2^-6.
    ((((whole * step) >> 12) * ((1 << FEATURE_FRACTION_BITS) + rest)) >> FEATURE_FRACTION_BITS) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_within_the_stated_error() {
        for feature in i16::MIN..=3296 {
            let expected = (f64::from(feature) / 2048.0).exp() * f64::from(ONE);
            let found = f64::from(light(feature));
            assert!((found - expected).abs() <= 4e-4 * expected + 3.0, "{feature}: {found} {expected}");
        }
        assert!((3296..=i16::MAX).all(|feature| (1 << 17..1 << 19).contains(&light(feature))));
    }
}
