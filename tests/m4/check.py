#!/usr/bin/env python3
"""Checks that models answer on the emulated Cortex-M4 as on the host.

    check.py WSTAC MODEL.wsm…    the command that answers on the host; needs NumPy (`ci/tool python`)
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy

import board

SAMPLES = 300
LOW, HIGH = -9471, 3296  # the range of features


def samples():
    """Returns random samples over the whole range, a third of them near silence; samples at both ends; and samples of a
    single number.
    """
    random = numpy.random.default_rng(4)
    drawn = random.integers(LOW, HIGH, (SAMPLES, 10, 70), endpoint=True, dtype=numpy.int16)
    drawn[: SAMPLES // 3] //= 16
    drawn[0], drawn[1], drawn[2] = LOW, HIGH, 0
    return drawn


def on_host(wstac, model, data):
    """Returns the command's answers, as numbers of classes."""
    labels = json.loads(subprocess.check_output([wstac, "model", "inspect", "--json", model]))["labels"]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "data.npz"
        numpy.savez(file, X=data)
        said = json.loads(subprocess.check_output([wstac, "model", "eval", model, file, "--json"]))
    return [labels.index(label) for label in said["predictions"]]


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    data = samples()
    by_frame = numpy.ascontiguousarray(data.transpose(0, 2, 1)).astype("<i2").tobytes()
    different = 0
    for model in sys.argv[2:]:
        cost = board.measure(model, by_frame)
        expected = on_host(sys.argv[1], model, data)
        apart = sum(got != want for got, want in zip(cost.classes, expected, strict=True))
        different += apart
        how_many = f"{len(set(expected))} classes among {len(expected)} answers, {apart} not the host's"
        print(f"{model}: {how_many}; {cost.mean:,.0f} instructions, {cost.flash:,} bytes of flash")
    sys.exit(1 if different else 0)


if __name__ == "__main__":
    main()
