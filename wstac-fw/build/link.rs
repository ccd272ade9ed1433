//! Tells how to link: the memories of the emulated boards, and the log strings of the real one.

use std::path::Path;
use std::{env, fs};

/// The memory of QEMU's microbit.
const MICROBIT: &str = "MEMORY { FLASH : ORIGIN = 0, LENGTH = 256K RAM : ORIGIN = 0x20000000, LENGTH = 16K }\n";
/// The memory of QEMU's mps2-an385, mps2-an386 and mps2-an500.
const MPS2: &str = "MEMORY { FLASH : ORIGIN = 0, LENGTH = 4M RAM : ORIGIN = 0x20000000, LENGTH = 4M }\n";

/// Links a program for an emulated board: an nRF51 for a Cortex-M0, an MPS2 for all others.
pub fn emulated(out: &Path) {
    println!("cargo:rustc-check-cfg=cfg(microbit)");
    if env::var_os("CARGO_FEATURE_EMULATED").is_none() {
        return;
    }
    let microbit = env::var("TARGET").is_ok_and(|target| target.starts_with("thumbv6m"));
    if microbit {
        println!("cargo:rustc-cfg=microbit");
    }
    fs::write(out.join("memory.x"), if microbit { MICROBIT } else { MPS2 }).expect("OUT_DIR can be written");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg=-Tlink.x");
}

/// Links a program for the STM32H743, whose memory embassy-stm32 knows.
pub fn h743() {
    if env::var_os("CARGO_FEATURE_H743").is_some() {
        for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
            println!("cargo:rustc-link-arg-bin=h743={argument}");
        }
    }
}
