"""Light on 25 taxels over time, in integers: the signal of a slide over the whiskers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wstac_reference.constants import COLUMNS, ROWS, TAXELS
from wstac_reference.rng import SplitMix64

Order = Callable[[int, int], int]
"""From row and column (0..4) to how late a taxel lights up, in steps."""

ORDERS: dict[str, Order] = {
    "0deg": lambda i, j: j,
    "180deg": lambda i, j: 4 - j,
    "90deg": lambda i, j: 4 - i,
    "270deg": lambda i, j: i,
    "press": lambda i, j: 0,
}


@dataclass(frozen=True)
class Slide:
    """A slide: the first taxel peaks at frame `start`, and the others `step` frames apart.

    Light rises over `rise` frames to `peak` levels and falls over `fall` frames.
    `only` limits it to some taxels (row, column).
    """

    start: int
    order: Order = ORDERS["0deg"]
    step: int = 7
    rise: int = 4
    fall: int = 6
    peak: int = 500
    only: Callable[[int, int], bool] = lambda i, j: True

    def add_to(self, levels: np.ndarray) -> None:
        """Adds this slide's light to levels[frame, taxel]."""
        time = np.arange(len(levels))
        for i in range(ROWS):
            for j in range(COLUMNS):
                if not self.only(i, j):
                    continue
                late = time - self.start - self.step * self.order(i, j)
                rising = self.peak * (self.rise + late) // self.rise
                falling = self.peak * (self.fall - late) // self.fall
                levels[:, i * COLUMNS + j] += np.maximum(np.minimum(rising, falling), 0)


def light(
    rng: SplitMix64, frames: int, slides: tuple[Slide, ...] = (), base: int = 20, shake: int = 2
) -> np.ndarray:
    """Returns levels[frame, taxel]: a dark base with uniform noise of +-shake, and the slides."""
    levels = np.full((frames, TAXELS), base, dtype=np.int64)
    levels += rng.below(2 * shake + 1, (frames, TAXELS)) - shake
    for slide in slides:
        slide.add_to(levels)
    return np.maximum(levels, 0)
