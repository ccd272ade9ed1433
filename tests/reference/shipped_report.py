"""Writes README.md about the models that are shipped. Needs no scikit-learn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from report import fixed, interval_of, interval_words, paragraph, table
from runs import Runs
from texture_report import LABELS


@dataclass(frozen=True)
class Judged:
    """A shipped model: its description, and its answers for the slides that evaluate.

    `inspected` is what `wstac model inspect --json` prints. `specimens` is (n,), its answers. `alike` is how many of
    them equal the trained model's own.
    """

    kind: str
    words: str
    options: Sequence[str]
    inspected: dict[str, Any]
    specimens: np.ndarray
    alike: int


def derived(specimens: np.ndarray, labels: str) -> np.ndarray:
    """Returns specimens, or their patterns or depths: `Saw3` is a saw of 3 mm."""
    if labels == "specimen":
        return specimens
    if labels == "pattern":
        return np.array([name[:3] for name in specimens])
    return np.array([int(name[3:]) for name in specimens])


def by_run(right: np.ndarray, run: np.ndarray) -> str:
    """Returns the mean over runs and its 95 % interval, in percent."""
    interval = interval_of([100 * float(np.mean(right[run == number])) for number in np.unique(run)])
    return f"{fixed(interval.mean, 1)} ({interval_words(interval, 1)})"


def models_table(models: Sequence[Judged], test: Runs) -> str:
    """Returns a table of the models: description, size and accuracy."""
    rows = []
    for model in models:
        right = [derived(model.specimens, labels) == getattr(test.slides, labels) for labels in LABELS]
        row = [f"`{model.kind}.wsm`", options_words(model.words, model.options), str(model.inspected["bytes"])]
        rows.append([*row, *(by_run(one, test.run) for one in right), f"{model.alike} of {len(test.run)}"])
    head = ["file", "model", "bytes", *(f"{labels} accuracy, %" for labels in LABELS), "equal to the trained model"]
    return table(head, rows, range(2, 7))


def options_words(words: str, options: Sequence[str]) -> str:
    """Returns a model and the options of its import."""
    return f"`{words}`" + (f", `{' '.join(options)}`" if options else "")


def page(
    models: Sequence[Judged],
    test: Runs,
    slides: int,
    runs: int,
) -> str:
    """Returns the page's text. `slides` and `runs`, each of another sensor, are those that trained."""
    speeds = np.unique(test.slides.speed)
    intro = paragraph(
        "These models name the ten specimens of the simulated sensor, from light over time; they know nothing of a real one.",
        "`tests/reference/candidates.py` has all of their hyperparameters.",
    )
    trained = paragraph(
        f"They were trained on {slides} simulated slides of {runs} sensors,"
        " each with its own gains of whiskers and its own gain of all light, 0.5 to 1.5.",
        f"Speeds are {speeds[0]:g} to {speeds[-1]:g} mm/s, and there are four directions.",
        "Of each kind, the most accurate model within a size was chosen on other sensors: 64 kB for linear models, 100 kB for trees.",
        f"They were evaluated on {len(test.run)} slides of {len(np.unique(test.run))} further sensors.",
        "Numbers are percentages with the 95 % Student interval of the mean over sensors:",
    )
    return f"""# Texture models

`ci/train models` writes these files and this page.
Do not edit them.

{intro}

{trained}

{models_table(models, test)}
"""
