//! ln by `micromath` in 32-bit floating point: small code on a core with an FPU, off by up to 6.4e-5 (measured on
//! every integer), not monotone.

use super::{LN_FRACTION_BITS, Ln};
use ::micromath::F32Ext;

/// `micromath`'s approximation of ln.
#[derive(Clone, Copy, Debug, Default)]
pub struct Micromath;

impl Ln for Micromath {
    fn ln(&self, x: u32) -> i32 {
        // Called by its trait: with `std` in the build, f32 has an ln of its own that would win.
        (F32Ext::ln(x.max(1) as f32) * (1 << LN_FRACTION_BITS) as f32) as i32
    }
}
