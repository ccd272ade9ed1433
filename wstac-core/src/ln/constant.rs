//! ln and exp in 64-bit floating point at compile time. They make the tables and check configurations, and are never
//! part of a frame's cost.

/// ln 2.
const LN_2: f64 = core::f64::consts::LN_2;

/// Returns ln `x` for finite `x` > 0. The error is below 1e-15 of the result or of 1.
pub const fn ln(x: f64) -> f64 {
    // Subnormals first become normal.
    let (x, scaled) = if x < f64::MIN_POSITIVE { (x * (1_u64 << 54) as f64, -54.0) } else { (x, 0.0) };
    let bits = x.to_bits();
    let mut exponent = ((bits >> 52) & 0x7FF) as i32 - 1023;
    let mut mantissa = f64::from_bits(bits & ((1 << 52) - 1) | 1023 << 52);
    if mantissa > core::f64::consts::SQRT_2 {
        mantissa /= 2.0;
        exponent += 1;
    }
    // ln m = 2 artanh((m − 1) / (m + 1)), |z| < 0.172: 0.172^25 < 1e-19.
    let z = (mantissa - 1.0) / (mantissa + 1.0);
    let mut term = 23;
    let mut sum = 0.0;
    while term > 0 {
        sum = sum * z * z + 1.0 / term as f64;
        term -= 2;
    }
    2.0 * z * sum + (exponent as f64 + scaled) * LN_2
}

/// Returns e^`x` for −64 ≤ `x` ≤ 0. The relative error is below 1e-15.
pub const fn exp(x: f64) -> f64 {
    // e^x = (e^(x/64))^64; the series of an argument in −1..=0 needs 20 terms.
    let small = x / 64.0;
    let mut term = 20;
    let mut sum = 1.0;
    while term > 0 {
        sum = 1.0 + sum * small / term as f64;
        term -= 1;
    }
    let mut square = 0;
    while square < 6 {
        sum *= sum;
        square += 1;
    }
    sum
}

/// Returns the integer nearest to `x`, saturating; ties round away from zero.
pub(crate) const fn nearest(x: f64) -> i64 {
    (if x < 0.0 { x - 0.5 } else { x + 0.5 }) as i64
}

/// Returns the largest integer that is not above `x`, saturating.
pub(crate) const fn floor(x: f64) -> i64 {
    let whole = x as i64;
    if x < whole as f64 { whole - 1 } else { whole }
}

#[cfg(test)]
mod tests {
    #[test]
    fn agrees_with_the_platform_over_the_whole_range() {
        for x in [f64::MIN_POSITIVE / 3.0, 5e-324, 1e-300, 1e-7, 0.0475, 0.7, 1.0, 1.41, 1.42, 5.0, 65535.0, 1e300] {
            assert!((super::ln(x) - x.ln()).abs() <= 4e-16 * x.ln().abs().max(1.0), "{x}");
        }
        for x in [0.0, -1e-9, -0.1, -1.0, -17.6, -64.0_f64] {
            assert!((super::exp(x) / x.exp() - 1.0).abs() < 1e-14, "{x}");
        }
    }
}
