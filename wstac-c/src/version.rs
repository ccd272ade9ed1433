//! The version of the library, for programs that compare it with that of their header.

use std::ffi::c_char;

/// The major version of the header.
pub const WSTAC_VERSION_MAJOR: u32 = 0;
/// The minor version of the header.
pub const WSTAC_VERSION_MINOR: u32 = 3;
/// The patch of the header's version.
pub const WSTAC_VERSION_PATCH: u32 = 0;
/// The version of the header in one number: 65536 · major + 256 · minor + patch.
pub const WSTAC_VERSION: u32 = 0x0000_0300;

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

/// Returns the version of the library that is loaded, such as "0.3.0", as WSTAC_VERSION_TEXT has that of the header.
#[unsafe(no_mangle)]
pub extern "C" fn wstac_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}
