//! Names the shared library by its interface, as the linker and the loader do.

/// The interface: the version in which a function or a structure of `wstac.h` has changed last. The crate's test of
/// sizes has it, too, and `ci/build libwstac` reads it here.
const INTERFACE: &str = "0.4";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-env=WSTAC_INTERFACE={INTERFACE}");
    println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libwstac.so.{INTERFACE}");
}
