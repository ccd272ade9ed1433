"""Trains and evaluates the models of samples along the path. Needs the packages of requirements-train.txt.

`PATH_SLIDES` names the program that simulates slides: `cargo run -p wstac-tests --example path_slides`.
"""

from __future__ import annotations

import json
import os
import re
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
HELD = (4_000, 9_201, 100_000)
UNKNOWN = (4_000, 9_301, 300_000)
RANDOM = (20_000, 9_401, 500_000)
NEW = (12_000, 9_501, 600_000)
"""Slides, seed and first sensor: no sensor is in two of them."""
NEW_SENSORS = 40
TENS = 10
"""Sensors of new textures, and sensors that each have ten random textures of their own."""
SHOTS = 5
DIMENSIONS = 8
"""Slides of each new texture that are learned, and dimensions of an embedding."""
REJECTED = 0.01
"""Part of the slides held out and named right that may be taken for unknown."""
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

    def some(self, path: Path, rows: np.ndarray) -> Slides:
        """Writes some of the slides to a data set of their own."""
        kept = {key: value[rows] for key, value in self.arrays.items() if value.ndim > 0}
        np.savez(path, **kept)
        return Slides(path, kept)

    @property
    def measured(self) -> np.ndarray:
        """Whether a slide has a velocity, and so a path."""
        return ~np.isnan(self.arrays["measured_speed"])


def simulated(
    folder: Path, name: str, slides: int, seed: int, sensor: int, textures: str = "paper", sensors: int = 1000
) -> Slides:
    """Simulates slides of so many sensors."""
    path = folder / f"{name}.npz"
    program = os.environ["PATH_SLIDES"]
    numbers = [str(slides), str(seed), str(sensor), textures, str(sensors)]
    subprocess.run([program, str(path), *numbers], check=True)
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
    """A model file and whether each slide that tests is named right; one that is said to be unknown is not.

    `known`, `named` and `confidence` are (n,), too; `named` is whether the class of an unknown slide is right all the
    same. `rejected` is whether each slide of an unknown texture is said to be unknown.
    """

    input: Input
    candidate: Candidate
    size: int
    right: np.ndarray
    known: np.ndarray
    named: np.ndarray
    confidence: np.ndarray
    rejected: np.ndarray
    alike: int

    @property
    def calibration_error(self) -> float:
        """The expected calibration error of the answers that are given, over 15 ranges of confidence."""
        confidence, named = self.confidence[self.known], self.named[self.known]
        places = np.minimum((confidence * 15).astype(int), 14)
        sums = [abs((confidence - named)[places == place].sum()) for place in range(15)]
        return float(sum(sums) / len(confidence))


@dataclass(frozen=True)
class Sets:
    """All simulated slides of the ten textures, and those of unknown ones."""

    train: Slides
    held: Slides
    test: Slides
    unknown: Slides


def evaluated(path: Path, slides: Slides) -> dict[str, Any]:
    """Returns the answers of a model file for a data set."""
    found: dict[str, Any] = json.loads(run_wstac(["model", "eval", str(path), str(slides.path), "--json"]))
    return found


def file_name(wanted: Input, candidate: Candidate) -> str:
    """Returns the name of a model's file, without its ending."""
    parts = [wanted.name.replace("_", "-"), candidate.kind, wanted.length]
    return "-".join(part for part in parts if part)


def kept_alike(folder: Path, name: str) -> int | None:
    """Returns how many answers of a kept model are those of the trained model, by the page that was written with it."""
    page = folder / "README.md"
    if not page.exists() or not (folder / name).exists():
        return None
    line = re.search(rf"^\| `{re.escape(name)}` .* (\d+) of \d+ \|$", page.read_text(), re.MULTILINE)
    return int(line[1]) if line else None


def judged(wanted: Input, candidate: Candidate, sets: Sets, folder: Path, keep: bool) -> Judged:
    """Trains and calibrates a model, makes a model file of it, and evaluates the file."""
    path = folder / f"{file_name(wanted, candidate)}.wsm"
    alike = kept_alike(folder, path.name) if keep else None
    if alike is None:
        alike = trained(wanted, candidate, sets, path)
    calibrated = path.with_suffix(".calibrated.wsm")
    calibrate = ["model", "calibrate", str(path), str(sets.train.path), str(sets.held.path), "-o", str(calibrated)]
    run_wstac([*calibrate, "--force", "--rejected", str(REJECTED)])
    calibrated.replace(path)
    found = evaluated(path, sets.test)
    named = (np.array(found["predictions"]) == sets.test.arrays["y_specimen"]) & sets.test.measured
    known = np.array(found["known"]) & sets.test.measured
    unknown = ~np.array(evaluated(path, sets.unknown)["known"])[sets.unknown.measured]
    print(f"{path}: {100 * (named & known).mean():.2f} %, unknown {100 * unknown.mean():.1f} %", file=sys.stderr, flush=True)
    confidence = np.array(found["confidence"])
    return Judged(wanted, candidate, path.stat().st_size, named & known, known, named, confidence, unknown, alike)


