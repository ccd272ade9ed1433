"""Splits slides into those that train a texture model and those that test it. Needs NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

TEST_SHARE = 0.1
"""The paper's split is 9 : 1."""


def tenth(labels: np.ndarray, seed: int) -> np.ndarray:
    """Returns the paper's split: a mask of the slides that test, a tenth of those of each label, drawn with this seed."""
    random = np.random.default_rng(seed)
    mask = np.zeros(len(labels), bool)
    for label in np.unique(labels):
        rows = np.flatnonzero(labels == label)
        mask[random.permutation(rows)[: round(TEST_SHARE * len(rows))]] = True
    return mask


@dataclass(frozen=True)
class Deployed:
    """Masks of slides that do not overlap: `train`, and four kinds of tests, by what training never saw of them.

    `seen` are slides at speeds and of runs that others in `train` have, too. `speeds` are at speeds that none in
    `train` has, of runs that are known. `runs` are of runs that none in `train` has, at speeds that are known. Neither
    is known of `both`.
    """

    train: np.ndarray
    seen: np.ndarray
    speeds: np.ndarray
    runs: np.ndarray
    both: np.ndarray


def deployed(speed: np.ndarray, run: np.ndarray, specimen: np.ndarray, out: int, seed: int) -> Deployed:
    """Keeps a part `out` of all speeds and of all runs from training, drawn with this seed, and a tenth of the rest."""
    random = np.random.default_rng(seed)
    new_speed = np.isin(speed, random.choice(np.unique(speed), out, replace=False))
    new_run = np.isin(run, random.choice(np.unique(run), out, replace=False))
    known = ~new_speed & ~new_run
    seen = np.zeros(len(speed), bool)
    seen[known] = tenth(specimen[known], seed)
    return Deployed(known & ~seen, seen, new_speed & ~new_run, new_run & ~new_speed, new_speed & new_run)
