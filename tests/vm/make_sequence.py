"""Makes the frames that the loop test plays: make_sequence.py OUT.gray."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

WIDTH, HEIGHT, FRAMES = 1280, 720, 220
FIRST_LIT = 90
"""Long dark before: three seconds for the program to start in, and 25 frames of baseline."""
FRAMES_PER_COLUMN = 8
"""Five columns in 40 frames: a slide inside the 70 frames of a sample."""
TAXEL, PITCH, LEFT, TOP = 90, 144, 280 + 27, 27
BITS, CELL = 8, 64
"""The frame's number: one black or white cell a bit, down the left edge, where there is no taxel."""


def number(frame: np.ndarray) -> int:
    """Returns the number that a frame carries."""
    return sum(int(frame[CELL * bit + CELL // 2, CELL // 2] > 127) << bit for bit in range(BITS))


def light(t: int, column: int) -> float:
    """Returns a column's light at frame t. It rises and falls over twice the column's part of the slide."""
    middle = FIRST_LIT + FRAMES_PER_COLUMN * (column + 1) - 0.5
    return max(0.0, 1.0 - abs(t - middle) / FRAMES_PER_COLUMN)


def frames():
    """Yields the frames, which are the same in every run."""
    rng = np.random.default_rng(20240501)
    # Outside the taxels the picture is bright and random, so that a wrong corner or size is noticed at once.
    surround = rng.integers(0, 256, (HEIGHT, WIDTH), dtype=np.uint8)
    grain = rng.integers(0, 40, (TAXEL, TAXEL))
    for t in range(FRAMES):
        frame = surround.copy()
        for bit in range(BITS):
            frame[CELL * bit : CELL * (bit + 1), :CELL] = 255 if t >> bit & 1 else 0
        for i in range(5):
            for j in range(5):
                lit = light(t, j) * (120 + 20 * i + np.roll(grain, t + i + j, axis=1))
                # Dark is not black: sometimes a pixel reads 1.
                dark = np.roll(grain, 3 * t + 7 * i + j, axis=0) == 0
                y, x = TOP + PITCH * i, LEFT + PITCH * j
                frame[y : y + TAXEL, x : x + TAXEL] = np.where(lit > 0, lit, dark).astype(np.uint8)
        yield frame


if __name__ == "__main__":
    with Path(sys.argv[1]).open("wb") as out:
        for each in frames():
            out.write(each.tobytes())
