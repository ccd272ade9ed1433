"""Live motion by 25 taxels (SPEC section 9, "Live": "By 25 taxels")."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from .constants import NOMINAL_FPS, TAXELS
from .live import Live, LiveAnswer
from .readout import Readout
from .wave import COLUMN, PLACES, RISE, ROW, Motion, Refused, measure_wave, velocity_of

LONGEST_GAP = 7
DARK = 3
SETTLED, HIGHER, STEPS, OLD = 2.5, 8, 6, 6
"""An edge is settled, looked for at most, and tells nothing any more after so many frames."""
GLOW, ALIKE = 0.75, (0.03, 0.01)
CONTINUED, FADED, BEFORE, MOST_TRIES = 16, 0.004, 8, 4
OFF, GROWN, CURVED, ROUND = 0.18, 0.12, (0.12, 0.13, 0.2), 0.6
STABLE, DIFFERS, LEAST = 0.04, 0.1, 0.3
CHANGES, OFF_AFTER_GLOW, UNEVEN = (0.08, 0.03), 0.06, (0.012, 0.11)
MONOMIALS = np.column_stack([np.ones(TAXELS), ROW, COLUMN, ROW**2, COLUMN**2, ROW * COLUMN])
PLANE = MONOMIALS[:, :3]


def front_of(times: np.ndarray, peaks: np.ndarray, has_glowed: bool) -> tuple[np.ndarray, float, float] | None:
    """The slowness of rows and columns, the variance, and the curvature of even edges; None if they are not even."""
    lit = peaks > peaks.max() // 8
    if lit.sum() < TAXELS - 1:
        return None
    fit = lambda columns, of: np.linalg.lstsq(columns[of], times[of], rcond=None)[0]
    times = np.where(lit, times, PLANE @ fit(PLANE, lit))
    every = np.ones(TAXELS, bool)
    plane, curves = fit(PLANE, every), fit(MONOMIALS, every)[3:]
    slowness, off = math.hypot(*plane[1:]), float(np.mean((times - PLANE @ plane) ** 2))
    if slowness == 0:
        return None
    down, right = plane[1:] / slowness
    turned = np.array([[down, right], [right, -down]])
    square = np.array([[curves[0], curves[2] / 2], [curves[2] / 2, curves[1]]])
    bent = 4 / slowness * turned @ square @ turned.T
    along, across, both = bent[0, 0], bent[1, 1], 2 * bent[0, 1]
    dome = min(along, across, key=abs) if along * across > 0 else 0.0
    grown = 4 * np.polyfit(ROW * down + COLUMN * right, peaks, 1)[0] / peaks.mean()
    bend = along - across - grown / 2
    # A dome is no error of a plane.
    by_dome = float(np.mean((dome * slowness / 4 * (ROW**2 + COLUMN**2 - 4)) ** 2))
    is_even = off - by_dome < (OFF * (slowness + 0.3)) ** 2 and abs(bend) < CURVED[0]
    is_even = is_even and not (has_glowed and off >= (OFF_AFTER_GLOW * slowness) ** 2)
    is_even = is_even and abs(both) < CURVED[1] and abs(across - dome) < CURVED[2] and abs(grown) < GROWN
    is_even = is_even and abs(dome) < ROUND
    return (plane[1:], off, bend) if is_even else None


class LiveTaxels(Live):
    """Follows one stream by its taxels as well."""

    def __init__(self, totals: np.ndarray, frames: int, fps: float = NOMINAL_FPS, readout_ms: float | None = 0.0) -> None:
        is_known = readout_ms is not None
        of_rows = Readout((readout_ms / 1000 * fps if is_known else 0.5) / 5, is_known=is_known)
        super().__init__(totals, frames, of_rows, fps)
        self.fps, self.readout_ms = fps, readout_ms
        self.sums: list[list[int] | None] = []
        self.is_followed = False

    def lose(self) -> None:
        """Takes note of a lost frame."""
        super().lose()
        self.sums.append(None)

    def take(self, features: np.ndarray, sums: list[int]) -> tuple[LiveAnswer | None, str | None]:
        """Takes the features and the taxels of the next frame. Returns the answer, and what its velocity is known by."""
        self.sums.append(sums)
        lost = next((n for n, frame in enumerate(self.sums[-2::-1]) if frame is not None), 0)
        lines = self.push(features)
        if not self.is_touched:
            self.is_followed = False
            return lines, None
        if not self.is_followed or lost > LONGEST_GAP:
            self.begin()
        self.is_followed = True
        of_wave = self.follow_taxels(lost + 1)
        if of_wave is not None:
            return of_wave
        if lines is None:
            return None, None
        without = replace(lines, mm_s=None, mm_s_sd=None, deg=None, deg_sd=None)
        # Afterglow falls as light does when the speed does.
        found = self.velocity(without if self.is_dimmed else lines)
        return (without, None) if found is None else (found, "edge")

    def begin(self) -> None:
        dark = [np.array(frame) for frame in self.sums[: -DARK] if frame is not None][-2:]
        self.dark_sums = np.minimum(*dark) if len(dark) == 2 else np.zeros(TAXELS)
        self.brights, self.rises = np.zeros(TAXELS), np.full(TAXELS, -math.inf)
        self.began, self.tries, self.brightest = len(self.sums) - 1, 0, 0.0
        self.is_over = self.has_glowed = False
        self.agreed: bool | None = None
        self.slowness: np.ndarray | None = None

    def rising(self, taxel: int) -> float:
        """When light exceeded the level of its peak, which is the light of now."""
        now = len(self.sums) - 1
        light = lambda t: max(self.sums[t][taxel] - self.dark_sums[taxel], 0.0)
        after, level = now, RISE * light(now)
        for t in range(now - 1, now - 1 - STEPS, -1):
            if t < 0 or self.sums[t] is None:
                continue
            if light(t) <= level:
                return after - (light(after) - level) / (light(after) - light(t)) * (after - t)
            after = t
        return now - STEPS

    def follow_taxels(self, frames: int) -> tuple[LiveAnswer, str] | None:
        """Takes the newest frame, `frames` after the last. Returns the answer of a wave that has just ended."""
        now = len(self.sums) - 1
        here, before = (np.array(self.sums[t]) - self.dark_sums for t in (now, now - frames))
        light, light_before = np.maximum(here, 0), np.maximum(before, 0)
        for taxel in np.flatnonzero(light > self.brights):
            # One that has never been lit has a peak of 0.
            if now - self.rises[taxel] < SETTLED or light[taxel] >= HIGHER * self.brights[taxel]:
                self.brights[taxel], self.rises[taxel] = light[taxel], self.rising(taxel)
        total, total_before = light.sum(), light_before.sum()
        self.brightest = max(self.brightest, total)
        part = total / max(total_before, 1)
        left = part if frames == 1 else math.sqrt(part)
        limit = ALIKE[0] * light_before.max() + ALIKE[1] * self.brights.max()
        is_over = frames <= 2 and left < GLOW and bool((np.abs(here - part * before) <= limit).all())
        was_over, has_grown = self.is_over, total > total_before + self.brightest // 64
        self.has_glowed = self.has_glowed or was_over
        self.is_over = is_over or (was_over and not has_grown)
        if not is_over or was_over or 16 * total_before < self.brightest or self.tries == MOST_TRIES:
            return None
        self.tries += 1
        glow, part = [], left
        while len(glow) < CONTINUED and total * part > FADED * self.brightest * left:
            glow.append(np.floor(self.dark_sums + part * here + 0.5).astype(int).tolist())
            part *= left
        known = min(now - self.began + 1 + BEFORE, 70 - len(glow))
        found = measure_wave(self.sums[-known:] + glow, self.fps, self.readout_ms)
        mean, late = found.unevenness
        is_uneven = late >= UNEVEN[1] or (self.has_glowed and mean > UNEVEN[0])
        if found.why is not None or is_uneven:
            return None
        return LiveAnswer("slide", found.mm_s, found.mm_s_sd, found.deg, found.deg_sd), found.basis

    def velocity(self, lines: LiveAnswer) -> LiveAnswer | None:
        """The velocity of lines or edges in the newest frame."""
        if self.is_over:
            return None
        if self.agreed is not None:
            return lines if self.agreed and lines.mm_s is not None else None
        before, front = self.slowness, front_of(self.rises, self.brights, self.has_glowed)
        self.slowness = None
        if front is None:
            return None
        slowness, variance, bend = front
        whole = math.hypot(*slowness)
        near = lambda other, part, size: math.hypot(*(other - slowness)) < part * math.hypot(*size)
        is_steady = lambda more: abs(bend * whole - more) < CHANGES[0] * whole + CHANGES[1]
        if lines.mm_s is not None:
            of_lines = np.array([axis.slowness for axis in self.axes])
            if near(of_lines, DIFFERS, of_lines):
                self.agreed = is_steady(math.hypot(*of_lines) - whole)
            return lines if self.agreed else None
        self.slowness = slowness
        is_stable = is_steady(0.0) and before is not None and near(before, STABLE, slowness)
        if not is_stable or len(self.sums) - 1 - self.rises.max() >= OLD or whole < LEAST:
            return None
        rows, columns = self.readout.of_light(*slowness)
        sd = math.sqrt(variance / 50) / math.hypot(rows, columns)
        try:
            found = velocity_of(Motion(rows, columns, sd, sd), self.readout, self.fps, "edge", 0.0)
        except Refused:
            return None
        return LiveAnswer("slide", found.mm_s, found.mm_s_sd, found.deg, found.deg_sd)
