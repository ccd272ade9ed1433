"""Motion of a touch by 25 taxels: of one plane wave, two contacts or a corner (SPEC section 9, "By a wave")."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from .constants import COLUMNS, NOMINAL_FPS, ROWS, TAXELS
from .motion import PITCH_MM
from .readout import MOST_PRESS, Readout, least_press

DARK = 4
"""Frames at the start that count as dark."""
NOISE = 84
"""The sum of the dark frames' 75 differences is so many standard deviations of the noise."""
LEAST_LIGHT = 64
LIT = 1 / 8
BRIGHT = 1 / 32
ROUNDS = 5
FEWEST_STEPS = 8
FEWEST = 5
WEAKEST_GAIN = 1 / 16
RISE = 102 / 256
"""A rising edge is where a line first exceeds this part of its peak."""
LATE, RMS, MISS = (0.09, 0.12), (0.05, 0.06), (0.25, 0.05)
CHANGE = ((0.065, 0.0), (0.025, 0.011))
"""Limits of a wave that leaves whiskers dark, and of one that lights all."""
MOST_FLASHES = 6
"""More flashes, each of a part of the sensor, are those of stick-slip."""
ACCELERATION = (0.068, 2.5, 0.16)
CERTAIN = (0.05, 5.0)
TWIST = (0.12, 2.2)
VALLEY = 0.15
SAME_WAY, BESIDE = 0.05, 1.2
"""Distances across the motion in pitches: of whiskers on one way, and of those that have others between them lit."""
ANGLES = 36
LENGTH_MM, GAIN, POWER = 6.0, 0.25, 0.6
WEAK = 0.55
OUTLINE_TELLS, OUTLINE_MUTE = 8.0, 25.0
MOST_EDGE_DARK, LATE_OF_EDGE = 6, 0.04
MOST_SD, LEAST_SD = (0.04, 0.1), (0.0002, 0.00053)
"""Largest and least deviations: of the speed as a fraction, and of the direction in radians."""
FEW_FRAMES = (0.3, 0.1)
"""A slowness in frames per pitch, and the part of what is missing to it that is a deviation along the motion."""
LOST = 0.005
"""Deviation of the slowness along the motion by a lost frame of the touch, in frames per pitch."""
FACTORS = (
    ((0.515, 0.0965, 0.0116, 0.0, 0.0), (1.08, 0.025, 0.004, 0.0, 0.0)),
    ((0.12, 0.345, 0.0047, 1.0, 0.0), (0.115, 0.182, 0.0062, 0.0, 0.00026)),
)
"""Of deviations along and across the motion, if whiskers are dark and if at most one is: the part of the lateness, frames late
by the root of the energy that is missed, frames late by the phase between frames, times the mean square of lateness without a dome:
the square of a sine's height by the phase, and frames per pitch in any case."""
OF_PHASE = 600.0
"""Times the square of what a flash lacks: where it is 1, half of the lateness is by the phase."""
BY_PHASES = (0.011, 1.5)
"""Of a change of the slowness: frames late by the phase, and times the mean square of lateness without a dome."""
CHANGE_OF_PHASES = (2.3, 1.2)
"""Change of the slowness of a third of the touch, in deviations by the phase of these factors; and times that of the curvature."""
TURN = (3.0, 0.1, 1.1)
"""Deviations by which the slowness across the motion of a third of the touch may be off, if at most one whisker is dark; and the parts
of what is beyond that, which are deviations along and across the motion."""
OF_FLASH = 4.1
"""Frames late by that phase times the square of what the frame beside the brightest lacks to 0.94 of its light."""
LOCKED = 0.06
"""The variance of a slowness, in squares of that, if all whiskers have one phase."""
FEWEST_OF_CONTACT = 3
LATE_OF_CONTACTS, DIFFERENCE, POSSIBLE = (0.04, 0.08), (0.02, 0.05), 0.05
"""Of two contacts: mean and largest lateness, what each slowness differs along and across the motion, and along with an sd."""
LATE_OF_CORNER, MOST_COSINE, LEAST_SINE = (0.08, 0.18), 0.26, 0.2
FEWEST_OF_EDGE, FEWEST_OF_CORNER, CORNER_ROUNDS = 5, 18, 6
PLANE_FACTORS = (0.93, 1.03, 0.77, 2.0)
"""Of both deviations by two contacts, of the speed's by a corner, and of the direction's if the outline tells one, too."""
BRIGHTEST, OVERSHOOT, LONGEST = 4096, 1.25, 70
"""A line has 12 bits and a sign, at most so many times of it after a shift, and so many frames."""

