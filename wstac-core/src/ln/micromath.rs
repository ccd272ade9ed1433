//! ln by `micromath` in 32-bit floating point: small code on a core with an FPU. It is off by up to 6.4e-5 (measured on
//! every integer) and not monotone.

use super::{LN_FRACTION_BITS, Ln};
use ::micromath::F32Ext;

/// The log kernel by `micromath`'s approximation of ln.
#[derive(Clone, Copy, Debug, Default)]
pub struct Micromath;

impl Ln for Micromath {
    fn ln(&self, x: u32) -> i32 {
        // The call names the trait: with `std` in the build, f32 has its own ln, which would win.
        (F32Ext::ln(x.max(1) as f32) * (1 << LN_FRACTION_BITS) as f32) as i32
    }
}
