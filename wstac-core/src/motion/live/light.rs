//! Features turned back into light, in a few instructions. The accuracy suits a comparison of lines with each other.

/// One, as a light: the light of a taxel at full scale.
pub(super) const ONE: i32 = 1 << 16;
/// Coefficients of 2^u for 0 ≤ u ≤ 1, in units of 2^-15. Their sum is 1, so that the curve has no steps.
const CUBIC: [i32; 3] = [22_780, 7_411, 2_577];
const _: () = assert!(CUBIC[0] + CUBIC[1] + CUBIC[2] == 1 << 15);
/// log2 e · 2^15 / 2^11, in units of 2^-10.
const LOG2_E: i32 = 23_637;

/// Returns e^`feature`, in units of 2^-16, for a feature in units of 2^-11. The error is below 2 · 10^-4 of the light and
/// one unit. The light of five taxels is at most 5.
pub(super) fn light(feature: i16) -> i32 {
    let exponent = (i32::from(feature) * LOG2_E) >> 10;
    let u = exponent & 0x7FFF;
    let [a, b, c] = CUBIC;
    let power = (1 << 15) + ((u * (a + ((u * (b + ((u * c) >> 15))) >> 15))) >> 15);
    // 2^15 ≤ power < 2^16. Features of a camera are below ln 5, which is 2.33 in this exponent.
    let shift = (exponent >> 15) + 1;
    if shift >= 0 { power << shift.min(2 + 1) } else { power.checked_shr(shift.unsigned_abs()).unwrap_or(0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_within_the_stated_error() {
        for feature in i16::MIN..=3296 {
            let expected = (f64::from(feature) / 2048.0).exp() * f64::from(ONE);
            let found = f64::from(light(feature));
            assert!((found - expected).abs() <= 2e-4 * expected + 1.0, "{feature}: {found} {expected}");
            assert!(feature == i16::MIN || light(feature) >= light(feature - 1), "{feature}");
        }
    }
}
