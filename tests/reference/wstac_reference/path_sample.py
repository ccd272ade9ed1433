"""The sample of a touch along its path (SPEC section 10), from ten sums or from 25 taxels."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .constants import COLUMNS, NOMINAL_FPS, ROWS, SAMPLE_FRAMES, UNIT
from .readout import GLOBAL, Readout

PITCH_MM = 4.0
MIDDLE_MM_S = 120.0
START = 1 / 8
"""A touch begins where a line first exceeds this fraction of its peak."""
LIT = 1 / 16
"""A line is lit from this fraction of the brightest peak on. Its own mean counts as at least that of the mean."""
LEAST = 1 / 64
"""Added to light in units of the mean light, and, squared, to a variance."""
MOST_OWN = 16.0
"""Most light of a line in units of its own mean."""
THERE = 1 / 4
"""Lines beside a lost frame are replaced by others that have at least this fraction of all light."""
NUMBERS = 700
DARK_FRAMES = 4
NONE_LOST: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Plan:
    """How lines are put together: `groups` and `spreads` are lists of lines."""

    groups: list[list[int]]
    spreads: list[list[int]]
    step_mm: float
    window: int
    before: int
    by_direction: bool


RINGS = [
    [k for k in range(ROWS * COLUMNS) if low <= (k // 5 - 2) ** 2 + (k % 5 - 2) ** 2 <= high]
    for low, high in ((0, 2), (4, 5), (8, 8))
]
BY_TAXELS = Plan(RINGS, [list(range(25))], 1.0, 32, 4, False)


def by_lines(first: int, second: int) -> Plan:
    """Returns the plan of ten sums whose lines from number `first` on are those that the motion crosses."""
    groups = [[at + k for k in of] for at in (first, second) for of in ([2], [1, 3], [0, 4])]
    return Plan(groups, [list(range(at, at + 5)) for at in (first, second)], 2.0, 16, 2, True)


def light_of_sums(features: np.ndarray, totals: np.ndarray, frames: int) -> np.ndarray:
    """Light above the baseline: a row a line. `totals` are the baseline's sums over `frames` frames."""
    return np.maximum(np.exp(features / UNIT) - np.exp(totals / frames / UNIT)[:, None], 0.0)


def light_of_taxels(sums: np.ndarray, lost: frozenset[int] = NONE_LOST) -> np.ndarray:
    """Light above that of the first frames that arrived: a row a taxel. Lost ones are on straight lines."""
    there = [t for t in range(SAMPLE_FRAMES) if t not in lost]
    straight = np.array([np.interp(np.arange(SAMPLE_FRAMES), there, row[there]) for row in sums])
    return np.maximum(straight - sums[:, there[:DARK_FRAMES]].mean(axis=1, keepdims=True), 0.0)


def beside(at: np.ndarray, lost: frozenset[int]) -> np.ndarray:
    """Whether times in frames are beside a lost frame."""
    frames = np.floor(at).astype(int)
    return np.isin(frames, list(lost)) | np.isin(frames + 1, list(lost))


def replaced(lines: np.ndarray, own: np.ndarray, is_there: np.ndarray) -> tuple[np.ndarray, int | None]:
    """Light of lines along their steps, of those that are not there by the others; `own` is light over the window.

    Also the first step of which too much was lost, which stays as it is.
    """
    made, whole = lines.copy(), None
    for step, there in enumerate(is_there.T):
        if own[there].sum() < THERE * own.sum():
            whole = step if whole is None else whole
        elif not there.all():
            made[~there, step] = own[~there] * lines[there, step].sum() / own[there].sum()
    return made, whole


def edge(light: np.ndarray) -> float:
    """When light first exceeds the level of a touch, in frames; straight lines between frames."""
    level = START * light.max()
    first = int(np.argmax(light > level))
    if first == 0:
        return 0.0
    before, here = light[first - 1], light[first]
    return first - 1 + (level - before) / (here - before)