def trained(wanted: Input, candidate: Candidate, sets: Sets, path: Path) -> int:
    """Trains a model and imports it. Returns how many of its answers are the trained model's."""
    train, test = sets.train, sets.test
    rows = train.measured
    model = candidate.train(train.numbers(wanted)[rows], train.arrays["y_specimen"][rows])
    with tempfile.TemporaryDirectory() as work:
        file, options = candidate.save(model, Path(work), 10 * wanted.frames)
        note = f"{candidate.words}, {int(rows.sum())} simulated slides of 1000 sensors"
        options = ["--input", wanted.name.replace("_", "-"), "--speeds", "50,300", "--note", note, "--force", *options]
        run_wstac(["model", "import", str(file), "-o", str(path), *options])
    found = np.array(evaluated(path, test)["predictions"])
    return int(np.sum(found == answers(model, test.numbers(wanted))))


def embedding(wanted: Input, random: Slides, sets: Sets, folder: Path) -> Path:
    """Makes the file from which models of new textures are learned."""
    prefix = wanted.name.replace("_", "-")
    path = folder / f"{prefix.replace('path', 'embedding')}.wsm"
    calibrate = ["model", "calibrate", str(folder / f"{prefix}-svm.wsm"), str(sets.train.path), str(sets.held.path)]
    projection = ["--projection", str(random.path), "--dimensions", str(DIMENSIONS)]
    run_wstac([*calibrate, "-o", str(path), "--force", *projection])
    return path


@dataclass(frozen=True)
class Learned:
    """What models of a few slides say about all other slides of their sensor: one number for each sensor."""

    right: np.ndarray
    known: np.ndarray
    others: np.ndarray
    """Of slides of the ten specimens, which are not learned, the part that is said to be unknown."""


def learned(base: Path, sensors: list[Slides], others: Slides, work: Path) -> Learned:
    """Learns the textures of each sensor from the first slides of each, and evaluates the model on the others."""
    shares: list[tuple[float, float, float]] = []
    for slides in sensors:
        few = np.zeros(len(slides.measured), dtype=bool)
        for name in np.unique(slides.arrays["y_specimen"]):
            few[np.flatnonzero((slides.arrays["y_specimen"] == name) & slides.measured)[:SHOTS]] = True
        shots, rest = slides.some(work / f"{base.stem}-few.npz", few), slides.some(work / f"{base.stem}-rest.npz", ~few)
        model = work / f"{base.stem}-new.wsm"
        run_wstac(["model", "learn", str(base), str(shots.path), "-o", str(model), "--force"])
        found = evaluated(model, rest)
        named = (np.array(found["predictions"]) == rest.arrays["y_specimen"]) & rest.measured
        known = np.array(found["known"]) & rest.measured
        unknown = ~np.array(evaluated(model, others)["known"])[others.measured]
        # A slide that is said to be unknown is not right.
        shares.append((float((named & known).mean()), float(known.mean()), float(unknown.mean())))
    return Learned(*np.array(shares).T)


def interval(right: np.ndarray) -> str:
    """Returns the percentage of right answers with Wilson's 95 % interval."""
    n, share, z = len(right), float(right.mean()), 1.96
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    return f"{100 * share:.1f} ({100 * (middle - half):.1f}…{100 * (middle + half):.1f})"


def name_of(model: Judged) -> str:
    """Returns the name of a model's file."""
    return f"`{file_name(model.input, model.candidate)}.wsm`"


def learned_table(found: dict[tuple[str, str], Learned]) -> str:
    """Returns the table of new textures."""
    rows: list[list[str]] = []
    for (base, textures), result in found.items():
        half = 1.96 * result.right.std(ddof=1) / np.sqrt(len(result.right))
        mean = result.right.mean()
        rows.append([
            f"`{base}`",
            textures,
            str(len(result.right)),
            f"{100 * mean:.1f} ({100 * (mean - half):.1f}…{min(100.0, 100 * (mean + half)):.1f})",
            f"{100 * result.right.min():.1f}",
            f"{100 * result.known.mean():.1f}",
            f"{100 * result.others.mean():.1f}",
        ])
    head = ["base", "textures", "sensors", "accuracy, %", "worst sensor, %", "known, %", "the ten specimens unknown, %"]
    return table(head, rows, range(2, 7))


