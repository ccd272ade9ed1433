//! A logarithm kernel that is chosen at run time, for hosts.

use super::{Ln, fixed::Fixed, libm::Libm};

/// Any of this crate's kernels, chosen by name. A program that names this type links all of them.
///
/// ```
/// use wstac_core::ln::{Ln, any::AnyLn, fixed::Fixed, libm::Libm};
///
/// assert_eq!(AnyLn::default().ln(1_000), <Fixed>::default().ln(1_000));
/// assert_eq!(AnyLn::Libm.ln(1_000), Libm.ln(1_000));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum AnyLn {
    /// The chord table [`Fixed`] of 256 segments.
    #[default]
    Fixed,
    /// The 64-bit floating point of [`Libm`].
    Libm,
    /// The 32-bit floating point of [`Micromath`](super::micromath::Micromath).
    #[cfg(feature = "micromath")]
    Micromath,
}

impl Ln for AnyLn {
    #[inline]
    fn ln(&self, x: u32) -> i32 {
        match self {
            Self::Fixed => Fixed::<256>.ln(x),
            Self::Libm => Libm.ln(x),
            #[cfg(feature = "micromath")]
            Self::Micromath => super::micromath::Micromath.ln(x),
        }
    }
}
