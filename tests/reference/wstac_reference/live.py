"""Motion frame by frame while something slides (SPEC section 9, "Live")."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from .constants import FEATURES, NOMINAL_FPS, UNIT
from .motion import PITCH_MM
from .readout import GLOBAL, Readout, contact

LIT = 409 / UNIT
EDGE = 77 / 256
K = np.arange(5) - 2
RING = 70


@dataclass(frozen=True)
class LiveAnswer:
    """What is said of a frame; `mm_s` and the rest are None unless a velocity is known."""

    contact: str
    mm_s: float | None = None
    mm_s_sd: float | None = None
    deg: float | None = None
    deg_sd: float | None = None


@dataclass
class Axis:
    """The slowness of the lines along one axis, what was known of it before, and the sums of its comparisons."""

    slowness: float
    variance: float
    frame: int
    """The next frame to compare, as an index of the history."""
    known: tuple[float, float] = (0.0, 0.0)
    normal: np.ndarray = field(default_factory=lambda: np.zeros((2, 2)))
    moments: np.ndarray = field(default_factory=lambda: np.zeros(2))
    energy: float = 0.0
    count: float = 0.0
    is_behind: bool = False

    def __post_init__(self) -> None:
        self.known = (self.slowness, self.variance)


def spline(u: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights of three frames around a place, u = -0.5..0.5 frames from the middle one, and those of the derivative."""
    values = np.array([(0.5 - u) ** 2 / 2, 0.75 - u * u, (0.5 + u) ** 2 / 2])
    return values, np.array([u - 0.5, -2 * u, u + 0.5])


def alike(light: np.ndarray) -> bool:
    """Whether the peaks of five lines are those of something that crosses the whole sensor."""
    mirrored = np.minimum(light, light[::-1]) > 0.65 * np.maximum(light, light[::-1])
    return bool(light.min() > light.max() / 2 and mirrored.all())


