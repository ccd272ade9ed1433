"""Trains, chooses and judges the models that are shipped. Needs what requirements-train.txt names."""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from candidates import CANDIDATES, Candidate, answers
from runs import GAINS, Runs, run_all, sweeps
from scenes import DIRECTIONS, run_wstac
from shipped_report import Judged, page
from slides import Slides, Sweep

SEED = 70_000_000
CHECK_SEED = 80_000_000
TEST_SEED = 90_000_000
"""First seeds of the slides that train, that choose, and that judge."""
SEEDS_APART = 10_000
"""From one run to the next."""
TRAIN_RUNS = 88
CHECK_RUNS = 10
TEST_RUNS = 20
"""Every run is of a sensor of its own, and in one direction: they take turns."""
SPEEDS = tuple(range(50, 301, 25))
"""Speeds in mm/s of the slides that choose and judge; those that train are drawn between the first and the last."""
MOST_BYTES = {"svm": 64_000, "forest": 100_000, "boosted": 100_000}
"""Largest model of each kind."""


def training_sweeps() -> list[Sweep]:
    """Slides as varied as in use and more: gains of the light and speeds are drawn evenly from all that is expected."""
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


def other_runs(seed: int, count: int, first_unit: int) -> Runs:
    """Runs of other sensors than those that train, with other gains."""
    return run_all(sweeps(seed, [SPEEDS] * count, len(SPEEDS), range(first_unit, first_unit + count)))


@dataclass(frozen=True)
class Imported:
    """A model file as it was made of a trained model, and what importing said."""

    candidate: Candidate
    path: Path
    trained: object
    said: dict[str, object]


def imported(candidate: Candidate, train: Slides, folder: Path) -> Imported:
    """Trains a candidate and makes a model file of it."""
    model = candidate.train(train.features(), train.specimen)
    file, options = candidate.save(model, folder)
    path = folder / f"{candidate.kind}.wsm"
    run_wstac(["model", "import", str(file), "-o", str(path), *options])
    return Imported(candidate, path, model, json.loads(run_wstac(["model", "inspect", str(path), "--json"])))


def named(model: Path, slides: Slides) -> np.ndarray:
    """What a model file says of slides."""
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder, "data.npz")
        np.savez(data, X=slides.x)
        found = json.loads(run_wstac(["model", "eval", str(model), str(data), "--json"]))
    return np.array(found["predictions"])


def write(folder: Path) -> None:
    """Writes svm.wsm, forest.wsm, boosted.wsm, and README.md about them."""
    train = run_all(training_sweeps()).slides
    check = other_runs(CHECK_SEED, CHECK_RUNS, 1000).slides
    test = other_runs(TEST_SEED, TEST_RUNS, 2000)
    judged = []
    with tempfile.TemporaryDirectory() as work:
        for number, candidate in enumerate(CANDIDATES):
            place = Path(work, str(number))
            place.mkdir()
            one = imported(candidate, train, place)
            right = float(np.mean(named(one.path, check) == check.specimen))
            judged.append((one, right))
            print(f"{candidate.words}: {one.said['bytes']} bytes, {100 * right:.1f} %", file=sys.stderr, flush=True)
        lines = []
        for kind, most in MOST_BYTES.items():
            small = [(one, right) for one, right in judged if one.candidate.kind == kind and one.said["bytes"] <= most]
            if not small:
                raise SystemExit(f"no candidate for {kind} has {most} bytes or fewer")
            best = max(small, key=lambda pair: pair[1])[0]
            folder.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(best.path, folder / best.path.name)
            print(folder / best.path.name)
            found = named(best.path, test.slides)
            alike = int(np.sum(found == answers(best.trained, test.slides.features())))
            lines.append(Judged(kind, best.candidate.words, best.candidate.options, best.said, found, alike))
        trade = [(one.candidate.words, one.candidate.options, one.said, right) for one, right in judged]
        (folder / "README.md").write_text(page(lines, trade, test, len(train), TRAIN_RUNS))
    print(folder / "README.md")
