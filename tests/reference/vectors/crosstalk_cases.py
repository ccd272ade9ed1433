"""Matrices of cross-talk, and what the reference makes of frames by them."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from wstac_reference.constants import TAXELS
from wstac_reference.crosstalk import FULL, ONE, corrected, inverse_of, weights_of
from wstac_reference.rng import SplitMix64, seed_of

from . import SEED


def matrix_of(near: float, noise: int, rng: SplitMix64) -> list[list[float]]:
    """Cross-talk of the four beside a whisker, and noise of every taxel in ten-thousandths."""
    shake = rng.below(noise + 1, (TAXELS, TAXELS))
    distance = lambda a, b: abs(a // 5 - b // 5) + abs(a % 5 - b % 5)
    far = lambda a, b: round((near if distance(a, b) == 1 else 0) + int(shake[a, b]) / 10_000, 4)
    return [[1.0 if a == b else far(a, b) for b in range(TAXELS)] for a in range(TAXELS)]


def frames_of(matrix: list[list[Fraction]], rng: SplitMix64) -> list[list[int]]:
    """Black, full scale, a single bright taxel, a chessboard, chance, and light that this matrix has mixed."""
    own = [int(value) for value in 200 + rng.below(20_000, TAXELS)]
    return [
        [0] * TAXELS,
        [FULL] * TAXELS,
        [FULL * (taxel == 12) for taxel in range(TAXELS)],
        [FULL * (taxel % 2) for taxel in range(TAXELS)],
        [int(value) for value in rng.below(FULL + 1, TAXELS)],
        [min(round(sum(part * value for part, value in zip(row, own))), FULL) for row in matrix],
    ]


def crosstalk_cases() -> list[dict[str, Any]]:
    """Every case with its weights, which are None if the matrix is refused, its frames, and those without cross-talk."""
    made = []
    for name, near, noise in (
        ("none", 0.0, 0),
        ("neighbors", 0.05, 0),
        ("uneven", 0.04, 60),
        ("strong", 0.13, 10),
        ("too-strong", 0.28, 0),
        ("singular", 0.5, 0),
    ):
        rng = SplitMix64(seed_of(f"crosstalk-{name}", SEED))
        matrix = matrix_of(near, noise, rng)
        exact = [[Fraction(str(value)) for value in row] for row in matrix]
        inverse = inverse_of(exact)
        weights = weights_of(inverse)
        frames = frames_of(exact, rng) if weights else []
        results = [corrected(weights, frame) for frame in frames]
        for frame, result in zip(frames, results):
            # The bound of SPEC §9: each weight is off by at most half a unit.
            most = Fraction(1, 2) + Fraction(sum(frame), 2 * ONE)
            true = [sum(part * value for part, value in zip(row, frame)) for row in inverse]
            assert all(abs(min(max(value, 0), FULL) - found) <= most for value, found in zip(true, result)), name
        made.append({"name": name, "matrix": matrix, "weights": weights, "frames": frames, "corrected": results})
    return made
