"""Trains the models that `wstac trade` compares with the shipped ones: smaller models, models with 8-bit
weights, models of fewer frames, and a network.
"""

from __future__ import annotations

import hashlib
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sklearn.ensemble import ExtraTreesClassifier
from sklearn.neural_network import MLPClassifier
from sklearn.svm import SVC, LinearSVC

import trade_models_report
from candidates import Candidate, boosted
from runs import run_all
from scenes import SOURCES, SPECIMENS, WORKERS, run_wstac
from shipped_slides import TRAIN_RUNS, training_sweeps
from slides import SCALE, Slides

FRAMES = 70
"""Of a whole sample."""
EARLY = (20, 30, 40, 50, 60)
"""Frames that early models wait for."""


@dataclass(frozen=True)
class Choice:
    """A model of the study: its name, its training, and the first frames of a sample that it sees."""

    name: str
    candidate: Candidate
    frames: int = FRAMES


def forest(trees: int, leaves: int | None = 320, depth: int | None = None) -> Candidate:
    """Returns a forest like the shipped one, of another size."""
    words = f"ExtraTreesClassifier({trees}, max_leaf_nodes={leaves}, max_depth={depth}, max_features=60), leaves of one class"

    def make() -> ExtraTreesClassifier:
        return ExtraTreesClassifier(trees, max_leaf_nodes=leaves, max_depth=depth, max_features=60, random_state=0, n_jobs=1)

    return Candidate("forest", words, make)


def rounds_of(rounds: int) -> Candidate:
    """Returns boosted trees like the shipped ones, of fewer rounds."""
    return Candidate("boosted", f"XGBClassifier({rounds}, max_depth=3)", lambda: boosted(rounds, 3))


def choices() -> Iterator[Choice]:
    """Returns all models."""
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
    network = Candidate("network", "MLPClassifier((16,))", lambda: MLPClassifier((16,), random_state=0))
    yield Choice(f"network-16-{EARLY[0]}f", network, EARLY[0])
    for frames in EARLY:
        yield Choice(f"svm-{frames}f", svm, frames)
        yield Choice(f"ovr-{frames}f", ovr, frames)
        yield Choice(f"forest-25-{frames}f", forest(25), frames)
        yield Choice(f"boosted-30-{frames}f", rounds_of(30), frames)


def first(slides: Slides, frames: int) -> np.ndarray:
    """Returns the first frames of samples: natural logarithms, ten times as many as frames."""
    return slides.features().reshape(len(slides), -1, FRAMES)[:, :, :frames].reshape(len(slides), -1)


def sources() -> str:
    """Returns a checksum of everything that the models depend on: the simulator, and the scripts that train."""
    scripts = ("trade_models", "candidates", "runs", "scenes", "shipped_slides", "slides")
    files = [Path(__file__).with_name(f"{name}.py") for name in scripts]
    digest = hashlib.sha256()
    for file in [*files, *sorted(SOURCES.rglob("*.rs"))]:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def train_one(wanted: Choice, train: Slides, path: Path) -> None:
    """Writes the model file of a choice."""
    model = wanted.candidate.train(first(train, wanted.frames), train.specimen)
    with tempfile.TemporaryDirectory() as work:
        file, options = wanted.candidate.save(model, Path(work), 10 * wanted.frames)
        if wanted.candidate.kind == "network":
            # Its values have the range of the samples.
            samples = train.x.reshape(len(train), -1, FRAMES)
            np.savez(Path(work, "set.npz"), X=samples, scale=SCALE, y_specimen=train.specimen)
            options += ["--check", str(Path(work, "set.npz"))]
        note = f"{wanted.candidate.words}, {len(train)} simulated slides in {TRAIN_RUNS} runs, first {wanted.frames} frames"
        run_wstac(["model", "import", str(file), "-o", str(path), "--speeds", "100,200", "--note", note, *options])
    print(f"{path}: {path.stat().st_size} bytes", file=sys.stderr, flush=True)


def write(folder: Path, keep: bool) -> None:
    """Writes NAME.wsm of every choice, and README.md about them. Models of the same sources are kept; `keep` keeps any.

    Kept models stay marked as made by the sources that the page names, or by the present sources if there is no page.
    """
    folder.mkdir(parents=True, exist_ok=True)
    readme, made = folder / "README.md", sources()
    before = trade_models_report.made_by(readme)
    if keep:
        made = before or made
    elif before != made:
        for stale in folder.glob("*.wsm"):
            stale.unlink()
    sweeps = training_sweeps()
    slides = f"{len(SPECIMENS) * sum(sweep.slides for sweep in sweeps)} simulated slides in {TRAIN_RUNS} runs"
    # This comes first, so that a stopped run can continue.
    readme.write_text(trade_models_report.page(slides, made))
    missing = {folder / f"{one.name}.wsm": one for one in choices() if not (folder / f"{one.name}.wsm").exists()}
    if missing:
        train = run_all(sweeps).slides
        with ThreadPoolExecutor(WORKERS) as pool:
            list(pool.map(lambda path: train_one(missing[path], train, path), missing))
    print(readme)