COLUMN = np.tile(np.arange(COLUMNS) - COLUMNS // 2, ROWS).astype(float)
ROW = np.repeat(np.arange(ROWS) - ROWS // 2, COLUMNS).astype(float)
PLACES = np.column_stack([COLUMN, ROW])


class Refused(Exception):
    """The reason why there is no velocity."""


@dataclass(frozen=True)
class WaveAnswer:
    """Either a reason, or all the rest."""

    why: str | None = None
    mm_s: float | None = None
    mm_s_sd: float | None = None
    deg: float | None = None
    deg_sd: float | None = None
    basis: str | None = None
    mm_s2: float | None = None
    mm_s2_sd: float | None = None
    unevenness: tuple[float, float] = (0.0, 0.0)
    """The mean lateness of one wave: by the slowness, and in frames; infinite of a single line of whiskers."""


def light_of(samples: list[list[int] | None]) -> tuple[np.ndarray, float]:
    """Light of every frame above that of the first ones, and the noise. Lost frames are on straight lines."""
    known = [t for t, frame in enumerate(samples) if frame is not None]
    if not known:
        raise Refused("too few whiskers")
    values = np.array([samples[t] for t in known], dtype=float)
    light = np.array([np.interp(np.arange(len(samples)), known, column) for column in values.T]).T
    if len(light) < DARK + 8:
        raise Refused("too few whiskers")
    noise = max(float(np.abs(np.diff(light[:DARK], axis=0)).sum()) / NOISE, 2.0)
    return light - light[:DARK].mean(axis=0), noise


def span_of(light: np.ndarray, noise: float) -> tuple[int, int, bool, int]:
    """The first touch, from dark to dark: its first frame, the first one behind it, whether it is not over, and all flashes."""
    # Noise of 25 whiskers is five times that of one: three standard deviations.
    total = np.maximum(light.sum(axis=1) - 15 * noise, 0)
    before = np.maximum.accumulate(total)
    after = np.maximum.accumulate(total[::-1])[::-1]
    lit = total > np.maximum(0.2 * np.minimum(before, after), 0.01 * total.max())
    bright = light.max(axis=1) > max(8 * noise, LEAST_LIGHT)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], lit, [False]]).astype(int)))
    for start, end in edges.reshape(-1, 2).tolist():
        if end - start < 2 or not bright[start:end].any():
            continue
        if start < DARK:
            raise Refused("speed changed" if len(edges) > 2 * MOST_FLASHES else "starts on the sensor")
        first, last = start, end
        while start - first < 4 and total[first - 1] <= total[first]:
            first -= 1
        while last < len(light) and last - end < 6 and total[last] <= total[last - 1]:
            last += 1
        return max(first - 2, 0), last, end == len(light), len(edges) // 2
    raise Refused("too few whiskers")


def prepared(light: np.ndarray) -> np.ndarray:
    """Smoothed light of a touch."""
    light = np.maximum(light, -light.max())
    for _ in range(2):
        wide = np.pad(light, ((1, 1), (0, 0)), mode="edge")
        light = (wide[:-2] + 2 * wide[1:-1] + wide[2:]) / 4
    return light


