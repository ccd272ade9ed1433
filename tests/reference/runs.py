"""Runs: a run is what a sensor sees between two mountings, and the gain of the light is the same for all of its slides.
Needs NumPy only.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from scenes import DIRECTIONS, WORKERS
from slides import Slides, Sweep, made, together

GAIN_DEVIATION = 0.2
"""From run to run, as a share: the light of similar sensors was seen to vary by 9 to 29 %."""
GAINS = (0.5, 1.5)
"""Gains are held within these."""
SEEDS_APART = 10_000
"""Seeds of a run's first slide and of the next run's: no run has as many slides."""


@dataclass(frozen=True)
class Runs:
    """Slides of several runs. `run` is (n,), the number of each slide's run, and `gains` has one for each run."""

    slides: Slides
    run: np.ndarray
    gains: np.ndarray


def gains(count: int, seed: int) -> np.ndarray:
    """Returns the light's gains of some runs."""
    drawn = np.random.default_rng(seed).normal(1, GAIN_DEVIATION, count)
    return np.round(np.clip(drawn, *GAINS), 3)


def sweeps(
    seed: int, speeds: Sequence[Sequence[float]], slides: int, units: Sequence[int]
) -> list[Sweep]:
    """Returns one sweep per run, of a sensor unit and with speeds of its own.

    The directions start one further in every run, so that all of them occur even if a run has too few slides for them.
    """
    sizes = zip(gains(len(units), seed), speeds, units, strict=True)
    return [
        Sweep(seed + n * SEEDS_APART, slides, speeds, DIRECTIONS[n % 4 :] + DIRECTIONS[: n % 4], float(gain), unit)
        for n, (gain, speeds, unit) in enumerate(sizes)
    ]


def run_all(wanted: Sequence[Sweep]) -> Runs:
    """Simulates the slides of all runs."""
    with ThreadPoolExecutor(WORKERS) as pool:
        parts = list(pool.map(made, wanted))
    run = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    return Runs(together(parts), run, np.array([sweep.gain for sweep in wanted]))
