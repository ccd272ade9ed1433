"""Trains, chooses and evaluates the models that are shipped. Needs the packages of requirements-train.txt."""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from candidates import CANDIDATES, Candidate, answers
from runs import run_all
from scenes import WORKERS, run_wstac
from shipped_report import Judged, page
from shipped_slides import TRAIN_RUNS, check_sweeps, test_sweeps, training_sweeps
from slides import Slides

MOST_BYTES = {"svm": 64_000, "forest": 100_000, "boosted": 100_000}
"""Largest model of each kind."""


@dataclass(frozen=True)
class Imported:
    """A model file that was made of a trained model, and the messages of import."""

    candidate: Candidate
    path: Path
    trained: object
    said: dict[str, object]


def imported(candidate: Candidate, model: object, slides: int, folder: Path) -> Imported:
    """Makes a model file of a candidate that is trained with this many slides."""
    file, options = candidate.save(model, folder)
    path = folder / f"{candidate.kind}.wsm"
    note = f"{candidate.words}, {slides} simulated slides in {TRAIN_RUNS} runs"
    run_wstac(["model", "import", str(file), "-o", str(path), "--speeds", "100,200", "--note", note, *options])
    return Imported(candidate, path, model, json.loads(run_wstac(["model", "inspect", str(path), "--json"])))


def named(model: Path, slides: Slides) -> np.ndarray:
    """Returns the answers of a model file for slides."""
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder, "data.npz")
        np.savez(data, X=slides.x)
        found = json.loads(run_wstac(["model", "eval", str(model), str(data), "--json"]))
    return np.array(found["predictions"])


def write(folder: Path) -> None:
    """Writes svm.wsm, forest.wsm, boosted.wsm, and README.md about them."""
    train = run_all(training_sweeps()).slides
    check = run_all(check_sweeps()).slides
    test = run_all(test_sweeps())
    judged: list[tuple[Imported, float]] = []
    # Some candidates differ only in their import.
    different = {candidate.words: candidate for candidate in CANDIDATES}
    with ThreadPoolExecutor(WORKERS) as pool:
        models = pool.map(lambda one: one.train(train.features(), train.specimen), different.values())
        trained = dict(zip(different, models, strict=True))
    with tempfile.TemporaryDirectory() as work:
        for number, candidate in enumerate(CANDIDATES):
            place = Path(work, str(number))
            place.mkdir()
            one = imported(candidate, trained[candidate.words], len(train), place)
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
        (folder / "README.md").write_text(page(lines, test, len(train), TRAIN_RUNS))
    print(folder / "README.md")
