#!/usr/bin/env python3
"""Runs a texture model on an emulated Cortex-M4 (QEMU's mps2-an386), and measures its answers and its cost.

    board.py                           checks that every kind of model answers there as on a host, and on a Cortex-M3
    board.py FILE SAMPLES [CLASSES]

FILE is a model file (.wsm), a Rust file (.rs) with `pub fn classify(sample: &[i16; 700]) -> u8`, or an object file (.o)
with C's `int classify(const int16_t *sample)`. SAMPLES has int16, 700 per sample, frame by frame. The classes go to
CLASSES, one byte each. Instructions are exact, because the emulator counts them. An instruction is not a cycle.
"""

import os
import struct
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
INPUTS = 700
TICK = 40  # instructions per tick, as in src/clock.rs
VARIABLES = {".wsm": "M4_MODEL", ".rs": "M4_RUST", ".o": "M4_C"}
QEMU = "qemu-system-arm -nographic -monitor none -serial none -icount shift=0"


@dataclass(frozen=True)
class Board:
    """A processor, Rust's name of its target, and QEMU's name of a board with it. memory.x has its memory."""

    processor: str
    target: str
    machine: str


M4 = Board("Cortex-M4", "thumbv7em-none-eabihf", "mps2-an386")
# Without packed multiply-accumulate, weighted sums are added up the plain way.
M3 = Board("Cortex-M3", "thumbv7m-none-eabi", "mps2-an385")


@dataclass
class Cost:
    """The cost of a model on the board."""

    classes: bytes  # one per sample
    mean: float  # instructions per answer
    most: int  # of all samples, to within 4 or one in 2,500
    flash: int  # bytes of code and constants that the model adds to a program


def build(file=None, program="measure", board=M4):
    """Builds a program with a model, or without one. Returns its ELF, which is valid until the next build for this
    board.
    """
    environment = {name: value for name, value in os.environ.items() if name not in VARIABLES.values()}
    environment["RUSTFLAGS"] = "-C link-arg=-Tlink.x"
    if file is not None:
        environment[VARIABLES[Path(file).suffix]] = str(Path(file).resolve())
    folder = Path(environment.get("CARGO_TARGET_DIR", HERE / "../../target")).resolve() / "m4"
    options = ["--quiet", "--locked", "--release", "--target-dir", folder, "--bin", program]
    subprocess.run([HERE / "../../ci/tool", "thumb", board.target, "build", *options], cwd=HERE, env=environment, check=True)
    return folder / board.target / "release" / program


def run(elf, folder, seconds=600, board=M4):
    """Runs a program until it ends. Its files are in the folder."""
    how = ["-M", board.machine, "-semihosting-config", "enable=on,target=native", "-kernel", str(Path(elf).resolve())]
    done = subprocess.run([*QEMU.split(), *how], cwd=folder, stdin=subprocess.DEVNULL, timeout=seconds, check=False)
    if done.returncode:
        sys.exit(f"board.py: the program on the {board.processor} failed ({done.returncode})")


def flash(elf):
    """Returns the bytes of an ELF in flash: its sections with contents, below the RAM, that are in the memory image."""
    data = Path(elf).read_bytes()
    offset, size, count = struct.unpack_from("<I", data, 32)[0], *struct.unpack_from("<HH", data, 46)
    bits, loaded, memory = 1, 2, 0
    for header in range(offset, offset + size * count, size):
        _, kind, flags, _, _, length = struct.unpack_from("<6I", data, header)
        memory += length if kind == bits and flags & loaded or kind == 0x70000001 else 0
    return memory


def measure(file, samples):
    """Returns the cost of a model on samples: bytes of int16, 700 per sample."""
    elf = build()
    empty = flash(elf)
    elf = build(file)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "samples").write_bytes(samples)
        run(elf, folder)
        answers = list(struct.iter_unpack("<4I", (Path(folder) / "answers").read_bytes()))
    if len(answers) != len(samples) // (2 * INPUTS) or not answers:
        sys.exit(f"board.py: {len(answers)} answers to {len(samples) / (2 * INPUTS)} samples")
    # The empty call takes less than a tick, so only its mean over all samples is known.
    call = sum(empty for _, _, _, empty in answers) / sum(repeats for _, repeats, _, _ in answers)
    took = [(busy / repeats - call) * TICK for _, repeats, busy, _ in answers]
    classes = bytes(answer for answer, *_ in answers)
    return Cost(classes, sum(took) / len(took), round(max(took)), flash(elf) - empty)


def agree(board):
    """Runs random models of every kind. The board must answer as a host does."""
    with tempfile.TemporaryDirectory() as folder:
        run(build(program="agree", board=board), folder, board=board)
    print(f"{board.processor}: the models of tests/random_models answer as on a host")


if __name__ == "__main__":
    if len(sys.argv) == 1:
        agree(M4)
        agree(M3)
        sys.exit()
    if len(sys.argv) not in (3, 4) or Path(sys.argv[1]).suffix not in VARIABLES:
        sys.exit(__doc__)
    cost = measure(sys.argv[1], Path(sys.argv[2]).read_bytes())
    if len(sys.argv) == 4:
        Path(sys.argv[3]).write_bytes(cost.classes)
    print(f"{len(cost.classes)} samples, instructions: mean {cost.mean:.1f}, most {cost.most}; flash: {cost.flash} bytes")
