//! The version of the library, for programs that compare it with that of their header.

/// Returns a number of the package's version.
const fn number(digits: &str) -> u32 {
    match u32::from_str_radix(digits, 10) {
        Ok(number) => number,
        Err(_) => panic!("a part of the version is no number: decided at compile time"),
    }
}

/// Returns the version of the library that is linked, as WSTAC_FW_VERSION has that of the header.
#[unsafe(no_mangle)]
pub extern "C" fn wstac_fw_version() -> u32 {
    const {
        number(env!("CARGO_PKG_VERSION_MAJOR")) << 16
            | number(env!("CARGO_PKG_VERSION_MINOR")) << 8
            | number(env!("CARGO_PKG_VERSION_PATCH"))
    }
}
