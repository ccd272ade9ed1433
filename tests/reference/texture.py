"""The paper's texture task on simulated slides: data from `wstac dataset`, and how often a linear SVM is right.

Needs scikit-learn (requirements-train.txt).
"""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sklearn.model_selection import train_test_split
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC

from scenes import DEFAULTS, SPECIMENS, WORKERS, Changes, run_wstac

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


@dataclass(frozen=True)
class Dataset:
    """Samples: `x` is (n, 700), natural logarithms, feature by feature; `specimen` is (n,), an index."""

    x: np.ndarray
    specimen: np.ndarray


def sweep_text(seed: int, changes: Changes = DEFAULTS) -> str:
    """The TOML text of a sweep for `wstac dataset`: ten specimens, one speed, one direction."""
    names = ", ".join(f'"{name}"' for name in SPECIMENS)
    lines = [f"specimens = [{names}]", f"speeds = [{SPEED_MM_S}]", f"directions = [{DIRECTION_DEG}]"]
    lines += [f"slides = {SLIDES}", f"seed = {seed}", "[scene]", 'fidelity = "taxel"']
    if changes.noise is not None:
        lines.append(f"noise = {changes.noise}")
    if changes.length_mm is not None:
        lines.append(f"length = {changes.length_mm}")
    if changes.afterglow_ms is not None:
        lines += ["[scene.light]", f"afterglow_ms = {changes.afterglow_ms}"]
    return "\n".join(lines) + "\n"


def dataset(seed: int, changes: Changes = DEFAULTS) -> Dataset:
    """What `wstac dataset` makes of the sweep. Its slides have this seed, the next, and so on."""
    with tempfile.TemporaryDirectory() as folder:
        sweep, file = Path(folder, "sweep.toml"), Path(folder, "samples.npz")
        sweep.write_text(sweep_text(seed, changes))
        run_wstac(["dataset", str(sweep), "-o", str(file)])
        with np.load(file) as arrays:
            # Units of a feature, int16 (n, 10, 70), and what one is worth.
            x = arrays["X"].reshape(len(arrays["X"]), -1) * float(arrays["scale"])
            specimen = np.array(arrays["y_specimen"])
    expected = SLIDES * len(SPECIMENS)
    if len(x) != expected:
        raise SystemExit(f"wstac dataset made {len(x)} samples, expected {expected}")
    return Dataset(x, specimen)


def svm_accuracy(data: Dataset, split_seed: int) -> float:
    """Share of the tenth that is held out, stratified, that a linear SVM trained on the rest names rightly."""
    x_train, x_test, y_train, y_test = train_test_split(
        data.x, data.specimen, test_size=TEST_SHARE, stratify=data.specimen, random_state=split_seed
    )
    model = make_pipeline(StandardScaler(), SVC(kernel="linear", C=1))
    return float(model.fit(x_train, y_train).score(x_test, y_test))


def svm_accuracies(data: Sequence[Dataset], splits: int) -> list[float]:
    """For each dataset, the mean accuracy over splits with the seeds 0, 1 …"""
    with ThreadPoolExecutor(WORKERS) as pool:
        means = []
        for one in data:
            jobs = [pool.submit(svm_accuracy, one, seed) for seed in range(splits)]
            means.append(statistics.fmean(job.result() for job in jobs))
    return means