class Live:
    """Follows one stream. `totals` are the baseline's sums over `frames` frames."""

    def __init__(self, totals: np.ndarray, frames: int, readout: Readout = GLOBAL, fps: float = NOMINAL_FPS) -> None:
        self.readout, self.fps = readout, fps
        self.means = np.floor(totals / frames) / UNIT
        self.base = np.exp(self.means)
        self.history: list[np.ndarray] = []
        self.lost = 0
        self.reset()

    def reset(self) -> None:
        self.onset: list[int | None] = [None] * FEATURES
        self.dark = 0
        self.faded = 0.0
        self.axes: list[Axis] | None = None
        self.is_dimmed = False
        self.is_lost = False

    @property
    def is_touched(self) -> bool:
        return any(onset is not None for onset in self.onset)

    def lose(self) -> None:
        """Fills a lost frame."""
        self.history.append(self.history[-1])
        self.lost += 1

    def light(self, frame: int, line: int) -> float:
        return math.exp(self.history[frame][line]) - self.base[line]

    @property
    def of_light(self) -> tuple[float, float]:
        assert self.axes is not None
        return self.readout.of_light(self.axes[0].slowness, self.axes[1].slowness)

    @property
    def whole(self) -> float:
        return math.hypot(*self.of_light)

    def push(self, features: np.ndarray) -> LiveAnswer | None:
        """Takes the ten features of the next frame, in units of 2^-11."""
        self.history.append(features / UNIT)
        frames, self.lost = self.lost + 1, 0
        if frames > 8:
            self.reset()
        now = len(self.history) - 1
        newest = self.history[now]
        lit = newest > self.means + LIT
        if not lit.any() and not self.is_touched:
            return None
        for line in np.flatnonzero(lit):
            if self.onset[line] is None:
                self.onset[line] = now
        self.dark = 0 if lit.any() else self.dark + frames
        if self.dark > 2 + (math.floor(2 * min(self.whole, 13)) if self.axes else 0):
            self.reset()
            return None
        is_crossing = self.axes is not None and now <= self.level_from
        growth = (newest - self.history[now - 1])[lit].max() if lit.any() else -math.inf
        self.faded = max(self.faded + growth, -16) if growth < -41 / UNIT and not is_crossing else 0.0
        if self.axes is None:
            answer = LiveAnswer(self.arrive(now))
        else:
            self.follow(now, frames)
            if not any(axis.is_behind for axis in self.axes):
                self.look(now, 1)
            answer = self.answer()
        return answer if lit.any() else None

    def arrive(self, now: int) -> str:
        """The kind of a touch whose light is arriving. Sets the axes once it has."""
        onsets = [onset for onset in self.onset if onset is not None]
        rows, columns = (sum(onset is not None for onset in part) for part in (self.onset[:5], self.onset[5:]))
        if min(rows, columns) < 5:
            is_poke = max(rows, columns) <= 2 and min(rows, columns) > 0 and self.faded < -717 / UNIT
            return "poke" if is_poke else "unclear"
        if now - max(onsets) < 2 or now - min(onsets) > RING - 2:
            return "unclear"
        axes, offs = [], []
        for first in (0, 5):
            edges = np.array([self.edge(first + k, self.onset[first + k]) for k in range(5)])
            slowness = float(K @ edges) / 10
            off = edges - edges.mean() - K * slowness
            axes.append(Axis(slowness, float(off @ off) / 30 + 0.03**2, math.floor(edges.mean() - 1)))
            offs.append(np.abs(off).max())
        self.axes = axes
        self.excess = max(max(offs) - (0.3 * self.whole + 0.1), 0.0)
        self.level_from = max(math.floor(4 * min(abs(axis.slowness) for axis in axes)), 2) + now
        self.settles = math.ceil(min(max(self.whole, 1), 13))
        self.changing = 0
        self.off = 0.0
        self.peaks = np.full(FEATURES, -16.0)
        self.seen = [0, 0]
        self.all_seen = [math.floor(4 * abs(axis.slowness)) + 3 for axis in reversed(axes)]
        self.look(now, 16)
        return contact(*self.of_light, self.readout, self.fps)

    def look(self, now: int, most: int) -> None:
        """Compares the lines of each axis in up to `most` further frames since each was first lit."""
        is_new = False
        for axis, first in enumerate((0, 5)):
            onsets = self.onset[first : first + 5]
            end = min(self.all_seen[axis], now - max(onsets) + 1, self.seen[axis] + most)
            for line, onset in enumerate(onsets, first):
                for frame in range(onset + self.seen[axis], onset + end):
                    if now - frame < RING:
                        self.peaks[line] = max(self.peaks[line], self.history[frame][line])
            is_new |= self.seen[axis] < end
            self.seen[axis] = max(self.seen[axis], end)
        if is_new:
            self.is_alike = all(alike(light) for light in (np.exp(self.peaks) - self.base).reshape(2, 5))

    def edge(self, line: int, onset: int) -> float:
        values = [self.light(onset + t, line) for t in (-1, 0, 1, 2)]
        level = EDGE * max(values[1:])
        for t, (before, here) in enumerate(zip(values, values[1:])):
            if here > level:
                return onset + t - 1 + min(max(level - before, 0.0) / (here - before), 1.0)
        raise AssertionError("a peak is above 30 % of itself")

    def follow(self, now: int, frames: int) -> None:
        whole = self.whole
        length, usual = 3 + 1.5 * whole, 0.0065 + 0.017 * min(whole, 2)
        change = self.level(now, whole, frames)
        self.is_dimmed |= change < 0
        for first, axis, delay in zip((0, 5), self.axes, (self.readout.rows, self.readout.columns)):
            if change:
                light = (axis.slowness + delay) * math.exp(-change)
                sd = math.sqrt(axis.variance) * math.exp(-change) + 0.06 * abs(change) * abs(light)
                slowness = light - delay
                axis.__init__(slowness, min(sd * sd, 1.0), now + 1 + math.floor(2 * abs(slowness)))
            self.compare(axis, first, now, length, usual)

    def level(self, now: int, whole: float, frames: int) -> float:
        """The natural logarithm of the factor by which all lines have grown, if they tell another speed."""
        self.off = math.inf if self.is_lost else 0.0
        if self.is_lost or now < self.level_from:
            return 0.0
        if now - frames < self.level_from:
            self.settled_from = now + self.settles
            return 0.0
        means = self.means_of_a_pitch(now, whole)
        if now - frames < self.settled_from:
            self.reference = means
            return 0.0
        self.changing = max(self.changing - frames, 0)
        changes = means - self.reference
        mean = float(changes.mean())
        if not (changes.min() > mean / 2 if mean > 0 else changes.max() < mean / 2):
            return 0.0
        rows, columns = np.abs(self.of_light)
        is_diagonal = abs(rows - columns) < 0.1 * (rows + columns)
        self.is_lost = abs(mean) >= (0.1 if is_diagonal else 0.5)
        self.off = math.inf if self.is_lost else 0.3 * mean
        if self.is_lost or abs(mean) <= (0.02 if self.changing else 0.1):
            return 0.0
        self.changing = math.floor(4 + 3 * whole)
        self.reference = means
        return mean

    def means_of_a_pitch(self, now: int, whole: float) -> np.ndarray:
        """The mean features over the newest frames, in which the surface has moved by a pitch: at least one frame."""
        length = min(max(whole, 1), 13)
        weight, count = math.floor(4096 / length), math.floor(length)
        frames = self.history[now + 1 - count : now + 1]
        rest = (4096 - count * weight) * self.history[now - count]
        return (weight * np.sum(frames, axis=0) + rest) / 4096

    def compare(self, axis: Axis, first: int, now: int, length: float, usual: float) -> None:
        """Up to four comparisons of five lines, and the slowness that follows."""
        s = axis.slowness
        axis.frame = max(axis.frame, now + math.floor(2 * abs(s) + 0.5) + 4 - RING)
        sums = []
        while len(sums) < 4 and axis.frame + 2 * abs(s) + 0.5 < now:
            y, d = np.zeros(5), np.zeros(5)
            for i, k in enumerate(K):
                at = axis.frame + k * s
                middle = math.floor(at + 0.5)
                values, derivative = spline(at - middle)
                light = np.array([self.light(middle + t, first + i) for t in (-1, 0, 1)])
                y[i], d[i] = values @ light, derivative @ light
            sums.append((np.array([y.sum(), d.sum()]), float(K @ y)))
            axis.frame += 1
        axis.is_behind = axis.frame + 1 + 2 * abs(s) + 0.5 < now
        if not sums:
            return
        told = sum(part[1] ** 2 for part, _ in sums) * axis.count
        new = min(told / axis.normal[1, 1], len(sums)) if axis.normal[1, 1] > 0 else len(sums)
        forgotten = min(new / length, 1.0)
        axis.normal = (1 - forgotten) * axis.normal + sum(np.outer(part, part) for part, _ in sums)
        axis.moments = (1 - forgotten) * axis.moments + sum(part * moment for part, moment in sums)
        axis.energy = (1 - forgotten) * axis.energy + sum(moment**2 for _, moment in sums)
        axis.count = (1 - forgotten) * axis.count + len(sums)
        mm, dd = axis.normal[0, 0], axis.normal[1, 1]
        determinant = float(np.linalg.det(axis.normal))
        if axis.count < 1.5 or determinant <= 1e-6 * mm * dd:
            return
        most = 0.1 + 0.1 * abs(s)
        excess = float(np.clip(np.linalg.solve(axis.normal, axis.moments)[1] / 2, -most, most))
        rest = max(axis.energy - axis.moments[0] ** 2 / mm, 0.0) + 1.6 * usual**2 * mm / axis.count
        information = 4 * determinant / mm * (max(axis.count - 2, 0.0) + 4) / rest
        known, variance = axis.known
        variance = min(variance * min(1 + variance * information * forgotten, 2), 1.0)
        axis.known = (known, variance)
        axis.variance = 1 / (1 / variance + information)
        axis.slowness = (known / variance + (s - excess) * information) * axis.variance
        moved = 2 * (s - axis.slowness)
        axis.energy += moved * (moved * dd - 2 * axis.moments[1])
        axis.moments = axis.moments - moved * axis.normal[:, 1]

    def answer(self) -> LiveAnswer:
        (rows, columns), whole = self.of_light, self.whole
        kind = contact(rows, columns, self.readout, self.fps)
        if kind != "slide" or self.faded < -717 / UNIT or not self.is_alike:
            return LiveAnswer(kind)
        always = (0.001 + 0.005 * min(whole, 1.5)) ** 2 + self.excess**2
        row_sd, column_sd = (math.sqrt(axis.variance + always) / whole for axis in self.axes)
        row, column = rows / whole, columns / whole
        sd = math.sqrt((column * column_sd) ** 2 + (row * row_sd) ** 2 + self.off**2)
        is_behind = whole < 0.6 and any(axis.is_behind for axis in self.axes)
        turned = math.hypot(row * column_sd, column * row_sd)
        if sd > 0.06 or turned * min(whole, 0.5) > 0.022 or is_behind or self.readout.moves_too_far(rows, columns):
            return LiveAnswer(kind)
        mm_s = PITCH_MM * self.fps / whole
        off = [of / math.sqrt(3) for of in self.readout.off(rows, columns)]
        direction = math.degrees(math.atan2(-row, column)) % 360
        return LiveAnswer(
            kind, mm_s, mm_s * math.hypot(sd, off[0]), direction, math.degrees(math.hypot(turned, off[1]))
        )