def along(light: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Light at times in frames: 0 before the sample, the last frame's behind it."""
    return np.interp(at, np.arange(SAMPLE_FRAMES), light, left=0.0)


def numbers(light: np.ndarray, plan: Plan, delays: np.ndarray, weights: np.ndarray, speed: float, direction: float,
            per_mm: float, lost: frozenset[int] = NONE_LOST) -> tuple[np.ndarray, int | None, int] | None:
    """The numbers, the first step of which too much was lost, and how many steps were seen; None if it is dark.

    `per_mm` is in frames.
    """
    peaks = light.max(axis=1)
    lit = (peaks > 0) & (peaks >= LIT * peaks.max())
    if not (weights[lit].sum() > 0):
        return None
    edges = np.array([edge(one) for one in light])
    sure = lit & ~beside(edges, lost)
    by = sure if weights[sure].sum() > 0 else lit
    start = (weights * (edges - delays))[by].sum() / weights[by].sum()
    channels = len(plan.groups) + len(plan.spreads)
    each = channels * (3 if plan.by_direction else 2)
    steps = math.ceil((NUMBERS - 4) / each)
    times = start + (np.arange(max(steps, plan.window)) - plan.before) * plan.step_mm * per_mm
    lines = np.array([along(light[k], times + delays[k]) * lit[k] for k in range(len(light))])
    straight, whole = lines, None
    if lost:
        is_there = np.array([lit[k] & ~beside(times + delays[k], lost) for k in range(len(light))])
        is_there |= ~lit[:, None]
        straight, _ = replaced(lines, lines[:, : plan.window].sum(axis=1), is_there)
        lines, whole = replaced(lines, straight[:, : plan.window].sum(axis=1), is_there)
    means, window = (
        np.array([of_lines[of].sum(axis=0) / max(lit[of].sum(), 1) for of in plan.groups])
        for of_lines in (lines, straight)
    )
    mean = window[:, : plan.window].mean()
    if not mean > 0:
        return None
    found = [np.log(group / mean + LEAST) for group in means]
    own = np.maximum(straight[:, : plan.window].mean(axis=1), LIT * mean)
    shapes = np.minimum(lines / own[:, None], MOST_OWN)
    for of in plan.spreads:
        those = [k for k in of if lit[k]]
        variance = shapes[those].var(axis=0) if those else np.zeros(len(times))
        found.append(0.5 * np.log(variance + LEAST**2))
    factors = [1.0, speed, direction] if plan.by_direction else [1.0, speed]
    rows = np.array([channel * factor for factor in factors for channel in found])
    facts = [speed, direction, speed * speed, speed * direction]
    seen = math.floor((SAMPLE_FRAMES - 1 - times[0] - delays[lit].max()) / (plan.step_mm * per_mm)) + 1
    seen = max(seen if whole is None else min(seen, whole), 0)
    return np.concatenate([facts, rows.T[:steps].ravel()])[:NUMBERS], whole, seen


def way(mm_s: float, degrees: float) -> tuple[float, float, float, float, float]:
    """Frames per mm of path, its parts to the right and upwards, and the numbers of speed and direction."""
    right, up = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    speed = min(max(math.log(mm_s / MIDDLE_MM_S), -1.0), 1.0)
    return NOMINAL_FPS / mm_s, right, up, speed, math.cos(math.radians(4 * degrees))


def sums_along(
    features: np.ndarray, totals: np.ndarray, frames: int, mm_s: float, degrees: float, readout: Readout = GLOBAL
) -> np.ndarray | None:
    """The sample of ten features, in natural logarithms; None if it is dark."""
    per_mm, right, up, speed, direction = way(mm_s, degrees)
    number = np.arange(ROWS) - 2
    delays = per_mm * PITCH_MM * np.concatenate([-number * up, number * right])
    delays -= np.concatenate([number * readout.rows, number * readout.columns])
    weights = np.array([up * up] * ROWS + [right * right] * COLUMNS)
    plan = by_lines(0, 5) if abs(up) > abs(right) else by_lines(5, 0)
    found = numbers(light_of_sums(features, totals, frames), plan, delays, weights, speed, direction, per_mm)
    return None if found is None else found[0]


def taxels_along(
    sums: np.ndarray, mm_s: float, degrees: float, readout: Readout = GLOBAL, lost: frozenset[int] = NONE_LOST
) -> tuple[np.ndarray, int | None, int] | None:
    """The sample of 25 taxels' sums, in natural logarithms, the first step of which too much was lost, and steps seen.

    None if it is dark.
    """
    per_mm, right, up, speed, direction = way(mm_s, degrees)
    row, column = (np.arange(ROWS * COLUMNS) // COLUMNS - 2, np.arange(ROWS * COLUMNS) % COLUMNS - 2)
    delays = per_mm * PITCH_MM * (column * right - row * up) - row * readout.rows - column * readout.columns
    weights, light = np.ones(ROWS * COLUMNS), light_of_taxels(sums, lost)
    return numbers(light, BY_TAXELS, delays, weights, speed, direction, per_mm, lost)


FIRST_STEP, LEAST_STEPS, MOST_STEPS, OF_EDGE = 8, 20, 88, 2
"""Steps of a period: the first, how few are enough, where they end, and how many the trailing edge has."""
LIT_STEP = -1.4
FREQUENCIES = np.linspace(1 / 13, 1 / 2.6, 56)
SHARE, LEAST_PERIODS, OF_FRAME = 0.8, 2.5, 0.4


def period(path: np.ndarray, covered: int, mm_s: float, relative_sd: float) -> tuple[float, float] | None:
    """Period of a texture in mm and its deviation, from the numbers of 25 taxels; `covered` steps were seen."""
    steps = path[4 : 4 + 8 * min(covered, 87)].reshape(-1, 8)
    light = steps[FIRST_STEP:MOST_STEPS + FIRST_STEP, :3].sum(axis=1)
    lit = np.flatnonzero(light > 3 * LIT_STEP)
    light = light[: max(lit[-1] + 1 - OF_EDGE, 0)] if len(lit) else light[:0]
    count = len(light)
    if count < LEAST_STEPS:
        return None
    place = np.arange(count) - (count - 1) / 2
    changes = (light - np.polyval(np.polyfit(place, light, 1), place)) * (weight := 1 - (2 * place / (count + 1)) ** 2)
    powers = np.abs(np.exp(-2j * np.pi * np.outer(FREQUENCIES, place)) @ changes) ** 2
    best = int(np.argmax(powers))
    if best in (0, len(powers) - 1):
        return None
    below, most, above = powers[best - 1 : best + 2]
    share = 2 * most / ((changes**2).sum() * (weight**2).sum())
    frequency = FREQUENCIES[best] + (FREQUENCIES[1] - FREQUENCIES[0]) * (below - above) / 2 / (below - 2 * most + above)
    periods, of_frame = count * frequency, mm_s / NOMINAL_FPS * frequency
    if not (share > SHARE and periods >= LEAST_PERIODS and of_frame <= OF_FRAME):
        return None
    parts = (0.0022, 0.04 / periods**2, 0.33 * of_frame**2 / periods, relative_sd)
    return 1 / frequency, math.hypot(*parts) / frequency
