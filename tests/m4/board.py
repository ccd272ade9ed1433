#!/usr/bin/env python3
"""Runs a texture model on an emulated Cortex-M4 (QEMU's mps2-an386): what it answers, and at what cost.

    board.py                           checks that every kind of model answers there as on a host
    board.py FILE SAMPLES [CLASSES]

FILE is a model file (.wsm), a Rust file (.rs) with `pub fn classify(sample: &[i16; 700]) -> u8`, or an object file (.o) with C's
`int classify(const int16_t *sample)`. SAMPLES holds int16, 700 a sample, frame by frame; the classes go to CLASSES, a byte each.
Instructions are exact: the emulator counts them. An instruction is not a cycle.
"""

import os
import shutil
import struct
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
TARGET = "thumbv7em-none-eabihf"
INPUTS = 700
TICK = 40  # instructions, as src/clock.rs has it
VARIABLES = {".wsm": "M4_MODEL", ".rs": "M4_RUST", ".o": "M4_C"}
QEMU = "qemu-system-arm -M mps2-an386 -nographic -monitor none -serial none -icount shift=0"


@dataclass
class Cost:
    """What one model cost on the board."""

    classes: bytes  # one a sample
    mean: float  # instructions an answer
    most: int  # of all samples, to within 4 or one in 2,500
    flash: int  # bytes of code and constants that the model adds to a program


def text_of(*command, **more):
    return subprocess.run(command, capture_output=True, text=True, check=True, **more).stdout


def cargo():
    """Cargo's arguments and environment: with rustup's target, or else with Debian's rustc and core's own source."""
    environment = {name: value for name, value in os.environ.items() if name not in VARIABLES.values()}
    flags = ["build", "--quiet", "--locked", "--release", "--target", TARGET]
    environment["RUSTFLAGS"] = "-C link-arg=-Tlink.x"
    rustup = shutil.which("rustup")
    if rustup and TARGET in text_of(rustup, "target", "list", "--installed", cwd=HERE).split():
        return flags, environment
    linkers = list(Path(text_of("rustc", "--print", "sysroot", cwd=HERE).strip()).glob("lib/rustlib/*/bin/rust-lld"))
    if not linkers or not Path("/usr/lib/rustlib/src").exists():
        sys.exit(f"board.py: no compiler for {TARGET}: ci/setup test installs one")
    environment |= {"RUSTC": "/usr/bin/rustc", "RUSTC_BOOTSTRAP": "1"}
    environment["RUSTFLAGS"] += f" -C linker={linkers[0]}"
    return [*flags, "-Zbuild-std=core,compiler_builtins", "-Zbuild-std-features=compiler-builtins-mem"], environment


def build(file=None, program="measure"):
    """Builds a program with a model, or with none; its ELF, valid until the next build."""
    flags, environment = cargo()
    if file is not None:
        environment[VARIABLES[Path(file).suffix]] = str(Path(file).resolve())
    folder = Path(environment.get("CARGO_TARGET_DIR", HERE / "../../target")).resolve() / "m4"
    subprocess.run(["cargo", *flags, "--target-dir", folder, "--bin", program], cwd=HERE, env=environment, check=True)
    return folder / TARGET / "release" / program


def run(elf, folder, seconds=600):
    """Runs a program until it ends; its files are in the folder."""
    how = ["-semihosting-config", "enable=on,target=native", "-kernel", str(Path(elf).resolve())]
    done = subprocess.run([*QEMU.split(), *how], cwd=folder, stdin=subprocess.DEVNULL, timeout=seconds, check=False)
    if done.returncode:
        sys.exit(f"board.py: the program on the board failed ({done.returncode})")


def flash(elf):
    """Bytes of an ELF that lie in flash: its sections with contents, below the RAM and of the memory image."""
    data = Path(elf).read_bytes()
    offset, size, count = struct.unpack_from("<I", data, 32)[0], *struct.unpack_from("<HH", data, 46)
    bits, loaded, memory = 1, 2, 0
    for header in range(offset, offset + size * count, size):
        _, kind, flags, _, _, length = struct.unpack_from("<6I", data, header)
        memory += length if kind == bits and flags & loaded or kind == 0x70000001 else 0
    return memory


def measure(file, samples):
    """The cost of a model on samples: bytes of int16, 700 a sample."""
    elf = build()
    empty = flash(elf)
    elf = build(file)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "samples").write_bytes(samples)
        run(elf, folder)
        answers = list(struct.iter_unpack("<4I", (Path(folder) / "answers").read_bytes()))
    if len(answers) != len(samples) // (2 * INPUTS) or not answers:
        sys.exit(f"board.py: {len(answers)} answers to {len(samples) / (2 * INPUTS)} samples")
    # The empty call takes less than a tick: its mean over all samples is what is known of it.
    call = sum(empty for _, _, _, empty in answers) / sum(repeats for _, repeats, _, _ in answers)
    took = [(busy / repeats - call) * TICK for _, repeats, busy, _ in answers]
    classes = bytes(answer for answer, *_ in answers)
    return Cost(classes, sum(took) / len(took), round(max(took)), flash(elf) - empty)


def agree():
    """Runs models of every kind by chance: the board must answer as a host does."""
    with tempfile.TemporaryDirectory() as folder:
        run(build(program="agree"), folder)


if __name__ == "__main__":
    if len(sys.argv) == 1:
        agree()
        print("board: the models of tests/src/random_models.rs answer as on a host")
        sys.exit()
    if len(sys.argv) not in (3, 4) or Path(sys.argv[1]).suffix not in VARIABLES:
        sys.exit(__doc__)
    cost = measure(sys.argv[1], Path(sys.argv[2]).read_bytes())
    if len(sys.argv) == 4:
        Path(sys.argv[3]).write_bytes(cost.classes)
    print(f"{len(cost.classes)} samples, instructions: mean {cost.mean:.1f}, most {cost.most}; flash: {cost.flash} bytes")
