"""Computes the direction of a slide: the order in which rows and columns light up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from .constants import BASELINE_WINDOWS, FEATURES, ROWS, UNIT
from .trigger import Baseline, Sample

CLEAR = 0.2
"""Smallest confidence of a clear direction."""

ROUNDING = 1e-12
"""Slopes in frames a line below this are 0: what is left where all lines light up in the same frame, and (3 x) / x is not 3."""


@dataclass(frozen=True)
class DirectionAnswer:
    """`deg` is None if the direction is unclear. The confidence is the raw one in any case."""

    deg: int | None
    confidence: float
    row_slope: float
    column_slope: float


def centroid(baseline: Baseline, sample: Sample, k: int) -> float | None:
    """Returns the centroid in frames 0..69 of feature k's light above baseline; None if it never lights."""
    dark = baseline.mean_light(k)
    frames_of_baseline = BASELINE_WINDOWS * baseline.window
    weight = moment = 0.0
    for t, f in enumerate(sample.features):
        if f[k] * frames_of_baseline > baseline.totals[k]:  # brighter than baseline, exactly
            light = math.exp(f[k] / UNIT) - dark
            weight += light
            moment += t * light
    return moment / weight if weight > 0 else None


def slope(centroids: Sequence[float | None]) -> float:
    """Returns the least-squares slope of centroid against index over those that light.

    *Decided*: it is 0 for fewer than two.
    """
    points = [(index, value) for index, value in enumerate(centroids) if value is not None]
    if len(points) < 2:
        return 0.0
    mean_index = sum(index for index, _ in points) / len(points)
    mean_value = sum(value for _, value in points) / len(points)
    above = sum((index - mean_index) * (value - mean_value) for index, value in points)
    found = above / sum((index - mean_index) ** 2 for index, _ in points)
    return found if abs(found) > ROUNDING else 0.0


def measure_direction(baseline: Baseline, sample: Sample) -> DirectionAnswer:
    """Returns 0 (+x), 180, 90 (rows from last to first, +y) or 270 degrees, or unclear."""
    times = [centroid(baseline, sample, k) for k in range(FEATURES)]
    rows, columns = times[:ROWS], times[ROWS:]
    s_row, s_column = slope(rows), slope(columns)
    total = abs(s_row) + abs(s_column)
    confidence = abs(abs(s_row) - abs(s_column)) / total if total > 0 else 0.0
    spot = None in rows and None in columns
    deg: int | None = None
    if confidence >= CLEAR and not spot:
        along, back, slope_of_axis = (0, 180, s_column) if abs(s_column) > abs(s_row) else (270, 90, s_row)
        deg = along if slope_of_axis > 0 else back
    return DirectionAnswer(deg, confidence, s_row, s_column)
