"""Where and how wide a touch is across its motion, by 25 energies (SPEC section 9, "Place and width")."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .motion import PITCH_MM
from .wave import COLUMN, ROW, TAXELS, fit, valley_of

MOST_ENERGY, LIT = 1.25, 0.15
FEWEST = 5
LEAST_OBLIQUE, FROM_DIAGONAL = 0.035, 0.062
"""Least sine and cosine of a direction, and what is least between both."""
SD = (0.035, 0.085)
MOST_SQUARE = 12.0
DOME, MOST_DOME = 0.55, 0.9
FAR = (COLUMN**2 + ROW**2) / 8
"""How much lower a whisker is on the dome; a corner has 1."""
BORDERS = 12
INSIDE, BEHIND, BEYOND = 0.5, 0.8, 2.5
UPRIGHT, SLOPING = 0.3, 1.2
BALL_STEP = 0.3
OVERLAP = 3.0
OF_LAW = 0.08
MOST_BALL_SD = 0.8
MOST_MISS = 60.0
MOST_BEYOND = 0.03
BEFORE = 8.0
APART = 0.5
SPREAD, LEAST, TO_RADIAN = (1.0, 0.9), (0.04, 0.1), (0.855, 2.85)


@dataclass(frozen=True)
class ExtentAnswer:
    """Lengths in mm; none if they are not certain."""

    contacts: int
    place_mm: float | None = None
    place_sd: float | None = None
    width_mm: float | None = None
    width_sd: float | None = None


@dataclass(frozen=True)
class Cut:
    """What one cut says: its mass; mean and variance of the place and of the width; how likely a border is beyond."""

    mass: float
    mean: tuple[float, float]
    variance: tuple[float, float]
    beyond: float


def likely(squares: np.ndarray, places: np.ndarray, scale: float, beyond: np.ndarray) -> tuple[float, float, float, float]:
    """Integral, mean, variance and part beyond the whiskers of the likelihood of evenly spaced places."""
    weights = np.exp((squares.min() - squares) / (2 * scale))
    step = float(places[1] - places[0])
    share = weights / weights.sum()
    mean = float(share @ places)
    variance = float(share @ (places - mean) ** 2) + step * step / 12
    return float(weights.sum()) * step, mean, variance, float(share @ beyond)


def measure_extent(energies: list[int], deg: float, deg_sd: float) -> ExtentAnswer:
    """The extent of a touch of these energies that moved in a direction."""
    right, up = math.cos(math.radians(deg)), math.sin(math.radians(deg))
    light = np.maximum(np.array(energies, dtype=float), 0)
    second = float(np.sort(light)[-2]) or float(light.max())
    if second <= 0:
        return ExtentAnswer(0)
    part = np.minimum(light / second, 2.0)
    contacts = 1 + int(valley_of(part, right, up) is not None)
    energy = np.minimum(part, MOST_ENERGY)
    lit = energy > LIT
    is_straight = min(abs(right), abs(up)) <= LEAST_OBLIQUE or abs(abs(right) - abs(up)) <= FROM_DIAGONAL
    if contacts > 1 or is_straight or lit.sum() < FEWEST:
        return ExtentAnswer(contacts)
    heights = energy * (1 + energy) / 2
    sure = 1 / (SD[0] + SD[1] * heights)
    weights = sure * sure
    across = -COLUMN * up - ROW * right
    columns = np.column_stack([np.ones(TAXELS), across, across**2, FAR])
    found, inverse, scale = fit(columns[lit], weights[lit], (heights + DOME * FAR)[lit], 2e-3)
    top = max(float((columns[:, :3] @ found[:3])[lit].max()), 0.3)
    lowered = min(max((DOME - float(found[3])) / top, 0.0), MOST_DOME) * FAR
    n = PITCH_MM * across

    def amplitude(shape: np.ndarray, of: np.ndarray, least: float, most: float) -> float:
        products, squares = (weights * heights * shape)[of].sum(), (weights * shape * shape)[of].sum()
        return min(max(float(products / max(squares, 1e-9)), least), most)

    def above(height: np.ndarray) -> np.ndarray:
        return np.where(height > 0, np.maximum(height - lowered, 0), 0)

    def squares_of(expected: np.ndarray) -> np.ndarray:
        return np.minimum(weights * (heights - expected) ** 2, MOST_SQUARE)

    first, last = float(n[lit].min()), float(n[lit].max())
    inner = lit & (n > first + SLOPING) & (n < last - SLOPING)
    of_sides = amplitude(1 - lowered, inner if inner.sum() >= 3 else lit, 0.6, 1.6)
    middle = (first + last) / 2
    sides = []
    for sign in (1, -1):
        m = sign * n
        end = float(m[lit].max())
        dark = np.sort(m[~lit & (m > end)])
        stop = min(float(dark[2]) + BEHIND if len(dark) > 2 else math.inf, float(m.max()) + BEYOND)
        step = (stop - end + INSIDE) / BORDERS
        places = end - INSIDE + (np.arange(BORDERS) + 0.5) * step
        counts = m >= sign * middle - 1e-9
        inside = places[:, None] - m[None, :]
        kinds = (np.clip(inside / UPRIGHT + 0.5, 0, 1), np.clip(inside / SLOPING, 0, 1))
        sums = [(squares_of(above(kind) * of_sides) * counts).sum(axis=1) for kind in kinds]
        sides.append((sums, places, (places > m.max()).astype(float)))
    least = [sides[0][0][kind].min() + sides[1][0][kind].min() for kind in (0, 1)]

    ball = None
    _, slope, bow, _ = found
    if bow < -1.6e-3:
        center = float(-slope / (2 * bow))
        center_sd = math.sqrt(0.5) * PITCH_MM * scale * math.sqrt(inverse[1, 1]) / (-2 * bow)
        if first <= PITCH_MM * center <= last and center_sd <= MOST_BALL_SD:
            center *= PITCH_MM
            apart = np.abs(n - center)
            halves = np.maximum(apart[lit].max() - BALL_STEP / 2, 1.0) + np.arange(BORDERS) * BALL_STEP
            sums = []
            for half in halves:
                q = (apart / half) ** 2
                curved = half**2 / (half**2 + OVERLAP**2)
                shape = above(np.where(q < 1, 1 - curved * q - (1 - curved) * q**3, 0))
                sums.append(squares_of(shape * amplitude(shape, lit, 0.7, 1.6)).sum())
            beyond = ((center + halves > n.max()) | (center - halves < n.min())).astype(float)
            ball = (center, center_sd, halves, np.array(sums), beyond)
            least.append(float(ball[3].min()))

    best = min(least)
    if best > MOST_MISS:
        return ExtentAnswer(contacts)
    spread = max((BEFORE + best) / (BEFORE + 2 + int(lit.sum())), 1.0)
    cuts = []
    for kind in (0, 1):
        left, to_right = (likely(sums[kind], places, spread, beyond) for sums, places, beyond in sides)
        factor = math.exp(APART * (best - least[kind]) / (2 * spread))
        both = left[2] + to_right[2]
        cuts.append(
            Cut(
                left[0] * to_right[0] * factor,
                ((left[1] - to_right[1]) / 2, left[1] + to_right[1]),
                (both / 4, both),
                1 - (1 - left[3]) * (1 - to_right[3]),
            )
        )
    if ball is not None:
        center, center_sd, halves, sums_of_ball, beyond = ball
        mass, mean, variance, beyond_part = likely(sums_of_ball, halves, spread, beyond)
        factor = math.exp(APART * (best - least[2]) / (2 * spread))
        area = 2 * mass * math.sqrt(2 * math.pi) * center_sd
        cuts.append(Cut(area * factor, (center, 2 * mean), (center_sd**2, 4 * variance + (OF_LAW * mean) ** 2), beyond_part))
    whole = sum(cut.mass for cut in cuts)
    if sum(cut.mass * cut.beyond for cut in cuts) / whole >= MOST_BEYOND:
        return ExtentAnswer(contacts)
    answers = []
    for k in (0, 1):
        mean = sum(cut.mass * cut.mean[k] for cut in cuts) / whole
        variance = sum(cut.mass * (cut.variance[k] + (cut.mean[k] - mean) ** 2) for cut in cuts) / whole
        turned = TO_RADIAN[k] * math.radians(deg_sd)
        answers += [mean, math.sqrt(SPREAD[k] * variance + turned**2 + LEAST[k] ** 2)]
    return ExtentAnswer(contacts, *answers)
