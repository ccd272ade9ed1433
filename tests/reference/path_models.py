"""Trains and evaluates the models of samples along the path. Needs the packages of requirements-train.txt.

`PATH_SLIDES` names the program that simulates slides: `cargo run -p wstac-train --example path_slides`.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.ensemble import ExtraTreesClassifier
from sklearn.svm import LinearSVC

from candidates import Candidate, answers, boosted
from report import paragraph, table
from scenes import WORKERS, run_wstac

SCALE = 1 / 2048
FRAMES = 70
TRAIN = (24_000, 9_101, 0)
TEST = (4_000, 9_001, 200_000)
"""Slides, seed and first sensor: no sensor is in both."""
SPEEDS = (50, 80, 120, 180, 240, 300)
OFF_AXIS = (0, 15, 30, 45)
LENGTHS = (60, 80, 100, 120)
MOST_BYTES = {"svm": 64_000, "forest": 64_000, "boosted": 100_000}


@dataclass(frozen=True)
class Input:
    """A sample along the path: its array in a data set, tens of numbers that models read, and what it is of."""

    name: str
    frames: int
    words: str
    length: str = ""
    """The path that models read, as their files' names have it, if it is not 28 mm."""

    @property
    def array(self) -> str:
        """The array's name in a data set."""
        return f"X_{self.name}"


INPUTS = (Input("path", 39, "ten sums"), Input("taxel_path", 28, "25 taxels"))
"""Both read the first 28 mm behind the leading edge."""

SHORT = (Input("path", 25, "ten sums", "16mm"), Input("taxel_path", 17, "25 taxels", "16mm"))
"""Both read the first 16 mm."""


@dataclass(frozen=True)
class Slides:
    """Slides of a data set, in the order of the file."""

    path: Path
    arrays: dict[str, np.ndarray]

    def numbers(self, wanted: Input) -> np.ndarray:
        """Natural logarithms of the first frames, feature by feature, as in every data set."""
        numbers = self.arrays[wanted.array][:, :, : wanted.frames]
        return (numbers.reshape(len(numbers), -1) * SCALE).astype(np.float32)

    @property
    def measured(self) -> np.ndarray:
        """Whether a slide has a velocity, and so a path."""
        return ~np.isnan(self.arrays["measured_speed"])


def simulated(folder: Path, name: str, slides: int, seed: int, sensor: int) -> Slides:
    """Simulates slides."""
    path = folder / f"{name}.npz"
    program = os.environ["PATH_SLIDES"]
    subprocess.run([program, str(path), str(slides), str(seed), str(sensor)], check=True)
    with np.load(path) as data:
        return Slides(path, {key: data[key] for key in data.files})


def linear() -> LinearSVC:
    """Returns a linear model of one sum a class."""
    return LinearSVC(C=1, random_state=0, max_iter=3000)


def forest() -> ExtraTreesClassifier:
    """Returns a forest that is below 64 kB with leaves of one class."""
    return ExtraTreesClassifier(50, max_leaf_nodes=200, max_features=60, random_state=0, n_jobs=1)


CANDIDATES = (
    Candidate("svm", "LinearSVC(C=1)", linear),
    Candidate(
        "forest", "ExtraTreesClassifier(50, max_leaf_nodes=200, max_features=60), leaves of one class", forest
    ),
    Candidate("boosted", "XGBClassifier(60, max_depth=3)", lambda: boosted(60, 3)),
)


@dataclass(frozen=True)
class Judged:
    """A model file and its answers for the slides that test. `right` is (n,)."""

    input: Input
    candidate: Candidate
    size: int
    right: np.ndarray
    alike: int


def file_name(wanted: Input, candidate: Candidate) -> str:
    """Returns the name of a model's file, without its ending."""
    parts = [wanted.name.replace("_", "-"), candidate.kind, wanted.length]
    return "-".join(part for part in parts if part)


