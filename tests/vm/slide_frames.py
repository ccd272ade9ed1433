"""The frames of a slide that the USB camera plays."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

WIDTH, HEIGHT, FRAMES = 320, 240, 150
FIRST_LIT = 40
"""Long dark before: 25 frames of baseline."""
FRAMES_PER_COLUMN = 8
"""Five columns in 40 frames: a slide inside the 70 frames of a sample."""
TAXEL, PITCH, LEFT, TOP = 30, 48, 40 + 9, 9
BITS, CELL = 8, 30
"""The frame's number: one black or white cell a bit, down the left edge, where there is no taxel."""


def light(t: int, column: int) -> float:
    """Returns a column's light at frame t. It rises and falls over twice the column's part of the slide."""
    middle = FIRST_LIT + FRAMES_PER_COLUMN * (column + 1) - 0.5
    return max(0.0, 1.0 - abs(t - middle) / FRAMES_PER_COLUMN)


def frames() -> Iterator[np.ndarray]:
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