def fit(columns: np.ndarray, weights: np.ndarray, values: np.ndarray, ridge: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Weighted least squares with a ridge: the coefficients, the inverse of the normal matrix, and the errors' scale."""
    normal = (columns.T * weights) @ columns
    size = len(normal)
    inverse = np.linalg.inv(normal + ridge * np.diag(np.diag(normal)) + 1e-6 * np.trace(normal) * np.eye(size))
    found = inverse @ ((columns.T * weights) @ values)
    rest = values - columns @ found
    free = max(len(values) - columns.shape[1], 1)
    return found, inverse, math.sqrt(float((weights * rest * rest).sum()) / free)


def rising_of(light: np.ndarray) -> np.ndarray:
    """The times of the rising edges of the light."""
    peak = light.max(axis=0)
    level = RISE * peak
    edges = (light > level).argmax(axis=0)
    which = np.arange(len(peak))
    # It is dark before the first frame.
    before = np.minimum(np.where(edges > 0, light[np.maximum(edges - 1, 0), which], 0.0), level)
    above = light[edges, which]
    return edges - (above - level) / (above - before)


def start_of(light: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Slowness of a plane through the rising edges of the light."""
    peak = light.max(axis=0)
    columns, times = np.column_stack([np.ones(len(peak)), places]), rising_of(light)
    # About their mean: across a single line of whiskers nothing is known, and the ridge makes it 0.
    return fit(columns, peak / peak.max(), times - np.average(times, weights=peak), 1e-3)[0][1:]


def shifted(line: np.ndarray, times: np.ndarray) -> np.ndarray:
    """A line at times between its frames, by cubic convolution (Keys 1981); dark beyond its ends."""
    first = np.floor(times).astype(int)
    total = np.zeros(len(times))
    for tap in (-1, 0, 1, 2):
        x = np.abs(times - (first + tap))
        kernel = np.where(x <= 1, 1.5 * x**3 - 2.5 * x**2 + 1, np.where(x < 2, -0.5 * x**3 + 2.5 * x**2 - 4 * x + 2, 0.0))
        inside = (first + tap >= 0) & (first + tap < len(line))
        total += np.where(inside, line[np.clip(first + tap, 0, len(line) - 1)], 0.0) * kernel
    return total


def check_widths(z: np.ndarray, m: np.ndarray, d: np.ndarray, unit: float) -> None:
    """Checks the bounds of lines and their sums if the brightest light has 12 bits."""
    assert np.abs(z).max() * unit <= OVERSHOOT * BRIGHTEST, "a shifted line is too high"
    most = (z * z).sum(axis=0).max() * unit * unit
    assert most <= OVERSHOOT**2 * LONGEST * BRIGHTEST**2 < 0.86 * 2**31, "a sum does not fit 32 bits"
    assert max(m @ m, d @ d) * unit * unit <= most * (1 + 1e-9), "a shape has more energy than its lines"


@dataclass(frozen=True)
class Wave:
    """What is known of a wave at its slowness."""

    slowness: np.ndarray
    weights: np.ndarray
    late: np.ndarray
    gains: np.ndarray
    miss: float
    parts: list[np.ndarray]
    lacks: float


def wave_of(light: np.ndarray, places: np.ndarray, slowness: np.ndarray, is_cut: bool) -> Wave:
    """Gauss-Newton for the least Σ (x_i(t + s·p_i) − g_i m(t))² over the slowness s, the shape m and the gains g."""
    peak = light.max(axis=0)
    bright = light > BRIGHT * peak
    first = bright.argmax(axis=0)
    last = len(light) - 1 - bright[::-1].argmax(axis=0)
    for number in range(ROUNDS):
        delays = places @ slowness
        start = math.floor((first - delays).min()) - 2
        end = math.ceil((last - delays).max()) + 3
        if is_cut:
            # The last two steps are smoothed with what is unknown, and interpolation reads two more.
            end = min(end, math.floor((len(light) - 4 - delays).min()))
        if end - start < FEWEST_STEPS:
            raise Refused("not over")
        time = np.arange(start, end)
        z = np.array([shifted(line, time + delay) for line, delay in zip(light.T, delays, strict=True)]).T
        m = z.mean(axis=1)
        d = np.concatenate([[m[1]], m[2:] - m[:-2], [0.0 if is_cut else -m[-2]]]) / 2
        mm, md, dd = m @ m, m @ d, d @ d
        zm, zd = m @ z, d @ z
        check_widths(z, m, d, BRIGHTEST / np.abs(light).max())
        gains = zm / mm
        told = dd - md * md / mm
        weights = gains * gains
        late = (zd - gains * md) / (np.maximum(gains, WEAKEST_GAIN) * told)
        around = places - weights @ places / weights.sum()
        normal = (around.T * weights) @ around
        normal = normal + 1e-4 * np.trace(normal) * np.eye(2)
        step = -np.linalg.solve(normal, (around.T * weights) @ late)
        size, whole = math.hypot(*step), math.hypot(*slowness)
        step = step * min(1.0, (0.2 * whole + 0.08) / max(size, 1e-9))
        slowness = slowness + step
        if size < 0.006 * whole:
            break
    late = late + around @ step
    late = late - weights @ late / weights.sum()
    energy = np.cumsum(d * d)
    parts = []
    for part in np.split(np.arange(len(d)), np.searchsorted(energy, energy[-1] * np.array([1, 2]) / 3)):
        rest = (d[part] @ z[part] - gains * (m[part] @ d[part])) / np.maximum(gains, WEAKEST_GAIN)
        parts.append(rest / max(float(d[part] @ d[part]), 1e-9))
    left = np.maximum((z * z).sum(axis=0) - gains * gains * mm, 0).sum()
    dark = np.zeros((1, len(peak)))
    around_each = np.concatenate([dark, light, dark])
    at, each = light.argmax(axis=0), np.arange(len(peak))
    beside = np.maximum(around_each[at, each], around_each[at + 2, each]).sum() / peak.sum()
    return Wave(slowness, weights, late, gains, float(left / (z * z).sum()), parts, max(0.94 - beside, 0.0))


def outline_of(peaks: np.ndarray) -> tuple[float, float]:
    """Direction from 0 to 180 degrees in which whiskers of one place across the motion are alike, and its deviation.

    The peaks are a Gaussian chain across the motion, of unknown scale, in each of 36 directions.
    """
    values = (np.maximum(peaks, 0) / peaks.max()) ** POWER
    grid = np.pad(values.reshape(ROWS, COLUMNS), 1, constant_values=np.nan)
    beside = np.stack([grid[:-2, 1:-1], grid[2:, 1:-1], grid[1:-1, :-2], grid[1:-1, 2:]]).reshape(4, TAXELS)
    enough = np.isfinite(beside).sum(axis=0) >= 3
    lowest = np.nanmin(beside, axis=0)
    values = np.where(enough & (lowest > LIT**POWER) & (values < WEAK * lowest), np.nanmean(beside, axis=0), values)
    likely = np.empty(ANGLES)
    for k in range(ANGLES):
        angle = math.pi * k / ANGLES
        across = PITCH_MM * (-COLUMN * math.sin(angle) - ROW * math.cos(angle))
        along = COLUMN * math.cos(angle) - ROW * math.sin(angle)
        order = np.lexsort((np.round(along, 6), np.round(across, 6)))
        of = values[order]
        scaled = math.sqrt(3) * np.diff(across[order]) / LENGTH_MM
        whole = 1 + GAIN**2
        like = (1 + scaled) * np.exp(-scaled) / whole
        variance = np.concatenate([[whole], whole * (1 - like * like)])
        rest = np.concatenate([of[:1], of[1:] - like * of[:-1]])
        likely[k] = -0.5 * np.log(variance).sum() - TAXELS / 2 * math.log((rest * rest / variance).sum())
    best = int(np.argmax(likely))
    share = np.exp(likely - likely[best])
    share = share / share.sum()
    turn = (np.arange(ANGLES) - best + ANGLES // 2) % ANGLES - ANGLES // 2
    mean = float(share @ turn)
    deviation = math.sqrt(float(share @ (turn - mean) ** 2) + 1 / 12)
    return (best + mean) * 180 / ANGLES, deviation * 180 / ANGLES


def valley_of(peaks: np.ndarray, right: float, up: float) -> np.ndarray | None:
    """The whiskers to the right of the deepest dark valley across the motion that parts two contacts."""
    order = np.argsort(np.round(-COLUMN * up - ROW * right, 6), kind="stable")
    of = peaks[order]
    deepest, side = 0.0, None
    for at in range(3, TAXELS - 2):
        sides, bottom = min(np.sort(of[:at])[-2], np.sort(of[at:])[-2]), max(of[at - 1], of[at])
        if sides > LIT * peaks.max() and bottom < VALLEY * sides and sides - bottom > deepest:
            deepest, side = sides - bottom, np.isin(np.arange(TAXELS), order[:at])
    return side


def is_crossed(peaks: np.ndarray, right: float, up: float) -> bool:
    """Whether at most one whisker is dark between others, across the motion, that are bright."""
    across = -COLUMN * up - ROW * right
    bright = across[peaks >= peaks.max() / 3]
    missed = 0
    for place in across[peaks <= LIT * peaks.max()]:
        apart = bright - place
        before = ((apart >= -BESIDE) & (apart <= SAME_WAY)).any()
        missed += bool(before and ((apart <= BESIDE) & (apart >= -SAME_WAY)).any())
    return missed <= 1


def sine_of(turns: np.ndarray) -> np.ndarray:
    """Nearly a sine of turns: two parabolas."""
    part = turns - np.floor(turns + 0.5)
    return 8 * part * (1 - 2 * np.abs(part))


@dataclass(frozen=True)
class Motion:
    """Frames from a row to the next and from a column to the next; deviations of the speed as a fraction, and in radians."""

    rows: float
    columns: float
    speed_sd: float
    angle_sd: float


def is_late(rest: np.ndarray, weights: np.ndarray, slowness: float, limits: tuple[float, float]) -> bool:
    """Whether the mean or the largest lateness exceeds its limit."""
    unit = slowness + 0.23
    rms = math.sqrt(float(weights @ rest**2 / weights.sum()))
    return bool(rms > limits[0] * unit or np.abs(rest * weights).max() > limits[1] * unit * weights.max())


def contacts_of(light: np.ndarray, places: np.ndarray, is_right: np.ndarray, delays: np.ndarray) -> Motion | None:
    """The motion of two contacts by the middles of their light: one slope, and a time of each."""
    peaks = light.max(axis=0)
    bright = np.maximum(light - BRIGHT * peaks, 0.0)
    times = np.arange(len(light)) @ bright / bright.sum(axis=0)
    around, rest = places.copy(), times.copy()
    sides = (is_right, ~is_right)
    for side in sides:
        around[side] -= np.average(places[side], axis=0, weights=peaks[side])
        rest[side] -= np.average(times[side], weights=peaks[side])

    def normal(side: np.ndarray, ridge: float) -> np.ndarray:
        squares = (around[side].T * peaks[side]) @ around[side]
        return squares + ridge * np.trace(squares) * np.eye(2)

    inverse = np.linalg.inv(normal(np.ones(len(peaks), bool), 1e-4))
    slope = inverse @ ((around.T * peaks) @ rest)
    rest = rest - around @ slope
    columns, rows = slope + delays
    whole = math.hypot(columns, rows)
    along = np.array([columns, rows]) / whole
    if len(peaks) <= 4 or is_late(rest, peaks, whole, LATE_OF_CONTACTS):
        return None
    variance = float(peaks @ rest**2) / (len(peaks) - 4)
    across = np.array([-along[1], along[0]])
    for side in sides:
        of_side = np.linalg.inv(normal(side, 1e-3))
        own = of_side @ ((around[side].T * peaks[side]) @ rest[side]) / whole
        possible = abs(own @ along) + math.sqrt(variance * float(along @ of_side @ along)) / whole
        if abs(own @ along) > DIFFERENCE[0] or abs(own @ across) > DIFFERENCE[1] or possible > POSSIBLE:
            return None
    covariance = inverse * variance
    speed_sd, angle_sd = (math.sqrt(float(way @ covariance @ way)) / whole for way in (along, across))
    return Motion(rows, columns, PLANE_FACTORS[0] * speed_sd, PLANE_FACTORS[1] * angle_sd)


def corner_of(light: np.ndarray, places: np.ndarray, delays: np.ndarray) -> Motion | None:
    """The motion of a corner: the later of two planes through the times of the rising edges, one for each of its edges."""
    peaks, times = light.max(axis=0), rising_of(light)

    def plane(side: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        weights = peaks[side]
        middle, time = np.average(places[side], axis=0, weights=weights), np.average(times[side], weights=weights)
        around = places[side] - middle
        squares = (around.T * weights) @ around
        inverse = np.linalg.inv(squares + 1e-4 * np.trace(squares) * np.eye(2))
        slope = inverse @ ((around.T * weights) @ (times[side] - time))
        return slope, inverse, times - time - (places - middle) @ slope

    slope, _, _ = plane(np.ones(len(peaks), bool))
    across = places @ [-slope[1], slope[0]]
    is_left = across > np.average(across, weights=peaks)
    for number in range(CORNER_ROUNDS):
        counts = (int(is_left.sum()), int((~is_left).sum()))
        if min(counts) < FEWEST_OF_EDGE or len(peaks) < FEWEST_OF_CORNER:
            return None
        one, other = plane(is_left), plane(~is_left)
        later = one[2] < other[2]
        moved = int((later != is_left).sum())
        if moved == 0 or (number == CORNER_ROUNDS - 1 and moved <= 2):
            break
        # A corner that opens forward changes its sides for ever.
        if number == CORNER_ROUNDS - 1:
            return None
        is_left = later
    edges = np.array([one[0] + delays, other[0] + delays])
    if abs(np.linalg.det(edges)) < 1e-9:
        return None
    # Pitches per frame: over the way of a frame, both edges are one frame late.
    inverse = np.linalg.inv(edges)
    velocity = inverse.sum(axis=1)
    speed, lengths = math.hypot(*velocity), np.hypot(edges[:, 0], edges[:, 1])
    if abs(edges[0] @ edges[1]) > MOST_COSINE * lengths.prod() or lengths.max() * speed * LEAST_SINE > 1:
        return None
    rest = np.where(is_left, one[2], other[2])
    if is_late(rest, peaks, 1 / speed, LATE_OF_CORNER):
        return None
    scale = float(peaks @ rest**2) / (len(peaks) - 6)
    covariance = inverse @ np.diag([scale * velocity @ each[1] @ velocity for each in (one, other)]) @ inverse.T
    along = velocity / speed
    across = np.array([-along[1], along[0]])
    speed_sd, angle_sd = (math.sqrt(float(way @ covariance @ way)) / speed for way in (along, across))
    columns, rows = along / speed
    return Motion(rows, columns, PLANE_FACTORS[2] * speed_sd, angle_sd)


def measure_wave(
    samples: list[list[int] | None], fps: float = NOMINAL_FPS, readout_ms: float | None = 0.0
) -> WaveAnswer:
    """The motion of the first touch in frames of 25 sums; None is a lost frame.

    `readout_ms` is that of the paper's layout over the full height; None is unknown.
    """
    try:
        return answer(samples, fps, readout_ms)
    except Refused as refused:
        return WaveAnswer(why=str(refused))


def answer(samples: list[list[int] | None], fps: float, readout_ms: float | None) -> WaveAnswer:
    """The velocity of the first touch; raises [`Refused`] if it is not certain."""
    light, noise = light_of(samples)
    start, end, is_cut, flashes = span_of(light, noise)
    lost = LOST * math.sqrt(sum(frame is None for frame in samples[start:end]))
    total = np.maximum(light.sum(axis=1) - 15 * noise, 0)
    is_followed = (4 * total[end:] > total.max()).any()
    later = (light[end:] > LIT * light[start:end].max()).any(axis=0)
    light = prepared(light[start:end])
    lit = light.max(axis=0) > LIT * light.max()
    try:
        found = answer_of_touch(light, is_cut, lost, fps, readout_ms)
        if lit.sum() > ROWS or 1 not in (len(set(ROW[lit])), len(set(COLUMN[lit]))):
            return found
        if is_followed and (later & ~lit).any():
            raise Refused("starts on the sensor")
        return replace(found, unevenness=(math.inf, math.inf))
    except Refused as refused:
        is_part = str(refused) in ("starts on the sensor", "not over", "too few whiskers", "poke", "press")
        raise Refused("speed changed") if is_part and flashes > MOST_FLASHES else refused


def answer_of_touch(light: np.ndarray, is_cut: bool, lost: float, fps: float, readout_ms: float | None) -> WaveAnswer:
    """The velocity by one wave, two contacts or a corner; raises [`Refused`] if it is not certain."""
    peaks = light.max(axis=0)
    lit = peaks > LIT * peaks.max()
    if lit.sum() < FEWEST:
        raise Refused("poke" if lit.sum() <= 2 else "too few whiskers")
    is_known = readout_ms is not None
    of_rows = Readout((readout_ms / 1000 * fps if is_known else 0.5) / ROWS, is_known=is_known)
    delays = np.array(of_rows.of_light(0.0, 0.0)[::-1])
    outline = outline_of(peaks)
    angle = math.radians(outline[0])
    is_right = valley_of(peaks, math.cos(angle), math.sin(angle))
    seen, places = light[:, lit], PLACES[lit]
    if is_right is not None:
        sides = (is_right & lit, ~is_right & lit)
        if is_cut or min(side.sum() for side in sides) < FEWEST_OF_CONTACT:
            raise Refused("two objects")
        motion = contacts_of(seen, places, is_right[lit], delays)
        if motion is None:
            raise Refused("two objects")
        _, right, up = slide_of(motion.rows, motion.columns, of_rows, fps)
        if not all(is_crossed(np.where(side, peaks, 0), right, up) for side in sides):
            raise Refused("starts on the sensor")
        return velocity_of(motion, of_rows, fps, "outline", lost)
    try:
        return answer_of_wave(seen, places, peaks, is_cut, of_rows, outline, fps, lost)
    except Refused as refused:
        if str(refused) not in ("speed changed", "turning", "not alike", "not over"):
            raise
        motion = corner_of(seen, places, delays)
        if motion is None:
            raise
        if outline[1] <= OUTLINE_TELLS:
            motion = replace(motion, angle_sd=PLANE_FACTORS[3] * motion.angle_sd)
    return velocity_of(motion, of_rows, fps, "outline", lost)


def slide_of(rows: float, columns: float, of_rows: Readout, fps: float) -> tuple[float, float, float]:
    """The slowness and the direction of a slide; raises [`Refused`] if it is none."""
    least, most = of_rows.bounds(rows, columns)
    if least > 13:
        raise Refused("too slow")
    if least < 0.17 and most >= MOST_PRESS and not of_rows.is_known:
        raise Refused("readout unknown")
    if least < 0.17:
        raise Refused("press" if least < least_press(fps) else "too fast")
    whole = math.hypot(rows, columns)
    return whole, columns / whole, -rows / whole


def velocity_of(motion: Motion, of_rows: Readout, fps: float, basis: str, lost: float) -> WaveAnswer:
    """The velocity with its deviations; raises [`Refused`] if it is not certain."""
    rows, columns = motion.rows, motion.columns
    whole, right, up = slide_of(rows, columns, of_rows, fps)
    if of_rows.moves_too_far(rows, columns):
        raise Refused("readout unknown")
    off, few = of_rows.off(rows, columns), FEW_FRAMES[1] * max(FEW_FRAMES[0] - whole, 0.0)
    speed_sd = math.hypot(motion.speed_sd, LEAST_SD[0], few / whole, lost / whole, off[0] / math.sqrt(3))
    deg_sd = math.hypot(motion.angle_sd, LEAST_SD[1], off[1] / math.sqrt(3))
    if speed_sd > MOST_SD[0] or deg_sd > MOST_SD[1]:
        raise Refused("uncertain")
    mm_s = PITCH_MM * fps / whole
    deg = math.degrees(math.atan2(up, right)) % 360
    return WaveAnswer(None, mm_s, mm_s * speed_sd, deg, math.degrees(deg_sd), basis)


def answer_of_wave(
    seen: np.ndarray,
    places: np.ndarray,
    peaks: np.ndarray,
    is_cut: bool,
    of_rows: Readout,
    of_outline: tuple[float, float],
    fps: float,
    lost: float,
) -> WaveAnswer:
    """The velocity of one wave; raises [`Refused`] if it is not certain."""
    lit_count = len(places)
    wave = wave_of(seen, places, start_of(seen, places), is_cut)
    rows, columns = of_rows.of_light(wave.slowness[1], wave.slowness[0])
    whole, right, up = slide_of(rows, columns, of_rows, fps)
    along, across = places @ [right, -up], places @ [-up, -right]
    late, weights, one = wave.late, wave.weights, np.ones(len(places))
    plane = np.column_stack([one, along, across])
    _, inverse, scale = fit(plane, weights, late, 1e-4)
    # Changes of the slowness over the sensor's length of four pitches, as fractions of it.
    unit = 8 / whole
    curved = np.column_stack([plane, along**2, across**2])
    curve, of_curve, curve_scale = fit(curved, weights, late, 1e-3)
    dome = math.copysign(min(abs(curve[3]), abs(curve[4])), curve[4]) if curve[3] * curve[4] > 0 else 0.0
    is_full, is_nearly_full = lit_count == TAXELS, lit_count >= TAXELS - 1
    # What the phase between frames may do to a coefficient, for a height of 1.
    sines = [sine_of(places @ wave.slowness + quarter) for quarter in (0, 0.25)]

    def by_phase(of: np.ndarray, columns: np.ndarray, way: int) -> float:
        return sum(float(of[way] @ ((columns.T * weights) @ each)) ** 2 for each in sines) / 2

    factors, flash = FACTORS[is_nearly_full], OF_FLASH * wave.lacks**2
    # A dome is no error of a plane.
    high = dome * (places**2).sum(axis=1)
    flat = late - (high - weights @ high / weights.sum())
    bent = float(weights @ flat**2 / weights.sum())

    def in_phase(of_phase: float, of_edge: float, way: int) -> float:
        return ((of_phase + flash) ** 2 + of_edge * bent) * by_phase(inverse, plane, way)

    height = CHANGE_OF_PHASES[1] * (BY_PHASES[0] + flash) if is_full else 0.0
    of_curvature = height * math.sqrt(by_phase(of_curve, curved, 3))
    faster, faster_sd = abs(dome - curve[3]) * unit, math.hypot(curve_scale * math.sqrt(of_curve[3, 3]), of_curvature) * unit
    turned, of_turned, turned_scale = fit(np.column_stack([plane, along * across]), weights, late, 1e-3)
    twist, twist_sd = abs(turned[3]) * unit, turned_scale * math.sqrt(of_turned[3, 3]) * unit
    _, change, turn = np.abs([fit(plane, weights, part, 1e-4)[0] for part in wave.parts]).max(axis=0)
    share, frames = CHANGE[is_full]
    by_phases = CHANGE_OF_PHASES[0] * math.sqrt(in_phase(*BY_PHASES, 1)) if is_full else 0.0
    if change > max(share * whole, frames, by_phases) or faster > min(max(ACCELERATION[0], ACCELERATION[1] * faster_sd), ACCELERATION[2]):
        raise Refused("speed changed")
    if faster > CERTAIN[0] and faster > CERTAIN[1] * faster_sd:
        raise Refused("speed changed")
    # Otherwise the valley across the outline tells it.
    is_apart = of_outline[1] > OUTLINE_TELLS and valley_of(peaks, right, up) is not None
    if twist > max(TWIST[0], TWIST[1] * twist_sd):
        raise Refused("two objects" if is_apart else "turning")
    unit = 1 / (whole + 0.23)
    farthest = float(np.abs(flat * wave.gains).max() / wave.gains.max()) * unit
    rms = math.sqrt(bent) * unit
    if is_apart or farthest > LATE[is_full] or rms > RMS[is_full] or wave.miss > MISS[is_full]:
        raise Refused("two objects" if is_apart else "not alike")
    deg = math.degrees(math.atan2(up, right)) % 360
    outline, outline_sd = of_outline
    apart = abs((outline - deg + 90) % 180 - 90)
    is_wide = lit_count >= TAXELS - MOST_EDGE_DARK
    is_edge = is_full or (is_wide and farthest <= LATE_OF_EDGE) or outline_sd > OUTLINE_TELLS
    if is_full:
        agrees = outline_sd >= OUTLINE_MUTE or apart <= 6.5 * outline_sd + 6
    elif is_edge:
        agrees = is_wide and (outline_sd > OUTLINE_MUTE or farthest <= LATE_OF_EDGE)
    else:
        agrees = apart <= min(11.0, 3.2 * outline_sd + 3)
    if not agrees:
        raise Refused("not alike")
    if not is_crossed(peaks, right, up):
        raise Refused("starts on the sensor")
    # Few whiskers cannot tell what is curved.
    left = (curve_scale if is_nearly_full else scale) / math.sqrt(1 + OF_PHASE * wave.lacks**2)
    one_phase = sum(float(weights @ each) ** 2 for each in sines) / weights.sum() ** 2
    of_late, of_miss, of_phase, of_edge, least = np.array(factors).T
    phases = [in_phase(of_phase[way - 1], of_edge[way - 1], way) for way in (1, 2)]
    variances = ((of_late * left) ** 2 + of_miss**2 * wave.miss) * inverse.diagonal()[1:] + phases + flash**2 * LOCKED * one_phase
    variances += least**2
    deviations = np.sqrt(variances) / whole
    beyond = max(turn / whole - TURN[0] * deviations[1], 0.0) if is_nearly_full else 0.0
    deviations = np.hypot(deviations, np.multiply(TURN[1:], beyond)).tolist()
    answer = velocity_of(Motion(rows, columns, *deviations), of_rows, fps, "edge" if is_edge else "outline", lost)
    answer = replace(answer, unevenness=(rms, rms / unit))
    if not is_edge:
        return answer
    # What is curved alike along and across is a dome.
    gain_sd = curve_scale * math.sqrt(of_curve[3, 3] + of_curve[4, 4] - 2 * of_curve[3, 4])
    unit = 8 / whole * answer.mm_s**2 / (4 * PITCH_MM)
    return replace(answer, mm_s2=(curve[3] - curve[4]) * unit, mm_s2_sd=gain_sd * unit)