def judged(wanted: Input, candidate: Candidate, train: Slides, test: Slides, folder: Path) -> Judged:
    """Trains a model, makes a model file of it, and evaluates the file."""
    rows = train.measured
    model = candidate.train(train.numbers(wanted)[rows], train.arrays["y_specimen"][rows])
    path = folder / f"{file_name(wanted, candidate)}.wsm"
    with tempfile.TemporaryDirectory() as work:
        file, options = candidate.save(model, Path(work), 10 * wanted.frames)
        note = f"{candidate.words}, {int(rows.sum())} simulated slides of 1000 sensors"
        options = ["--input", wanted.name.replace("_", "-"), "--note", note, "--force", *options]
        run_wstac(["model", "import", str(file), "-o", str(path), *options])
    found = np.array(json.loads(run_wstac(["model", "eval", str(path), str(test.path), "--json"]))["predictions"])
    right = (found == test.arrays["y_specimen"]) & test.measured
    alike = int(np.sum(found == answers(model, test.numbers(wanted))))
    print(f"{path}: {100 * right.mean():.2f} %", file=sys.stderr, flush=True)
    return Judged(wanted, candidate, path.stat().st_size, right, alike)


def interval(right: np.ndarray) -> str:
    """Returns the percentage of right answers with Wilson's 95 % interval."""
    n, share, z = len(right), float(right.mean()), 1.96
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    return f"{100 * share:.1f} ({100 * (middle - half):.1f} … {100 * (middle + half):.1f})"


def name_of(model: Judged) -> str:
    """Returns the name of a model's file."""
    return f"`{file_name(model.input, model.candidate)}.wsm`"


def by(models: list[Judged], values: np.ndarray, edges: tuple[int, ...], head: str, unit: str) -> str:
    """Returns a table of accuracies by ranges of a quantity."""
    rows: list[list[str]] = []
    for low, high in zip(edges, edges[1:]):
        mask = (values >= low) & ((values < high) | (high == edges[-1]))
        shares = [f"{100 * model.right[mask].mean():.1f} %" for model in models]
        rows.append([f"{low} to {high}{unit}", str(int(mask.sum())), *shares])
    return table([head, "slides", *map(name_of, models)], rows, range(1, 2 + len(models)))


def page(models: list[Judged], train: Slides, test: Slides) -> str:
    """Returns the text about the models."""
    arrays = test.arrays
    early = arrays["speed"] < 200
    rows: list[list[str]] = [
        [
            name_of(model),
            f"`{model.candidate.words}`",
            str(model.size),
            interval(model.right),
            interval(model.right[early]),
            f"{model.alike} of {len(model.right)}",
        ]
        for model in models
    ]
    head = ["file", "model", "bytes", "accuracy, %", "at 50 to 200 mm/s, %", "equal to the trained model"]
    off = np.minimum(arrays["direction"] % 90, 90 - arrays["direction"] % 90)
    intro = paragraph(
        "These models name the ten specimens of the simulated sensor from light along the path of a touch (SPEC §10).",
        "`path` models take ten sums, and `taxel-path` models 25 taxels.",
        "They read the first 28 mm behind the leading edge, or the first 16 mm.",
        "Between two frames light is interpolated, so at 300 mm/s the last number uses light up to 10 mm later.",
    )
    trained = paragraph(
        f"They were trained on {int(train.measured.sum())} simulated slides of 1000 sensors,"
        f" and tested on {len(test.measured)} slides of 1000 other sensors.",
        "Directions are any, speeds 50 to 300 mm/s with an even logarithm, lengths 60 to 120 mm.",
        "Each slide has its own gain of all light, 0.6 to 1.4.",
        "Speed and direction are those that the core measures.",
        "A slide without them counts as wrong.",
        "Intervals are Wilson's, 95 %:",
    )
    return f"""# Texture models of the path

`ci/train path` writes these files and this page.
Do not edit them.

{intro}

{trained}

{table(head, rows, range(2, 6))}

## By speed, direction and length

The direction is its angle to the nearest row or column.

{by(models, arrays["speed"], SPEEDS, "speed", " mm/s")}

{by(models, off, OFF_AXIS, "direction", "°")}

{by(models, arrays["length"], LENGTHS, "length", " mm")}
"""


def write(folder: Path) -> None:
    """Writes all models, and README.md about them."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        train = simulated(Path(work), "train", *TRAIN)
        test = simulated(Path(work), "test", *TEST)
        jobs: list[Any] = [(wanted, candidate) for wanted in INPUTS for candidate in CANDIDATES]
        jobs += [(wanted, CANDIDATES[0]) for wanted in SHORT]
        with ThreadPoolExecutor(WORKERS) as pool:
            models = list(pool.map(lambda job: judged(*job, train, test, folder), jobs))
    for model in models:
        most = MOST_BYTES[model.candidate.kind]
        if model.size > most:
            raise SystemExit(f"{name_of(model)} has {model.size} bytes, expected at most {most}")
    (folder / "README.md").write_text(page(models, train, test))
    print(folder / "README.md")
