//! Says which instructions the target has, where the compiler does not: packed multiply-accumulate and 32-bit Thumb.

use std::env;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-check-cfg=cfg(thumb2, dsp)");
    let target = env::var("TARGET").unwrap_or_default();
    // Cores that may have no DSP extension (thumbv8m.main) are taken to have none.
    if ["thumbv7m", "thumbv7em", "thumbv8m.main"].iter().any(|core| target.starts_with(core)) {
        println!("cargo:rustc-cfg=thumb2");
    }
    if target.starts_with("thumbv7em") {
        println!("cargo:rustc-cfg=dsp");
    }
}
