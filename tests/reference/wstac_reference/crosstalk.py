"""Cross-talk between taxels, taken out by the inverse of a matrix (SPEC §9), in exact arithmetic."""

from __future__ import annotations

from fractions import Fraction

from .constants import TAXELS
from .rational import round_half_up

ONE = 1 << 13
"""The weight 1."""
MOST = 32_767
"""Largest sum of the absolute weights of a taxel."""
FULL = 65_535


def inverse_of(matrix: list[list[Fraction]]) -> list[list[Fraction]] | None:
    """The exact inverse; None if there is none."""
    size = len(matrix)
    rows = [[*row, *(Fraction(at == number) for at in range(size))] for number, row in enumerate(matrix)]
    for column in range(size):
        pivot = next((number for number in range(column, size) if rows[number][column] != 0), None)
        if pivot is None:
            return None
        rows[column], rows[pivot] = rows[pivot], rows[column]
        rows[column] = [value / rows[column][column] for value in rows[column]]
        for number, row in enumerate(rows):
            if number != column and row[column] != 0:
                rows[number] = [value - row[column] * own for value, own in zip(row, rows[column])]
    return [row[size:] for row in rows]


def weights_of(inverse: list[list[Fraction]] | None) -> list[list[int]] | None:
    """The weights of a correction; None if there is no inverse, or if it raises noise too much."""
    if inverse is None:
        return None
    weights = [[round_half_up(value * ONE) for value in row] for row in inverse]
    return weights if all(sum(map(abs, row)) <= MOST for row in weights) else None


def corrected(weights: list[list[int]], light: list[int]) -> list[int]:
    """A frame of the ring without cross-talk."""
    assert len(light) == TAXELS
    sums = [sum(weight * value for weight, value in zip(row, light)) for row in weights]
    assert all(abs(total) + ONE // 2 < 1 << 31 for total in sums), "a sum does not fit 32 bits"
    return [min(max(round_half_up(Fraction(total, ONE)), 0), FULL) for total in sums]
