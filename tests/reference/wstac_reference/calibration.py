"""How sure an answer is, and whether a sample is known (SPEC §6): from the bytes of a linear model file.

Sums are exact integers. Probabilities are float64, so they differ from the core's by its rounding.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

HEADER_HALVES = 16
LARGEST_DIFFERENCE = 8191


@dataclass(frozen=True)
class Answer:
    """The answer for a sample: the class, the probability of every class, and the squared distance from its mean."""

    place: int
    probabilities: list[float]
    distance: int | None
    known: bool | None


def halves_of(data: bytes) -> tuple[int, ...]:
    """Returns a file's halves."""
    return struct.unpack(f"<{len(data) // 2}H", data)


def long(halves: tuple[int, ...], at: int) -> int:
    """Returns the 32 bits of two halves."""
    return halves[at] | halves[at + 1] << 16


def signed(value: int, bits: int) -> int:
    """Returns a number in two's complement."""
    return value - (1 << bits) if value >> (bits - 1) else value


def rows_of(halves: tuple[int, ...], at: int, rows: int, inputs: int) -> list[tuple[int, list[int]]]:
    """Returns bias and int16 weights of every row; the pairs of the rows of a block of two take turns."""
    biases = [signed(sum(halves[at + 4 * row + k] << (16 * k) for k in range(4)), 64) for row in range(rows)]
    weights: list[list[int]] = [[] for _ in range(rows)]
    place = at + 4 * rows
    for first in range(0, rows, 2):
        block = range(first, min(first + 2, rows))
        for _ in range(inputs // 2):
            for row in block:
                weights[row] += [signed(halves[place], 16), signed(halves[place + 1], 16)]
                place += 2
    return list(zip(biases, weights))


def sums(rows: list[tuple[int, list[int]]], sample: list[int]) -> list[int]:
    """Returns the weighted sum of every row."""
    return [bias + sum(weight * x for weight, x in zip(weights, sample)) for bias, weights in rows]


def answer(data: bytes, sample: list[int]) -> Answer:
    """Returns the answer of a calibrated linear model of one int16 row for each class."""
    halves = halves_of(data)
    assert (halves[6], halves[7], halves[15] >> 8) == (1, 2, 1)
    classes, inputs, labels = halves[8], 10 * halves[10], long(halves, 12)
    scores = sums(rows_of(halves, HEADER_HALVES + 2, classes, inputs), sample)
    place = scores.index(max(scores))
    end = long(halves, labels - 2)
    start = end + end % 2
    factor, before, behind, dimensions = long(halves, start), halves[start + 2] & 255, halves[start + 2] >> 8, halves[start + 3]
    weights = []
    for score in scores:
        x = min((scores[place] - score) >> before, 2**32 - 1) * factor >> behind
        weights.append(math.exp(-x / 2**20))
    probabilities = [weight / sum(weights) for weight in weights]
    if dimensions == 0:
        return Answer(place, probabilities, None, None)
    shift, has_limits, threshold = halves[start + 4], halves[start + 5], long(halves, start + 6)
    rows = rows_of(halves, start + 8, dimensions, inputs)
    limits = labels - 2 - 2 * classes * has_limits
    means = limits - classes * (dimensions + dimensions % 2)
    if has_limits:
        threshold = long(halves, limits + 2 * place)
    distance = 0
    for dimension, total in enumerate(sums(rows, sample)):
        mean = signed(halves[means + place * (dimensions + dimensions % 2) + dimension], 16)
        difference = ((total + (1 << (shift - 1))) >> shift) - mean
        distance += max(-LARGEST_DIFFERENCE, min(LARGEST_DIFFERENCE, difference)) ** 2
    return Answer(place, probabilities, distance, distance <= threshold)
