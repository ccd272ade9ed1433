"""Motion of a touch from arrival times (SPEC section 9): slowness along both axes, and the kind of the touch."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from .constants import NOMINAL_FPS, ROWS, SAMPLE_FRAMES, UNIT
from .readout import GLOBAL, Readout, contact as contact_of

PITCH_MM = 4.0
LIT = 1 / 8
"""A line is lit above this fraction of the axis's highest smoothed peak."""
LEVELS = (38 / 128, 19 / 128, 64 / 128)
SAME_START = 0.25
ENOUGH = 0.98
STEPS = 5
LARGEST_STEP = 1.5
FARTHEST_START = 14.0
FEWEST_FRAMES = 10
BRIGHT = 1 / 64
MARGIN = 5
BINOMIAL = np.array([1, 8, 28, 56, 70, 56, 28, 8, 1]) / 256
EVEN = 7 / 16
"""All lines of a touch that crosses the sensor have peaks above this fraction of the axis's highest."""
DARK_AT_FIRST = 1 / 32
PARTS = 4
LEAST_TOLD = 0.03
SLOW = 5.0
RISING = 0.4
FILLED = 0.02
FACTORS = ((0.2, 0.95), (0.27, 0.6), (4.0, 0.58), (8.0, 0.22))
ACROSS = ((1.5, 0.82), (3.0, 0.71))


@dataclass(frozen=True)
class Axis:
    """What is known of five lines; slowness in frames per pitch."""

    lit: int
    slowness: float = 0.0
    fit_sd: float = 0.0
    scatter: float = 0.0
    farthest: float = 0.0
    coherence: float = 0.0
    change: float = 0.0
    is_crossed: bool = False


@dataclass(frozen=True)
class MotionAnswer:
    """`mm_s` and the rest are None unless it slides."""

    contact: str
    mm_s: float | None
    mm_s_sd: float | None
    deg: float | None
    deg_sd: float | None
    coherence: float
    reliable: bool


def shapes(features: np.ndarray, totals: np.ndarray, frames: int) -> tuple[np.ndarray, np.ndarray, bool]:
    """Smoothed light above baseline of five lines, scaled to peaks of 1, which are lit, and whether light crosses all.

    `features` has a row a line, in units of 2^-11; `totals` are the baseline's sums over `frames` frames.
    """
    light = np.exp(features / UNIT) - np.exp(totals / frames / UNIT)[:, None]
    padded = np.pad(np.maximum(light, 0.0), ((0, 0), (4, 4)), mode="edge")
    # The filter [1 2 1] / 4 four times. Each time, the first and last values stand for those beyond them.
    smooth = np.maximum(light, 0.0)
    for _ in range(4):
        wide = np.pad(smooth, ((0, 0), (1, 1)), mode="edge")
        smooth = (wide[:, :-2] + 2 * wide[:, 1:-1] + wide[:, 2:]) / 4
    inside = np.array([np.convolve(row, BINOMIAL, mode="valid") for row in padded])
    assert np.allclose(inside[:, 4:-4], smooth[:, 4:-4])
    peaks = smooth.max(axis=1)
    lit = peaks > LIT * peaks.max()
    scaled = np.zeros_like(smooth)
    scaled[lit] = smooth[lit] / peaks[lit, None]
    even = bool((peaks > EVEN * peaks.max()).all())
    return scaled, lit, even and int((scaled[:, 0] > DARK_AT_FIRST).sum()) <= 2


def edge_slope(lines: np.ndarray, lit: np.ndarray, level: float) -> float:
    """Slope of a straight line through the lit lines' first crossings of a level."""
    times = []
    for line in lines[lit]:
        above = int(np.argmax(line > level))
        at = float(above)
        if above > 0:
            at = above - 1 + (level - line[above - 1]) / (line[above] - line[above - 1])
        times.append(at)
    return float(np.polyfit(np.flatnonzero(lit), times, 1)[0])


def shifted(line: np.ndarray, places: np.ndarray) -> np.ndarray:
    """A line at fractional places, by cubic convolution (Keys 1981, a = -1/2)."""
    first = np.floor(places).astype(int)
    total = np.zeros(len(places))
    for tap in (-1, 0, 1, 2):
        x = np.abs(places - (first + tap))
        near = 1.5 * x**3 - 2.5 * x**2 + 1
        far = -0.5 * x**3 + 2.5 * x**2 - 4 * x + 2
        total += line[first + tap] * np.where(x <= 1, near, np.where(x < 2, far, 0.0))
    return total


