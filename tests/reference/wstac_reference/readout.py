"""When a rolling shutter exposes the rows of a picture (SPEC section 9)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from .constants import COLUMNS, NOMINAL_FPS, ROWS
from .layout import Layout

MOST_PRESS = 0.22
"""Frames from a line to the next. By an unknown readout, light that may be a press's or slower than this is unclear."""
ORDERS = {"down": (1, 1), "up": (1, -1), "right": (0, 1), "left": (0, -1)}
"""Where the sensor's rows follow each other in the picture: the axis, and whether along it."""


@dataclass(frozen=True)
class Readout:
    """Feature frames from a line to the next: of rows and of columns. If unknown, those are half of what is possible."""

    rows: float = 0.0
    columns: float = 0.0
    is_known: bool = True

    def of_light(self, rows: float, columns: float) -> tuple[float, float]:
        """The slownesses of the light whose lines' signals have these."""
        return rows + self.rows, columns + self.columns

    def bounds(self, rows: float, columns: float) -> tuple[float, float]:
        """The least and the most that the slowness of the light may be."""
        if self.is_known:
            return (math.hypot(rows, columns),) * 2
        at = lambda part: math.hypot(rows + part * self.rows, columns + part * self.columns)
        nearest = -(rows * self.rows + columns * self.columns) / (self.rows**2 + self.columns**2)
        return at(min(max(nearest, -1.0), 1.0)), max(at(-1.0), at(1.0))

    def off(self, rows: float, columns: float) -> tuple[float, float]:
        """How far the speed may be off, as a fraction, and the direction in radians."""
        if self.is_known:
            return 0.0, 0.0
        square = rows**2 + columns**2
        along, across = columns * self.columns + rows * self.rows, columns * self.rows - rows * self.columns
        return abs(along) / square, abs(across) / square

    def moves_too_far(self, rows: float, columns: float) -> bool:
        """Whether a velocity may be off by more than a reliable one."""
        speed, direction = self.off(rows, columns)
        return speed > 0.09 or direction > 0.157


GLOBAL = Readout()


def readout(ms: float | None, order: str, layout: Layout, frame: tuple[int, int], fps: float = NOMINAL_FPS) -> Readout:
    """The readout of a picture of this size whose rows take `ms` milliseconds; None is unknown."""
    axis, sign = ORDERS[order]
    numbers = [(k // COLUMNS - ROWS // 2, k % COLUMNS - COLUMNS // 2) for k in range(ROWS * COLUMNS)]
    frames = 0.5 if ms is None else ms / 1000 * fps
    slope = lambda of: sum(line[of] * corner[axis] for line, corner in zip(numbers, layout.corners)) / (50 * frame[axis])
    return Readout(sign * frames * slope(0), sign * frames * slope(1), ms is not None)


def least_press(fps: float) -> float:
    """The slowness below which light is a press: above 1,200 mm/s, or more where frames last less than at 30 per second."""
    return 0.1 * min(fps / NOMINAL_FPS, 1.0)


def contact(rows: float, columns: float, of: Readout, fps: float) -> str:
    """What slownesses of the light along both axes are."""
    least, most = of.bounds(rows, columns)
    if least > 13 or (not of.is_known and least < 0.17 and most >= MOST_PRESS):
        return "unclear"
    return "press" if least < least_press(fps) else "unclear" if least < 0.17 else "slide"
