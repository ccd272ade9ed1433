"""Samples of touches, and what the reference says of their light along the path."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wstac_reference.constants import COLUMNS, FEATURES, ROWS, SAMPLE_FRAMES, UNIT
from wstac_reference.path_sample import period, sums_along, taxels_along
from wstac_reference.readout import GLOBAL, Readout
from wstac_reference.rng import SplitMix64, seed_of

from . import SEED
from .shutters import SHUTTERS, readout_of

TAXELS = ROWS * COLUMNS
DARK = 800
"""Sum of a dark taxel."""
FULL_SCALE = 637_500
BASELINE_FRAMES = 25
MOTIONS = [
    *((14, 75), (30, 3), (50, 88), (70, 200), (95, 314), (120, 45)),
    *((150, 270), (190, 121), (240, 180), (300, 33), (420, 251)),
]
"""Speed in mm/s and direction in degrees."""
LOST = [
    *((50, 88, (20, 31)), (95, 314, (16, 20, 24)), (120, 45, (18, 19)), (150, 200, (3, 17, 22))),
    *((140, 275, (19, 20, 21, 22, 23, 24, 25)), (240, 180, (21,))),
]
"""Motions with the numbers of lost frames."""
PERIODIC = [
    *((25, 75, 3.2), (32, 340, 4.0), (45, 200, 4.6), (60, 90, 6.0), (60, 33, 9.5), (75, 121, 7.0), (110, 251, 11.0)),
    *((60, 10, 2.9), (100, 45, 4.0), (40, 270, 14.0), (300, 5, 10.0)),
]
"""Speed, direction and period in mm of even textures. The first has too little path, and the last four are out of range."""
RELATIVE_SD = 0.004


def texture(rng: SplitMix64) -> list[tuple[float, float, float]]:
    """Bumps along a path: where they are in mm, how bright and how wide in mm."""
    drawn = rng.below(1000, (14, 3)) / 1000
    return [(5.0 * k + 4 * where, 0.1 + bright, 1.5 + 2 * width) for k, (where, bright, width) in enumerate(drawn)]


def light(bumps: list[tuple[float, float, float]], x: float) -> float:
    """Light of the bumps at a place behind the leading edge."""
    return sum(bright * math.exp(-(((x - where) / width) ** 2)) for where, bright, width in bumps)


def taxel_sums(rng: SplitMix64, mm_s: float, degrees: float, weak: int | None, readout: Readout,
               period_mm: float | None) -> np.ndarray:
    """25 sums over 70 frames of a texture that slides over them; every whisker has its gain and its own bumps."""
    bumps = texture(rng) if period_mm is None else [(period_mm * k, 1.0, period_mm / 3) for k in range(30)]
    gains = (600 + rng.below(800, TAXELS)) / 1000
    shake = rng.below(81, (TAXELS, SAMPLE_FRAMES)) - 40
    right, up = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    sums = np.empty((TAXELS, SAMPLE_FRAMES), dtype=np.int64)
    for k in range(TAXELS):
        own = bumps if period_mm else bumps[: 10 + k % 5]
        behind = 4 * ((k % 5 - 2) * right + (2 - k // 5) * up)
        late = (k // 5 - 2) * readout.rows + (k % 5 - 2) * readout.columns
        gain = 0.01 if k == weak else gains[k]
        for t in range(SAMPLE_FRAMES):
            at = (t + late - 14) * mm_s / 30 - behind - 14
            sums[k, t] = DARK + round(90_000 * gain * light(own, at)) + shake[k, t]
    return sums


def features_of(sums: np.ndarray) -> np.ndarray:
    """Ten features of 25 sums, with no regard to a floor."""
    of = sums.reshape(ROWS, COLUMNS, SAMPLE_FRAMES)
    lines = np.concatenate([of.sum(axis=1), of.sum(axis=0)])
    return np.round(UNIT * np.log(lines / (5 * FULL_SCALE))).astype(np.int64)


def rounded(numbers: np.ndarray | None) -> list[int] | None:
    """Numbers in units of 2^-11."""
    return None if numbers is None else np.round(UNIT * numbers).astype(np.int64).tolist()


def path_cases() -> list[dict[str, Any]]:
    """Every case with its numbers and answers."""
    cases: list[tuple[str, float, float, int | None, int | None, tuple[int, ...], float | None]] = []
    for mm_s, degrees in MOTIONS:
        cases.append((f"path-{mm_s}-{degrees}", mm_s, degrees, None, None, (), None))
    cases += [("path-weak-100-20", 100, 20, 7, None, (), None), ("path-weak-200-290", 200, 290, 12, None, (), None)]
    for shutter, (mm_s, degrees) in zip((0, 2, 3, 4, 6, 7), MOTIONS[4:]):
        cases.append((f"path-rolling-{mm_s}-{degrees}", mm_s, degrees, None, shutter, (), None))
    cases += [(f"path-lost-{mm_s}-{degrees}", mm_s, degrees, None, None, lost, None) for mm_s, degrees, lost in LOST]
    cases += [(f"path-periodic-{mm_s}-{mm}", mm_s, degrees, None, None, (), mm) for mm_s, degrees, mm in PERIODIC]
    totals = np.full(FEATURES, BASELINE_FRAMES * round(UNIT * math.log(DARK / FULL_SCALE)))
    made = []
    for name, mm_s, degrees, weak, shutter, lost, period_mm in cases:
        readout = GLOBAL if shutter is None else readout_of(SHUTTERS[shutter])
        sums = taxel_sums(SplitMix64(seed_of(f"path-{name}", SEED)), mm_s, degrees, weak, readout, period_mm)
        features = features_of(sums)
        taxel_path, whole, seen = taxels_along(sums, mm_s, degrees, readout, frozenset(lost)) or (None, None, 0)
        made.append(
            {
                "name": name,
                "mm_s": mm_s,
                "deg": degrees,
                "shutter": shutter,
                "full_scale": FULL_SCALE,
                "totals": totals.tolist(),
                "frames": BASELINE_FRAMES,
                "sums": sums.T.tolist(),
                "features": features.T.tolist(),
                "path": rounded(sums_along(features, totals, BASELINE_FRAMES, mm_s, degrees, readout)),
                "taxel_path": rounded(taxel_path),
                "lost": lost,
                "whole_steps": whole,
                "relative_sd": RELATIVE_SD,
                "period": None if taxel_path is None else period(taxel_path, seen, mm_s, RELATIVE_SD),
            }
        )
    return made
