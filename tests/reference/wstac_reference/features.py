"""Turns 25 sums into 10 features: the logarithm of each row's and column's brightness."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .constants import COLUMNS, FEATURE_MIN, ROWS, UNIT


def row_and_column_sums(sums: Sequence[int]) -> list[int]:
    """Returns R_1..R_10: the five row sums, then the five column sums."""
    rows = [sum(sums[i * COLUMNS : (i + 1) * COLUMNS]) for i in range(ROWS)]
    columns = [sum(sums[j::COLUMNS]) for j in range(COLUMNS)]
    return rows + columns


def nearest(value: float) -> int:
    """Returns floor(value + 1/2). Refuses a value that is too near a tie for float64 to decide."""
    shifted = value + 0.5
    if abs(shifted - round(shifted)) < 1e-8:
        raise ArithmeticError(f"{value!r} is too near a tie")
    return math.floor(shifted)


def log_ratio(r: int, full: int) -> int:
    """Returns 2048 (ln r - ln full), rounded to the nearest integer, at least -32768; r >= 1."""
    return max(nearest(UNIT * (math.log(r) - math.log(full))), FEATURE_MIN)


def floor_feature(full_scale: int, full: int, floor_levels: float) -> int:
    """Returns the feature of darkness.

    It is 2048 ln(5 floor_levels / G), rounded to the nearest. For floor_levels = 0 it is the feature of one raw count
    (*decided*: a count in the whole row, R = 1). It is never below -32768.
    """
    if floor_levels < 0:
        raise ValueError(f"floor_levels {floor_levels}")
    if floor_levels == 0:
        return log_ratio(1, full)
    return max(nearest(UNIT * math.log(5 * floor_levels / full_scale)), FEATURE_MIN)


class Features:
    """Computes features of frames with full scale G, A pixels per taxel, and n frames added up."""

    def __init__(self, full_scale: int, pixels: int, floor_levels: float = 0.5, added: int = 1) -> None:
        self.full = full_scale * pixels * added
        self.floor = floor_feature(full_scale, self.full, floor_levels)
        self._known: dict[int, int] = {0: self.floor}

    def of(self, r: Sequence[int]) -> list[int]:
        """Returns the 10 features of the 10 sums R. R = 0 is below every floor (*decided*)."""
        return [self._one(value) for value in r]

    def _one(self, r: int) -> int:
        if r not in self._known:
            self._known[r] = max(log_ratio(r, self.full), self.floor)
        return self._known[r]


def taxel_features(frame: Sequence[Sequence[int]], full: int, floor: int) -> list[int]:
    """Returns the logarithms of 25 taxels of a feature frame: of the sums of each of its camera frames, kept in 16 bits.

    `full` and `floor` are those of the ten features.
    """
    dropped = max(full.bit_length() - 16, 0)
    light = [min(sum(one >> dropped for one in sums), 0xFFFF) << dropped for sums in zip(*frame, strict=True)]
    least = max(floor - nearest(UNIT * math.log(5)), FEATURE_MIN)
    return [max(log_ratio(one, full), least) if one else least for one in light]
