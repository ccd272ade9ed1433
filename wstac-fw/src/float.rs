//! The product of two numbers, for a wave on a core without floating point and without products of 64 bits: a Cortex-M0
//! or M0+.
//!
//! The compiler's own takes three times as many instructions, since it multiplies 64 bits in a call.

/// Returns the bits of a product of two normal numbers that is one, as IEEE 754 rounds it, or of a zero and a finite
/// number; `None` for all else.
#[inline(always)]
#[cfg_attr(not(any(test, float)), allow(dead_code))]
fn product(a: u32, b: u32) -> Option<u32> {
    let (of_a, of_b) = ((a << 1) >> 24, (b << 1) >> 24);
    if of_a.wrapping_sub(1) >= 254 || of_b.wrapping_sub(1) >= 254 {
        let is_zero = |bits: u32, of: u32| of == 0 && bits << 9 == 0;
        return ((is_zero(a, of_a) && of_b < 255) || (is_zero(b, of_b) && of_a < 255)).then_some((a ^ b) & 1 << 31);
    }
    // Halves of 24 bits, and 48 bits of a product: 24 of them above, 24 of them below.
    let (a_low, b_low) = (a & 0xFFF, b & 0xFFF);
    let (a_high, b_high) = ((a << 9) >> 21 | 0x800, (b << 9) >> 21 | 0x800);
    let low = a_low * b_low;
    let middle = a_high * b_low + a_low * b_high + (low >> 12);
    let (mut high, mut rest) = (a_high * b_high + (middle >> 12), middle << 20 | (low << 20) >> 12);
    let mut exponent = (of_a + of_b).wrapping_sub(127);
    if high >> 23 == 0 {
        (high, rest, exponent) = (high << 1 | rest >> 31, rest << 1, exponent.wrapping_sub(1));
    }
    if exponent >= 253 {
        return None;
    }
    // To the even one of two that are as near. What is rounded up may be the next power of two.
    let up = rest.overflowing_add(0x7FFF_FFFF + (high & 1)).1;
    Some((a ^ b) & 1 << 31 | ((exponent << 23) + high + u32::from(up)))
}

#[cfg(float)]
mod call {
    unsafe extern "C" {
        safe fn __mulsf3(a: f32, b: f32) -> f32;
    }

    /// Replaces the compiler's call for a product.
    #[unsafe(no_mangle)]
    extern "aapcs" fn __aeabi_fmul(a: f32, b: f32) -> f32 {
        super::product(a.to_bits(), b.to_bits()).map_or_else(|| __mulsf3(a, b), f32::from_bits)
    }
}

#[cfg(test)]
mod tests {
    use super::product;

    #[test]
    fn products_are_those_of_ieee_754() {
        let mut seed = 1_u32;
        let mut next = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed ^ seed >> 15
        };
        let mut found = 0;
        for turn in 0..4_000_000 {
            let [a, b] = [next(), next()].map(|bits| match turn % 4 {
                // Few bits: many products are halfway between two numbers.
                0 => bits & 0xFFF0_0000 | (bits & 0xF) << 10,
                // Exponents whose sums are near both ends.
                1 => bits & 0x807F_FFFF | [1, 63, 64, 127, 190, 191, 254, 0][bits as usize >> 23 & 7] << 23,
                2 => [0, 1 << 31, 0x3F80_0000, 0x7F80_0000, 0x7FC0_0000, 1, 0x80_0000, bits][bits as usize >> 8 & 7],
                _ => bits,
            });
            if let Some(bits) = product(a, b) {
                let (a, b) = (f32::from_bits(a), f32::from_bits(b));
                assert_eq!(bits, (a * b).to_bits(), "{a:e} times {b:e}");
                found += 1;
            }
        }
        assert!(found > 2_000_000, "{found}");
    }
}
