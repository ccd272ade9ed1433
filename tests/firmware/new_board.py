#!/usr/bin/env python3
"""Builds a board that is new to the firmware, as docs/BOARDS.md describes. One with an RP2040 must link whole; a step
that is left out, or another target, must be refused with a message that says what is missing.

The build script alone refuses: it is run as cargo runs it, without building what a refused program would need.
"""

import json
import shutil
import subprocess
import sys
import tempfile

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
    # The copies are new, so that cargo builds what has changed.
    shutil.copytree(FIRMWARE, copy, ignore=ignore, copy_function=shutil.copy)
    (copy / "src/bin/new_board.rs").write_text(PROGRAM)
    manifest = (FIRMWARE / "Cargo.toml").read_text().replace('path = "../', f'path = "{ROOT}/')
    # The examples are not copied.
    manifest = "\n".join(f"[{part}" for part in manifest.split("\n[") if not part.startswith("[example]"))[1:]
    (copy / "Cargo.toml").write_text(manifest + (BIN.format(feature) if feature else ""))
    return copy


def records(copy, *command):
    """Runs cargo for the copy, and returns the records that it prints."""
    done = subprocess.run(command, cwd=copy, env=boards.environment(), stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        sys.exit(f"a new board: {command[0]} failed ({done.returncode})")
    return [json.loads(line) for line in done.stdout.splitlines()]


def build(copy):
    """Builds the new program for an RP2040. Returns its path, and that of the build script."""
    named = ["--features", "rp2040", "--bin", "new_board", "--target-dir", boards.folder(), "--message-format", "json"]
    found = records(copy, ROOT / "ci/tool", "thumb", M0, "build", "--quiet", "--locked", "--release", "--no-default-features", *named)
    # Those of the copy.
    own = [one for one in found if one["reason"] == "compiler-artifact" and one["manifest_path"] == str(copy / "Cargo.toml")]
    program = next(one["executable"] for one in own if one["target"]["name"] == "new_board")
    script = next(one["filenames"][0] for one in own if one["target"]["kind"] == ["custom-build"])
    return program, script


def linked(elf):
    """Checks that a program for an RP2040 has its second loader, and vectors behind it."""
    with tempfile.NamedTemporaryFile() as image:
        subprocess.run(["arm-none-eabi-objcopy", "-O", "binary", elf, image.name], check=True)
        flash = image.read()
    # The second loader of 256 bytes, and then the vectors: the stack's top and the reset.
    stack, reset = (int.from_bytes(flash[at : at + 4], "little") for at in (0x100, 0x104))
    if not any(flash[:0x100]) or not 0x2000_0000 < stack <= 0x2004_2000 or not 0x1000_0100 < reset < 0x1000_0000 + len(flash):
        sys.exit(f"a new board with an RP2040 is not linked as one: {len(flash)} bytes, stack {stack:#x}, reset {reset:#x}")
    print(f"a new board with an RP2040: linked, {len(flash)} bytes with its second loader", flush=True)


def says(copy, script, target, *features, **variables):
    """Returns the errors of the build script for these features and this target."""
    on = {f"CARGO_FEATURE_{feature.upper()}": "1" for feature in features}
    with tempfile.TemporaryDirectory() as out:
        variables = boards.environment() | on | {"TARGET": target, "OUT_DIR": out} | variables
        done = subprocess.run([script], cwd=copy, env=variables, capture_output=True, text=True, check=True)
    errors = [line.partition("=")[2] for line in done.stdout.splitlines() if line.startswith("cargo::error=")]
    return " ".join(errors)


def refused(text, *expected):
    if missing := [one for one in expected if one not in text]:
        sys.exit(f"expected a build that is refused with {missing}, got {text!r}")
    print(f"refused: {text}", flush=True)


def taken(text):
    if text:
        sys.exit(f"expected a build that is not refused, got {text!r}")


def main():
    copy = package("rp")
    elf, script = build(copy)
    linked(elf)
    # Every chip, on its target and on another one.
    chips = ("rp2040", M0, M4F), ("rp2350", M33, M0), ("h743", M4F, M33), ("h747", M4F, M33), ("u575", M4F, M33)
    for chip, own, other in chips:
        features = [chip, "rp" if chip.startswith("rp") else "stm32", "node"]
        taken(says(copy, script, own, *features))
        refused(says(copy, script, other, *features), f"the feature {chip} is", f"found --target {other}, expected --target {own}")
    refused(says(copy, script, M0, "rp2040", "rp", "h743"), "of different chips", "--no-default-features")
    refused(says(copy, script, M0, "rp"), "the feature rp is no chip")
    refused(says(copy, script, M4F, "stm32"), "the feature stm32 is no chip")
    # Clocks that are too slow for something, and a rest that leaves too few frames.
    pico = ("rp2040", "rp", "node")
    taken(says(copy, script, M0, *pico, WSTAC_MHZ="48", WSTAC_REST="60"))
    taken(says(copy, script, M0, *pico, "usb", WSTAC_MHZ="72"))
    refused(says(copy, script, M0, *pico, "usb", WSTAC_MHZ="48"), 'WSTAC_MHZ is "48"', "RP2040-E16")
    refused(says(copy, script, M0, *pico, WSTAC_MHZ="24"), 'WSTAC_MHZ is "24", expected the MHz of the core, 120, 72 or 48')
    refused(says(copy, script, M33, "rp2350", "rp", "node", WSTAC_MHZ="48"), 'WSTAC_MHZ is "48", which only a Pico and an STM32U575 have')
    u575 = ("u575", "stm32", "node")
    taken(says(copy, script, M4F, *u575, WSTAC_MHZ="24"))
    refused(says(copy, script, M4F, *u575, WSTAC_MHZ="48"), 'WSTAC_MHZ is "48", expected the MHz of the core, 72 or 24')
    refused(says(copy, script, M4F, *u575, "usb"), "the feature usb")
    refused(says(copy, script, M4F, "emulated", WSTAC_REST="60"), "WSTAC_REST needs an HM01B0")
    refused(says(copy, script, M0, *pico, WSTAC_REST="4"), 'WSTAC_REST is "4", expected whole seconds without light, 5 to 3600')
    refused(says(copy, script, M0, *pico, WSTAC_REST="0"), 'WSTAC_REST is "0", expected whole seconds without light, 5 to 3600')
    refused(says(copy, script, M0, *pico, WSTAC_MHZ="48", WSTAC_FPS="60"), 'WSTAC_MHZ is "48", too slow for WSTAC_FPS=60')
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as late:
        print("[trigger]\nbacktrack = 9", file=late, flush=True)
        refused(says(copy, script, M0, *pico, WSTAC_REST="60", WSTAC_CONFIG=late.name), "[trigger] backtrack is 9, with which WSTAC_REST")
        taken(says(copy, script, M0, *pico, WSTAC_CONFIG=late.name))
    refused(says(copy, script, M0, *pico, "motion", WSTAC_REST="60"), "WSTAC_REST leaves too few frames for the feature motion")
    # A board with an STM32H743 without its row.
    copy = package("h743")
    refused(says(copy, script, M4F, "h743", "stm32", "node"), "link.rs: STM32 has no row for the program new_board of Cargo.toml", "step 2 of docs/BOARDS.md")
    # Where a relative name starts is said of relative names alone.
    for name in "no.toml", "/no/such.toml":
        text = says(copy, script, M0, "emulated", WSTAC_CONFIG=name)
        refused(text, f"WSTAC_CONFIG={name}: ")
        if ("relative names are from wstac-fw" in text) != (name == "no.toml"):
            sys.exit(f"only relative names start somewhere: {text!r}")
    # Without a `[[bin]]` there is no program.
    (metadata,) = records(package(None), "cargo", "metadata", "--quiet", "--no-deps", "--offline", "--format-version", "1")
    if any(target["name"] == "new_board" for package in metadata["packages"] for target in package["targets"]):
        sys.exit("a program without a [[bin]] is built, and nothing says what it needs")


if __name__ == "__main__":
    main()
