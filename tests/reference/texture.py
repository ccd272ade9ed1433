"""The paper's texture task on simulated slides: data from `wstac.dataset`, and the accuracy of a linear SVM.

Needs scikit-learn (requirements-train.txt) and the Python package (`ci/build wheel into PYTHON`).
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from sklearn.model_selection import train_test_split
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC

from scenes import DEFAULTS, WORKERS, Changes
from slides import Slides, Sweep, made

SPEED_MM_S = 150
"""The paper does not state at what speed its textures were taken: the middle of its speeds, a guess."""
DIRECTION_DEG = 0
"""Nor in which direction: a guess."""
SLIDES = 100
"""Of every specimen."""
TEST_SHARE = 0.1
"""The split is 9 : 1."""
SEEDS_APART = 100_000
"""Seeds of datasets with no slide in common are this far apart."""


def sweep(seed: int, changes: Changes = DEFAULTS) -> Sweep:
    """Returns the slides of the paper's texture task: one speed, one direction."""
    return Sweep(seed, SLIDES, [SPEED_MM_S], [DIRECTION_DEG], changes=changes)


def dataset(seed: int, changes: Changes = DEFAULTS) -> Slides:
    """Returns those slides' samples."""
    return made(sweep(seed, changes))


def svm_accuracy(data: Slides, split_seed: int) -> float:
    """Returns the accuracy of a linear SVM on a tenth that is held out, stratified, after training on the rest."""
    x_train, x_test, y_train, y_test = train_test_split(
        data.features(), data.specimen, test_size=TEST_SHARE, stratify=data.specimen, random_state=split_seed
    )
    model = make_pipeline(StandardScaler(), SVC(kernel="linear", C=1))
    return float(model.fit(x_train, y_train).score(x_test, y_test))


def svm_accuracies(data: Sequence[Slides], splits: int) -> list[float]:
    """Returns the mean accuracy for each dataset, over splits with the seeds 0, 1 …"""
    with ThreadPoolExecutor(WORKERS) as pool:
        means = []
        for one in data:
            jobs = [pool.submit(svm_accuracy, one, seed) for seed in range(splits)]
            means.append(statistics.fmean(job.result() for job in jobs))
    return means
