"""The slides that train, choose and evaluate the shipped models. Needs NumPy only."""

from __future__ import annotations

import numpy as np

from runs import GAINS, SEEDS_APART, sweeps
from scenes import DIRECTIONS
from slides import Sweep

SEED = 70_000_000
CHECK_SEED = 80_000_000
TEST_SEED = 90_000_000
"""First seeds of the slides that train, that choose, and that judge."""
CHECK_UNIT = 1000
TEST_UNIT = 2000
"""First sensors of the slides that choose and that judge; those that train are 0 and on."""
TRAIN_RUNS = 88
CHECK_RUNS = 10
TEST_RUNS = 20
"""Every run is of a sensor of its own, and in one direction: they take turns."""
SPEEDS = tuple(range(50, 301, 25))
"""Speeds in mm/s of the slides that choose and judge; those that train are drawn between the first and the last."""


def training_sweeps() -> list[Sweep]:
    """Returns slides that vary at least as much as in use. Gains of the light and speeds are drawn evenly from the
    expected range.
    """
    random = np.random.default_rng(SEED)
    between = np.geomspace(SPEEDS[0], SPEEDS[-1], len(SPEEDS))
    step = between[1] / between[0]
    wanted = []
    for run in range(TRAIN_RUNS):
        drawn = between * step ** random.uniform(-0.5, 0.5, len(between))
        speeds = [round(float(speed), 1) for speed in np.clip(drawn, SPEEDS[0], SPEEDS[-1])]
        gain = round(float(random.uniform(*GAINS)), 3)
        directions = DIRECTIONS[run % 4 :] + DIRECTIONS[: run % 4]
        wanted.append(Sweep(SEED + run * SEEDS_APART, len(SPEEDS), speeds, directions, gain, run))
    return wanted


def check_sweeps() -> list[Sweep]:
    """Returns slides of other sensors, to choose among trained models."""
    return sweeps(CHECK_SEED, [SPEEDS] * CHECK_RUNS, len(SPEEDS), range(CHECK_UNIT, CHECK_UNIT + CHECK_RUNS))


def test_sweeps() -> list[Sweep]:
    """Returns slides of still other sensors, to evaluate the chosen model."""
    return sweeps(TEST_SEED, [SPEEDS] * TEST_RUNS, len(SPEEDS), range(TEST_UNIT, TEST_UNIT + TEST_RUNS))
