//! Tells the crate which instructions the target has, if the compiler does not.
//!
//! These are packed multiply-accumulate, 32-bit Thumb, a Cortex-M's square root, and vectors that `green::simd` has
//! kernels for.

use std::env;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-check-cfg=cfg(thumb2, dsp, fpu, simd)");
    let target = env::var("TARGET").unwrap_or_default();
    // Cores that may lack the DSP extension (thumbv8m.main) are taken to lack it.
    if ["thumbv7m", "thumbv7em", "thumbv8m.main"].iter().any(|core| target.starts_with(core)) {
        println!("cargo:rustc-cfg=thumb2");
    }
    if target.starts_with("thumbv7em") {
        println!("cargo:rustc-cfg=dsp");
    }
    // The name says that floats are in registers of their own.
    if target.starts_with("thumb") && target.ends_with("eabihf") {
        println!("cargo:rustc-cfg=fpu");
    }
    let of_target = |name: &str| env::var(format!("CARGO_CFG_TARGET_{name}")).unwrap_or_default();
    // x86-64 is asked for AVX2 at run time. The compiler may assume NEON, unless the target disables it.
    let neon = of_target("FEATURE").split(',').any(|feature| feature == "neon") && of_target("ENDIAN") == "little";
    match of_target("ARCH").as_str() {
        "x86_64" => println!("cargo:rustc-cfg=simd"),
        "aarch64" if neon => println!("cargo:rustc-cfg=simd"),
        _ => {}
    }
}
