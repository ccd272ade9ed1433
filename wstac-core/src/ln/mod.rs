//! Interchangeable logarithm kernels, one file each (SPEC §2, §7).

pub mod any;
pub mod constant;
pub mod fixed;
pub mod libm;
#[cfg(feature = "micromath")]
pub mod micromath;

/// Fraction bits of a kernel's result: ln(2^32) = 22.2 fits 31 bits.
pub const LN_FRACTION_BITS: u32 = 26;

/// A natural logarithm of 32-bit integers. A kernel without a choice in it is a type without fields, which takes no
/// memory.
pub trait Ln: Default {
    /// Returns ln `x` for `x` ≥ 1 in units of 2^-26: 0..=22.2 · 2^26. ln 0 is never asked for; a kernel may return any
    /// number of that range.
    fn ln(&self, x: u32) -> i32;
}
