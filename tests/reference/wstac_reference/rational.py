"""Rounds rational numbers exactly, with one rule everywhere: nearest with ties up."""

from __future__ import annotations

import math
from fractions import Fraction

HALF = Fraction(1, 2)


def round_half_up(value: Fraction | int | float) -> int:
    """Returns the nearest integer of an exactly represented number, with ties toward plus infinity."""
    return math.floor(Fraction(value) + HALF)


def ceil_div(a: int, b: int) -> int:
    """Returns the smallest integer not below a / b, for b > 0."""
    return -(-a // b)


def fixed16(value: float) -> Fraction:
    """Returns a parameter as it is stored: rounded to 16 fraction bits, nearest (*decided*)."""
    return Fraction(round_half_up(Fraction(value) * 65536), 65536)
