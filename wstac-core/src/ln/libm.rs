//! ln by `libm` in 64-bit floating point: the most accurate kernel, but slow without a 64-bit FPU.

use super::{LN_FRACTION_BITS, Ln};

/// The log kernel by `libm::log`, rounded to the nearest 2^-26.
///
/// Its error is within 7.6e-9 (measured on every integer), of which 2^-27 is rounding.
#[derive(Clone, Copy, Debug, Default)]
pub struct Libm;

impl Ln for Libm {
    fn ln(&self, x: u32) -> i32 {
        (::libm::log(f64::from(x.max(1))) * f64::from(1 << LN_FRACTION_BITS) + 0.5) as i32
    }
}
