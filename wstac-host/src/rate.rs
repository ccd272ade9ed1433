//! Frame rates as numbers.

use wstac_core::rate::FrameRate;

/// Frames a second.
pub fn per_second(rate: FrameRate) -> f64 {
    f64::from(rate.numerator()) / f64::from(rate.denominator())
}
