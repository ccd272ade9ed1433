#!/usr/bin/env python3
"""Builds a board that is new to the firmware, as docs/BOARDS.md describes: with a step left out, cargo must say which.

    new_board.py h743    a board with an STM32H743, without its row, without its `[[bin]]`, and for another processor
    new_board.py rp      a board with an RP2040, which must link whole, and builds for other processors
"""

import shutil
import subprocess
import sys

import boards
from boards import FIRMWARE, ROOT

# A program that does nothing: only how it is linked counts.
PROGRAM = """#![no_std]
#![no_main]
use wstac_fw as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    loop {}
}
"""
BIN = """
[[bin]]
name = "new_board"
required-features = ["{}"]
test = false
"""
M0, M4F, M33 = "thumbv6m-none-eabi", "thumbv7em-none-eabihf", "thumbv8m.main-none-eabihf"


def package(feature):
    """Makes a copy of the firmware with a new program, and returns its folder. The crates beside it stay where they are,
    so that they are not built again."""
    copy = boards.folder() / "new-board"
    shutil.rmtree(copy, ignore_errors=True)
    ignore = shutil.ignore_patterns("target", "capi", "examples")
    shutil.copytree(FIRMWARE, copy, ignore=ignore)
    (copy / "src/bin/new_board.rs").write_text(PROGRAM)
    manifest = (FIRMWARE / "Cargo.toml").read_text().replace('path = "../', f'path = "{ROOT}/')
    # The examples are not copied.
    manifest = "\n".join(f"[{part}" for part in manifest.split("\n[") if not part.startswith("[example]"))[1:]
    (copy / "Cargo.toml").write_text(manifest + (BIN.format(feature) if feature else ""))
    return copy


def build(copy, target, features):
    command = [ROOT / "ci/thumb", target, "build", "--quiet", "--locked", "--release", "--no-default-features"]
    command += ["--features", features, "--target-dir", boards.folder(), "--bin", "new_board"]
    return subprocess.run(command, cwd=copy, env=boards.environment(), capture_output=True, text=True, check=False)


def refused(copy, target, features, *expected):
    done = build(copy, target, features)
    missing = [text for text in expected if text not in done.stderr]
    if done.returncode == 0 or missing:
        sys.exit(f"{features} for {target}: expected a build that fails with {missing or expected}, got {done.returncode}: {done.stderr}")
    print(f"{features} for {target}: refused, {expected[0]}", flush=True)


def h743():
    copy = package("h743")
    refused(copy, M4F, "h743", "H743 has no row for the program new_board of Cargo.toml", "step 2 of docs/BOARDS.md")
    refused(copy, M0, "h743", f"found --target {M0}, expected --target {M4F}")
    refused(package(None), M4F, "h743", "no bin target named `new_board`")


def rp():
    copy = package("rp")
    done = build(copy, M0, "rp2040")
    if done.returncode:
        sys.exit(f"a new board with an RP2040 does not build: {done.stderr}")
    elf = boards.folder() / M0 / "release/new_board"
    image = elf.with_suffix(".bin")
    subprocess.run(["arm-none-eabi-objcopy", "-O", "binary", elf, image], check=True)
    flash = image.read_bytes()
    # The second loader of 256 bytes, and then the vectors: the stack's top and the reset.
    stack, reset = (int.from_bytes(flash[at : at + 4], "little") for at in (0x100, 0x104))
    if not any(flash[:0x100]) or not 0x2000_0000 < stack <= 0x2004_2000 or not 0x1000_0100 < reset < 0x1000_0000 + len(flash):
        sys.exit(f"a new board with an RP2040 is not linked as one: {len(flash)} bytes, stack {stack:#x}, reset {reset:#x}")
    print(f"a new board with an RP2040: linked, {len(flash)} bytes with its second loader", flush=True)
    refused(copy, M4F, "rp2040", f"found --target {M4F}, expected --target {M0}")
    refused(copy, M0, "rp2350", f"found --target {M0}, expected --target {M33}")
    refused(copy, M0, "rp2040,h743", "different chips", "--no-default-features")


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["h743"]:
            h743()
        case ["rp"]:
            rp()
        case _:
            sys.exit(__doc__)
