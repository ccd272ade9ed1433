//! Tells how to link: the memories of every board, and the log strings of the real ones.

use crate::check;
use std::path::Path;
use std::{env, fs};

/// The memory of QEMU's microbit.
const MICROBIT: &str = "MEMORY { FLASH : ORIGIN = 0, LENGTH = 256K RAM : ORIGIN = 0x20000000, LENGTH = 16K }\n";
/// The memory of QEMU's mps2-an385, mps2-an386 and mps2-an500.
const MPS2: &str = "MEMORY { FLASH : ORIGIN = 0, LENGTH = 4M RAM : ORIGIN = 0x20000000, LENGTH = 4M }\n";

/// Links a program for an emulated board: an nRF51 for a Cortex-M0 (without the feature `mps2`), an MPS2 for all
/// others.
pub fn emulated(out: &Path) {
    println!("cargo:rustc-check-cfg=cfg(microbit)");
    if env::var_os("CARGO_FEATURE_EMULATED").is_none() {
        return;
    }
    let microbit = check::is_microbit();
    if microbit {
        println!("cargo:rustc-cfg=microbit");
    }
    fs::write(out.join("memory.x"), if microbit { MICROBIT } else { MPS2 }).expect("OUT_DIR can be written");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg=-Tlink.x");
}

/// The boards with an STM32H743: the program, where its flash begins, and how many KiB it may have. It ends in front of
/// the settings, which begin at 0x08180000. With the feature `models`, it ends in front of the models, at 0x08100000.
///
/// The OpenMV Cam H7 has a bootloader of 128 KiB and a file system of 128 KiB in front of it.
pub const H743: &[(&str, u32, u32)] =
    &[("h743", 0x0800_0000, 1536), ("openmv_cam_h7", 0x0804_0000, 1280), ("weact_h743", 0x0800_0000, 1536)];

/// The memories of an STM32H743 besides its flash. Variables and stack are in the core's own RAM (DTCM), which takes no
/// cycles to wait; the DMA does not reach that, and a bootloader has its own variables there. So the ring and the crash
/// record are in the AXI SRAM.
const H743_MEMORIES: &str = "RAM : ORIGIN = 0x20000000, LENGTH = 128K AXI : ORIGIN = 0x24000000, LENGTH = 512K }
SECTIONS { .axi (NOLOAD) : ALIGN(8) { *(.uninit.ring .uninit.crash_record); } > AXI } INSERT BEFORE .uninit;\n";

/// Links the programs for boards with an STM32H743.
pub fn h743(out: &Path) {
    if env::var_os("CARGO_FEATURE_H743").is_none() {
        return;
    }
    let has_models = env::var_os("CARGO_FEATURE_MODELS").is_some();
    for (program, begin, length) in H743 {
        let length = length - if has_models { 512 } else { 0 };
        let folder = out.join(program);
        let memory = format!("MEMORY {{ FLASH : ORIGIN = {begin:#x}, LENGTH = {length}K {H743_MEMORIES}");
        fs::create_dir_all(&folder).expect("OUT_DIR can be written");
        fs::write(folder.join("memory.x"), memory).expect("OUT_DIR can be written");
        println!("cargo:rustc-link-arg-bin={program}=-L{}", folder.display());
    }
    // Of every program, so that one without a row does not link: it would be empty. `check.rs` says so before.
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}

/// The KiB of a program for a Raspberry Pi Pico or Pico 2. It ends in front of the settings, which begin at 0x101FE000.
/// With the feature `models`, it ends in front of the models, at 0x10100000.
const PICO_PROGRAM: [u32; 2] = [2040, 1024];
/// The memories of a Raspberry Pi Pico: the second boot loader, flash behind it, and RAM.
fn pico_memories(program: u32) -> String {
    format!(
        "MEMORY {{ BOOT2 : ORIGIN = 0x10000000, LENGTH = 0x100 \
         FLASH : ORIGIN = 0x10000100, LENGTH = {program}K - 0x100 RAM : ORIGIN = 0x20000000, LENGTH = 264K }}\n"
    )
}
/// The memories of a Raspberry Pi Pico 2.
fn pico_2_memories(program: u32) -> String {
    format!(
        "MEMORY {{ FLASH : ORIGIN = 0x10000000, LENGTH = {program}K RAM : ORIGIN = 0x20000000, LENGTH = 512K }}\n{PICO_2}"
    )
}
/// The boot ROM of a Raspberry Pi Pico 2 looks for a block at the beginning of the flash.
const PICO_2: &str = "SECTIONS { .start_block : ALIGN(4) { __start_block_addr = .; KEEP(*(.start_block)); KEEP(*(.boot_info)); } > FLASH } \
    INSERT AFTER .vector_table;
_stext = ADDR(.start_block) + SIZEOF(.start_block);\n";

/// Links the programs for boards with an RP2040 or RP2350. They have no rows: the memories are those of the chip.
pub fn pico(out: &Path) {
    let is_first = env::var_os("CARGO_FEATURE_RP2040").is_some();
    if env::var_os("CARGO_FEATURE_RP").is_none() {
        return;
    }
    let folder = out.join("pico");
    fs::create_dir_all(&folder).expect("OUT_DIR can be written");
    let [whole, with_models] = PICO_PROGRAM;
    let program = if env::var_os("CARGO_FEATURE_MODELS").is_some() { with_models } else { whole };
    let memories = if is_first { pico_memories(program) } else { pico_2_memories(program) };
    fs::write(folder.join("memory.x"), memories).expect("OUT_DIR can be written");
    // Of every program: one that was left out would link, and be empty.
    println!("cargo:rustc-link-arg-bins=-L{}", folder.display());
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    if is_first {
        println!("cargo:rustc-link-arg-bins=-Tlink-rp.x");
    }
}