def step(lines: np.ndarray, lit: np.ndarray, slowness: float) -> tuple[float, Axis] | None:
    """The Gauss-Newton step at a slowness, and what is known of the axis there."""
    reach = math.ceil(2 * abs(slowness)) + 2
    bright = np.flatnonzero((lines > BRIGHT).any(axis=0))
    start = max(reach, bright[0] - MARGIN)
    frames = min(SAMPLE_FRAMES - reach, bright[-1] + MARGIN + 1) - start
    if frames < FEWEST_FRAMES:
        return None
    k = np.flatnonzero(lit) - 2.0
    t = np.arange(start, start + frames, dtype=float)
    y = np.array([shifted(line, t + each * slowness) for line, each in zip(lines[lit], k, strict=True)])
    shape = y.mean(axis=0)
    derivative = (shape[2:] - shape[:-2]) / 2
    y, shape = y[:, 1:-1], shape[1:-1]
    derivative = derivative - shape * (derivative @ shape) / (shape @ shape)
    gains = y @ shape / (shape @ shape)
    around = k - (k * gains**2).sum() / (gains**2).sum()
    along = y @ derivative
    numerator = (around * gains * along).sum()
    spread = (around**2 * gains**2).sum()
    denominator = spread * (derivative @ derivative)
    if denominator <= 0:
        return None
    unlike = (y * y).sum() - (gains**2).sum() * (shape @ shape)
    rest = max(unlike - numerator**2 / denominator, 0.0)
    free = max((len(k) - 1) * (frames - 2) - len(k), 1)
    excess = numerator / denominator
    off = along / (gains * (derivative @ derivative)) - around * excess
    change = 0.0
    residues = ((around * gains) @ (y - gains[:, None] * shape)) * derivative
    length = -(-(frames - 2) // PARTS)
    for part in (slice(first, first + length) for first in range(0, frames - 2, length)):
        energy = derivative[part] @ derivative[part]
        share = energy / (derivative @ derivative)
        if share > LEAST_TOLD:
            change = max(change, abs(residues[part].sum() / (spread * energy) - excess) * share**0.25)
    scatter = math.sqrt((gains**2 * off**2).sum() / (max(len(k) - 2, 1) * spread))
    sd, coherence = math.sqrt(rest / free / denominator), 1 - rest / (y * y).sum()
    found = Axis(len(k), slowness, sd, scatter, float(np.abs(off).max()), coherence, change)
    return float(np.clip(excess, -LARGEST_STEP, LARGEST_STEP)), found


def axis(features: np.ndarray, totals: np.ndarray, frames: int) -> Axis:
    """The slowness at which five lines are most alike."""
    lines, lit, is_crossed = shapes(features, totals, frames)
    best: Axis | None = None
    starts: list[float] = []
    if lit.sum() < 3:
        return Axis(int(lit.sum()))
    for level in LEVELS:
        slowness = float(np.clip(edge_slope(lines, lit, level), -FARTHEST_START, FARTHEST_START))
        if any(abs(slowness - start) < SAME_START for start in starts):
            continue
        starts.append(slowness)
        last = None
        for _ in range(STEPS):
            taken = step(lines, lit, slowness)
            if taken is None:
                break
            slowness -= taken[0]
            last = taken[1]
            if abs(taken[0]) < max(abs(slowness) / 100, 0.002):
                break
        if last is not None and (best is None or last.coherence > best.coherence):
            best = replace(last, slowness=slowness)
        if best is not None and best.coherence > ENOUGH:
            break
    if best is None:
        return Axis(int(lit.sum()))
    change = float(best.change)
    if abs(best.slowness) < SLOW:
        rising = float(np.clip(edge_slope(lines, lit, LEVELS[1]), -FARTHEST_START, FARTHEST_START))
        change = max(change, RISING * abs(rising - best.slowness))
    return replace(best, change=change, is_crossed=is_crossed)


def measure_motion(
    features: np.ndarray,
    totals: np.ndarray,
    frames: int,
    fps: float = NOMINAL_FPS,
    reliable: bool = True,
    filled: int = 0,
    readout: Readout = GLOBAL,
) -> MotionAnswer:
    """The motion of a sample: `features` has ten rows of 70, `totals` the baseline's ten sums over `frames` frames.

    `filled` frames of the touch were lost.
    """
    rows = axis(features[:ROWS], totals[:ROWS], frames)
    columns = axis(features[ROWS:], totals[ROWS:], frames)
    coherence = min(rows.coherence, columns.coherence)
    slownesses = readout.of_light(rows.slowness, columns.slowness)
    slowness = math.hypot(*slownesses)
    if max(rows.lit, columns.lit) < 3:
        contact = "poke" if min(rows.lit, columns.lit) > 0 else "unclear"
    else:
        contact = "unclear" if coherence < 0.9 else contact_of(*slownesses, readout, fps)
    if contact != "slide":
        return MotionAnswer(contact, None, None, None, None, coherence, False)
    mm_s = PITCH_MM * fps / slowness
    right, up = slownesses[1] / slowness, -slownesses[0] / slowness
    factor = float(np.interp(slowness, *zip(*FACTORS, strict=True)))
    lost = FILLED * math.sqrt(filled)
    right_sd = math.hypot(factor * math.hypot(columns.scatter, 2 * columns.fit_sd), lost) / slowness
    up_sd = math.hypot(factor * math.hypot(rows.scatter, 2 * rows.fit_sd), lost) / slowness
    off = readout.off(*slownesses)
    mm_s_sd = mm_s * math.hypot(right * right_sd, up * up_sd, off[0] / math.sqrt(3))
    across = float(np.interp(slowness, *zip(*ACROSS, strict=True)))
    deg_sd = math.degrees(math.hypot(across * up * right_sd, across * right * up_sd, off[1] / math.sqrt(3)))
    farthest = max(rows.farthest, columns.farthest)
    steady = max(rows.change, columns.change) <= 0.04 * slowness + 0.004
    crossed = rows.is_crossed and columns.is_crossed
    in_line = farthest <= 0.16 * slowness + 0.01
    near = not readout.moves_too_far(*slownesses)
    sure = in_line and steady and crossed and coherence >= 0.97 and near and mm_s_sd < 0.06 * mm_s
    deg = math.degrees(math.atan2(up, right)) % 360
    return MotionAnswer(contact, mm_s, mm_s_sd, deg, deg_sd, coherence, reliable and sure)
