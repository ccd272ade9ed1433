"""Trains the models that `wstac trade` compares beside the shipped ones: smaller ones, narrower ones, earlier ones."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sklearn.ensemble import ExtraTreesClassifier
from sklearn.svm import SVC, LinearSVC

from candidates import Candidate, boosted
from runs import run_all
from scenes import WORKERS, run_wstac
from shipped_slides import TRAIN_RUNS, training_sweeps
from slides import Slides

FRAMES = 70
"""Of a whole sample."""
EARLY = (20, 30, 40, 50, 60)
"""Frames that early models wait for."""


@dataclass(frozen=True)
class Choice:
    """A model of the trade: what it is called, how it is trained, and the first frames of a sample that it sees."""

    name: str
    candidate: Candidate
    frames: int = FRAMES


def forest(trees: int, leaves: int | None = 320, depth: int | None = None) -> Candidate:
    """A forest as the shipped one, of another size."""
    words = f"ExtraTreesClassifier({trees}, max_leaf_nodes={leaves}, max_depth={depth}, max_features=60), leaves of one class"

    def make() -> ExtraTreesClassifier:
        return ExtraTreesClassifier(trees, max_leaf_nodes=leaves, max_depth=depth, max_features=60, random_state=0, n_jobs=1)

    return Candidate("forest", words, make)


def rounds_of(rounds: int) -> Candidate:
    """Boosted trees as the shipped ones, of fewer rounds."""
    return Candidate("boosted", f"XGBClassifier({rounds}, max_depth=3)", lambda: boosted(rounds, 3))


def choices() -> Iterator[Choice]:
    """All of them."""
    svm = Candidate("svm", "SVC(kernel=\"linear\", C=1)", lambda: SVC(kernel="linear", C=1))
    narrow = Candidate("svm", svm.words, svm.make, ("--weights", "int8"))
    ovr = Candidate("svm", "LinearSVC(C=1)", lambda: LinearSVC(C=1, random_state=0))
    narrow_ovr = Candidate("svm", ovr.words, ovr.make, ("--weights", "int8"))
    yield Choice("svm-int8", narrow)
    yield Choice("ovr", ovr)
    yield Choice("ovr-int8", narrow_ovr)
    yield Choice("forest-10", forest(10))
    yield Choice("forest-25", forest(25))
    yield Choice("forest-depth6", forest(50, None, 6))
    yield Choice("forest-depth10", forest(50, None, 10))
    for rounds in (10, 30):
        yield Choice(f"boosted-{rounds}", rounds_of(rounds))
    for frames in EARLY:
        yield Choice(f"svm-{frames}f", svm, frames)
        yield Choice(f"ovr-{frames}f", ovr, frames)
        yield Choice(f"forest-25-{frames}f", forest(25), frames)
        yield Choice(f"boosted-30-{frames}f", rounds_of(30), frames)


def first(slides: Slides, frames: int) -> np.ndarray:
    """The first frames of samples: natural logarithms, ten times as many as frames."""
    return slides.features().reshape(len(slides), -1, FRAMES)[:, :, :frames].reshape(len(slides), -1)


def write(folder: Path) -> None:
    """Writes NAME.wsm of every choice that is not there yet."""
    folder.mkdir(parents=True, exist_ok=True)
    train = run_all(training_sweeps()).slides

    def one(wanted: Choice) -> str:
        path = folder / f"{wanted.name}.wsm"
        if path.exists():
            return f"{path} is there"
        model = wanted.candidate.train(first(train, wanted.frames), train.specimen)
        with tempfile.TemporaryDirectory() as work:
            file, options = wanted.candidate.save(model, Path(work), 10 * wanted.frames)
            note = f"{wanted.candidate.words}, {len(train)} simulated slides in {TRAIN_RUNS} runs, first {wanted.frames} frames"
            run_wstac(["model", "import", str(file), "-o", str(path), "--note", note, *options])
        said = json.loads(run_wstac(["model", "inspect", str(path), "--json"]))
        return f"{path}: {said['bytes']} bytes"

    with ThreadPoolExecutor(WORKERS) as pool:
        for line in pool.map(one, choices()):
            print(line, file=sys.stderr, flush=True)
