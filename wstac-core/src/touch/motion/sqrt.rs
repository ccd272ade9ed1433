//! The square root: the instruction of a processor, or few bytes. `libm::sqrtf` takes 300 more.
//!
//! With the instruction of a Cortex-M4F, motion by edges takes 16 % fewer instructions. The golden velocities of
//! boards compare both.

/// Returns the square root of a number, rounded to the nearest as IEEE 754 says; NaN of a number below 0.
#[cfg(fpu)]
#[inline(never)]
#[allow(unsafe_code, reason = "the core library has no square root")]
pub(crate) fn sqrt(x: f32) -> f32 {
    let mut bits = x.to_bits();
    // SAFETY: these are instructions on registers. S0, which a stable compiler does not lend, has its value again.
    unsafe {
        core::arch::asm!(
            "vmov {kept}, s0",
            "vmov s0, {bits}",
            "vsqrt.f32 s0, s0",
            "vmov {bits}, s0",
            "vmov s0, {kept}",
            kept = out(reg) _, bits = inout(reg) bits, options(pure, nomem, nostack),
        );
    }
    f32::from_bits(bits)
}

/// Returns the square root of a number, rounded to the nearest as IEEE 754 says; NaN of a number below 0.
#[cfg(not(fpu))]
pub(crate) fn sqrt(x: f32) -> f32 {
    if !(x > 0.0 && x < f32::INFINITY) {
        return if x < 0.0 { f32::NAN } else { x };
    }
    // A number below the normal ones is made one of them: 2^24 times as large, and its root 2^12 times.
    let (bits, less) = if x < f32::MIN_POSITIVE { ((x * 16_777_216.0).to_bits(), 12) } else { (x.to_bits(), 0) };
    let exponent = (bits >> 23) as i32 - 127;
    // The root of 24 or 25 bits, bit by bit; one bit more than a number has, for rounding.
    let mut rest = (bits & 0x7F_FFFF | 0x80_0000) << (1 + (exponent & 1));
    let (mut root, mut twice) = (0_u32, 0_u32);
    let mut bit = 1_u32 << 24;
    while bit != 0 {
        let next = twice + bit;
        if next <= rest {
            twice = next + bit;
            rest -= next;
            root += bit;
        }
        rest <<= 1;
        bit >>= 1;
    }
    // No root is halfway between two numbers.
    let rounded = (root + (root & 1)) >> 1;
    f32::from_bits((rounded + 0x3F00_0000).wrapping_add_signed(((exponent >> 1) - less) << 23))
}

#[cfg(test)]
mod tests {
    use super::sqrt;

    #[test]
    fn roots_are_those_of_ieee_754() {
        let edges = [0, 1, 0x7F_FFFF, 0x80_0000, 0x7F7F_FFFF, 0x7F80_0000, 0x8000_0000];
        for bits in (0..=0x7F80_0000).step_by(601).chain(0x3F7F_0000..=0x4081_0000).chain(edges) {
            let x = f32::from_bits(bits);
            assert_eq!(sqrt(x).to_bits(), x.sqrt().to_bits(), "{x:e}");
        }
        assert!([-1.0, f32::NEG_INFINITY, f32::NAN].into_iter().all(|x| sqrt(x).is_nan()));
    }
}
