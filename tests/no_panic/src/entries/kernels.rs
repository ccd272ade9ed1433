//! Entry points for features with every logarithm kernel.

use wstac_core::error::ConfigError;
use wstac_core::features::{FeatureScale, Features, Floor};
use wstac_core::ln::{Ln, fixed::Fixed, libm::Libm, micromath::Micromath};

/// Declares the entry points of one kernel.
macro_rules! kernel {
    ($group:ident, $kernel:ty) => {
        mod $group {
            use super::*;

            entries! {
                $group:
                new_scale(pixels: u32, full_scale: u32, frames: u32, floor: Floor) -> Result<FeatureScale<$kernel>, ConfigError> {
                    FeatureScale::new(pixels, full_scale, frames, floor)
                }
                feature(scale: &FeatureScale<$kernel>, sum: u32) -> i16 { scale.feature(sum).max(scale.floor()) }
                features(scale: &FeatureScale<$kernel>, lines: &[u32; 10]) -> Features { scale.features(lines) }
                ln(x: u32) -> i32 { <$kernel>::default().ln(x) }
            }
        }
    };
}

kernel!(fixed_256, Fixed<256>);
kernel!(fixed_16, Fixed<16>);
kernel!(fixed_32, Fixed<32>);
kernel!(libm, Libm);
kernel!(micromath, Micromath);
