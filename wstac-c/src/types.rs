//! The types that both C interfaces share. cbindgen makes `include/wstac_types.h` of this file, which `wstac.h` and
//! `wstac_fw.h` include.

use wstac_core::params;

/// Number of features of a frame: five rows, then five columns.
pub const WSTAC_FEATURES: usize = 10;
/// Number of frames of a sample.
pub const WSTAC_SAMPLE_FRAMES: usize = 70;
/// Units of a feature per natural logarithm: a feature is a multiple of 1/2048.
pub const WSTAC_FEATURE_ONE: i32 = 2048;

/// The major version of the header.
pub const WSTAC_VERSION_MAJOR: u32 = 0;
/// The minor version of the header.
pub const WSTAC_VERSION_MINOR: u32 = 3;
/// The patch of the header's version.
pub const WSTAC_VERSION_PATCH: u32 = 0;
/// The version of the header in one number: 65536 · major + 256 · minor + patch.
pub const WSTAC_VERSION: u32 = 0x0000_0300;

/// A choice of a program: 0 or 1, `false` or `true`. Any other byte is refused.
pub type WstacBool = u8;

const _: () = assert!(WSTAC_FEATURES == params::FEATURES && WSTAC_SAMPLE_FRAMES == params::SAMPLE_FRAMES);
const _: () = assert!(WSTAC_FEATURE_ONE == params::FEATURE_ONE);
const _: () = assert!(WSTAC_VERSION == (WSTAC_VERSION_MAJOR << 16 | WSTAC_VERSION_MINOR << 8 | WSTAC_VERSION_PATCH));
const _: () = assert!(WSTAC_VERSION_MAJOR == number(env!("CARGO_PKG_VERSION_MAJOR")));
const _: () = assert!(WSTAC_VERSION_MINOR == number(env!("CARGO_PKG_VERSION_MINOR")));
const _: () = assert!(WSTAC_VERSION_PATCH == number(env!("CARGO_PKG_VERSION_PATCH")));

/// Returns a number of the package's version.
const fn number(digits: &str) -> u32 {
    match u32::from_str_radix(digits, 10) {
        Ok(number) => number,
        Err(_) => panic!("a part of the version is no number: decided at compile time"),
    }
}
