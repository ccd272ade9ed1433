#!/usr/bin/env python3
"""Runs a texture model on an emulated Cortex-M4 (QEMU's mps2-an386), and measures its answers and its cost.

    board.py                           checks that every kind of model answers there as on a host, and on a Cortex-M3
    board.py FILE SAMPLES [CLASSES]

FILE is a model file (.wsm), a Rust file (.rs) with `pub fn classify(sample: &[i16; 700]) -> u8`, or an object file (.o)
with C's `int classify(const int16_t *sample)`. SAMPLES has int16, 700 per sample, frame by frame. The classes go to
CLASSES, one byte each. Instructions are exact, because the emulator counts them. An instruction is not a cycle.
"""

import struct
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "firmware"))
import boards  # noqa: E402 (it is in the folder above)

INPUTS = 700
TICK = 40  # instructions per tick: the timer has 25 MHz, and an instruction takes a nanosecond
VARIABLES = {".wsm": "M4_MODEL", ".rs": "M4_RUST", ".o": "M4_C"}
# On a Cortex-M3, without packed multiply-accumulate, weighted sums are added up the plain way.
_, M3, M4, _ = boards.BOARDS


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
    variables = {VARIABLES[Path(file).suffix]: str(Path(file).resolve())} if file else {}
    boards.release(board.target, "--bin", program, where=HERE, variables=variables, check=True)
    return boards.folder() / board.target / "release" / program


def measure(file, samples):
    """Returns the cost of a model on samples: bytes of int16, 700 per sample."""
    elf = build()
    empty = boards.sizes(elf).flash
    elf = build(file)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "samples").write_bytes(samples)
        boards.run(M4, elf, folder)
        answers = list(struct.iter_unpack("<4I", (Path(folder) / "answers").read_bytes()))
    if len(answers) != len(samples) // (2 * INPUTS) or not answers:
        sys.exit(f"board.py: {len(answers)} answers to {len(samples) / (2 * INPUTS)} samples")
    # The empty call takes less than a tick, so only its mean over all samples is known.
    call = sum(empty for _, _, _, empty in answers) / sum(repeats for _, repeats, _, _ in answers)
    took = [(busy / repeats - call) * TICK for _, repeats, busy, _ in answers]
    classes = bytes(answer for answer, *_ in answers)
    return Cost(classes, sum(took) / len(took), round(max(took)), boards.sizes(elf).flash - empty)


def agree(board):
    """Runs random models of every kind. The board must answer as a host does."""
    with tempfile.TemporaryDirectory() as folder:
        boards.run(board, build(program="agree", board=board), folder)
    print(f"{board.core}: the models of tests/random_models answer as on a host")


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