def page(models: list[Judged], sets: Sets, new: dict[tuple[str, str], Learned]) -> str:
    """Returns the text about the models."""
    train, test = sets.train, sets.test
    arrays = test.arrays
    early = arrays["speed"] < 200
    rows: list[list[str]] = [
        [
            name_of(model),
            str(model.size),
            interval(model.right),
            interval(model.right[early]),
            f"{model.alike} of {len(model.right)}",
        ]
        for model in models
    ]
    head = [
        "file", "bytes", "accuracy, %", "at 50 to 200 mm/s, %", "equal to the trained model"
    ]
    # docs/ANSWERS.md has those of the others.
    short = "; ".join(
        f"{name_of(model)} {model.calibration_error:.4f}, {100 * model.rejected.mean():.1f},"
        f" {100 * (1 - model.known.mean()):.1f}"
        for model in models if "16mm" in name_of(model)
    )
    intro = paragraph(
        "These models name the ten specimens of the simulated sensor from light along the path of a touch (SPEC §10).",
        "`path` models take ten sums, and `taxel-path` models 25 taxels.",
        "They read the first 28 mm behind the leading edge, or the first 16 mm.",
    )
    training = paragraph(
        f"They were trained on {int(train.measured.sum())} simulated slides of 1000 sensors,"
        f" calibrated with {int(sets.held.measured.sum())} slides of 1000 other sensors,"
        f" and tested on {len(test.measured)} slides of 1000 others.",
        "Directions are any, speeds 50 to 300 mm/s with an even logarithm, lengths 60 to 120 mm,"
        " and each slide has its own gain of all light, 0.6 to 1.4.",
        "[docs/ANSWERS.md](../../../docs/ANSWERS.md#textures) has unknown textures, confidence, and other conditions.",
        "Intervals are Wilson's, 95 %; `wstac model inspect FILE` says how each was trained:",
    )
    learning = paragraph(
        f"`wstac model learn` makes a model from {SHOTS} slides of each texture.",
        f"Its projection has {DIMENSIONS} dimensions,"
        " and was trained on 20000 slides of 1000 random textures and 1000 sensors:"
        " three patterns, depths of 1 to 6 mm, periods of 2 to 16 mm.",
        "The ten new textures are those of docs/ANSWERS.md; all slides of a model have one unseen sensor.",
        "Ten random textures are other ones for every sensor, and may be nearly alike.",
        "The paper's ten specimens are not learned, but may be near those that are:",
    )
    return f"""# Texture models of the path

`ci/train path` writes these files and this page.
Do not edit them.

{intro}

{training}

{table(head, rows, range(1, 5))}

Calibration error, unknown textures found and trained ones refused in %:
{short}.

## New textures from five slides each

{learning}

{learned_table(new)}
"""


def new_textures(bases: list[Path], others: Slides, work: Path) -> dict[tuple[str, str], Learned]:
    """Evaluates learning: of the ten new textures, and of ten random textures for each sensor."""
    slides = simulated(work, "new", *NEW, "new", NEW_SENSORS)
    numbers = [np.flatnonzero(slides.arrays["sensor"] == sensor) for sensor in np.unique(slides.arrays["sensor"])]
    sensors = [slides.some(work / f"new-{place}.npz", rows) for place, rows in enumerate(numbers)]
    tens = [simulated(work, f"ten-{k}", 200, 9_600 + k, 700_000 + k, "ten", 1) for k in range(TENS)]
    found: dict[tuple[str, str], Learned] = {}
    for base in bases:
        for textures, of in (("ten new", sensors), ("ten random", tens)):
            found[base.name, textures] = learned(base, of, others, work)
            print(f"{base.name}: {textures}: {100 * found[base.name, textures].right.mean():.1f} %", file=sys.stderr)
    return found


def write(folder: Path, keep: bool) -> None:
    """Writes all models, and README.md about them. With `keep`, models that are there are only calibrated anew."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary)
        train, held, test = (simulated(work, *named) for named in (("train", *TRAIN), ("held", *HELD), ("test", *TEST)))
        sets = Sets(train, held, test, simulated(work, "unknown", *UNKNOWN, "unknown"))
        random = simulated(work, "random", *RANDOM, "random")
        jobs: list[Any] = [(wanted, candidate) for wanted in INPUTS for candidate in CANDIDATES]
        jobs += [(wanted, CANDIDATES[0]) for wanted in SHORT]
        with ThreadPoolExecutor(WORKERS) as pool:
            models = list(pool.map(lambda job: judged(*job, sets, folder, keep), jobs))
            bases = list(pool.map(lambda wanted: embedding(wanted, random, sets, folder), INPUTS))
        new = new_textures(bases, sets.test.some(work / "few.npz", np.arange(1000)), work)
    for model in models:
        most = MOST_BYTES[model.candidate.kind]
        if model.size > most:
            raise SystemExit(f"{name_of(model)} has {model.size} bytes, expected at most {most}")
    (folder / "README.md").write_text(page(models, sets, new))
    print(folder / "README.md")
