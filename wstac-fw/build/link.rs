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
    write(out, if microbit { MICROBIT } else { MPS2 });
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg=-Tlink.x");
}

/// The boards with an STM32: the program, where its flash begins, how many KiB it may have, and the other memories. It
/// ends in front of the settings, which begin at 0x08180000. With the feature `models`, it ends in front of the models,
/// at 0x08100000.
///
/// The OpenMV Cam H7 and the Nicla Vision have a bootloader of 128 KiB and a file system of 128 KiB in front of it.
pub const STM32: &[(&str, u32, u32, &str)] = &[
    ("h743", 0x0800_0000, 1536, H743),
    ("openmv_cam_h7", 0x0804_0000, 1280, H743),
    ("weact_h743", 0x0800_0000, 1536, H743),
    ("nicla_vision", 0x0804_0000, 1280, H747),
    ("nucleo_u575zi_q", 0x0800_0000, 1536, U575),
];

/// The memories of an STM32H743 besides its flash. Variables and stack are in the core's own RAM (DTCM), which takes no
/// cycles to wait; the DMA does not reach that, and a bootloader has its own variables there. So the ring and the crash
/// record are in the AXI SRAM.
const H743: &str = "RAM : ORIGIN = 0x20000000, LENGTH = 128K AXI : ORIGIN = 0x24000000, LENGTH = 512K }
SECTIONS { .axi (NOLOAD) : ALIGN(8) { *(.uninit.ring .uninit.crash_record); } > AXI } INSERT BEFORE .uninit;\n";
/// Those of an STM32H747, whose bootloader has its variables in the AXI SRAM: the crash record is in SRAM4.
const H747: &str = "RAM : ORIGIN = 0x20000000, LENGTH = 128K AXI : ORIGIN = 0x24000000, LENGTH = 512K
SRAM4 : ORIGIN = 0x38000000, LENGTH = 64K }
SECTIONS { .axi (NOLOAD) : ALIGN(8) { *(.uninit.ring); } > AXI
.sram4 (NOLOAD) : ALIGN(8) { *(.uninit.crash_record); } > SRAM4 } INSERT BEFORE .uninit;\n";
/// Those of an STM32U575, where the DMA reaches all RAM.
const U575: &str = "RAM : ORIGIN = 0x20000000, LENGTH = 768K }\n";

/// Links the programs for boards with an STM32.
pub fn stm32(out: &Path) {
    if env::var_os("CARGO_FEATURE_STM32").is_none() {
        return;
    }
    let has_models = env::var_os("CARGO_FEATURE_MODELS").is_some();
    for (program, begin, length, memories) in STM32 {
        let length = length - if has_models { 512 } else { 0 };
        let folder = out.join(program);
        let memory = format!("MEMORY {{ FLASH : ORIGIN = {begin:#x}, LENGTH = {length}K {memories}");
        write(&folder, &memory);
        println!("cargo:rustc-link-arg-bin={program}=-L{}", folder.display());
    }
    // Of every program, so that one without a row does not link: it would be empty. `check.rs` says so before.
    link_bins(&["--nmagic", "-Tlink.x", "-Tdefmt.x"]);
}

/// The KiB of a program for a Raspberry Pi Pico or Pico 2. It ends in front of the settings, which begin at 0x101FE000.
/// With the feature `models`, it ends in front of the models, at 0x10100000.
const PICO_PROGRAM: [u32; 2] = [2040, 1024];
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
    let [whole, with_models] = PICO_PROGRAM;
    let program = if env::var_os("CARGO_FEATURE_MODELS").is_some() { with_models } else { whole };
    // Of a Pico, the second boot loader comes first.
    let memories = if is_first {
        format!(
            "MEMORY {{ BOOT2 : ORIGIN = 0x10000000, LENGTH = 0x100 \
             FLASH : ORIGIN = 0x10000100, LENGTH = {program}K - 0x100 RAM : ORIGIN = 0x20000000, LENGTH = 264K }}\n"
        )
    } else {
        format!(
            "MEMORY {{ FLASH : ORIGIN = 0x10000000, LENGTH = {program}K RAM : ORIGIN = 0x20000000, LENGTH = 512K }}\n{PICO_2}"
        )
    };
    write(&folder, &memories);
    // Of every program: one that was left out would link, and be empty.
    println!("cargo:rustc-link-arg-bins=-L{}", folder.display());
    link_bins(&["--nmagic", "-Tlink.x", "-Tdefmt.x"]);
    if is_first {
        link_bins(&["-Tlink-rp.x"]);
    }
}

/// Writes a program's memories.
fn write(folder: &Path, memories: &str) {
    fs::create_dir_all(folder).expect("OUT_DIR can be written");
    fs::write(folder.join("memory.x"), memories).expect("OUT_DIR can be written");
}

fn link_bins(arguments: &[&str]) {
    for argument in arguments {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
