"""Writes the report on texture models: table 2 next to the paper's, and the tests with new speeds, runs and sensors.
Needs no scikit-learn.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from report import fixed, interval_of, interval_words, paragraph, table

HEAD = Path(__file__).with_name("texture_head.txt")
"""The begin of the page, which is written by hand."""

LABELS = ("specimen", "pattern", "depth")
"""The three sets of labels over the same slides."""

PAPER = {
    ("specimen", "Linear-SVM"): 83,
    ("specimen", "random forest"): 94,
    ("specimen", "XGBoost"): 95,
    ("pattern", "Linear-SVM"): 91,
    ("pattern", "random forest"): 98,
    ("pattern", "XGBoost"): 97,
    ("depth", "Linear-SVM"): 92,
    ("depth", "random forest"): 99,
    ("depth", "XGBoost"): 98,
}
"""Table 2 of the paper: test accuracy in percent."""

MODELS = tuple(dict.fromkeys(model for _, model in PAPER))
"""Its models."""

FITTED = ("specimen", "Linear-SVM")
"""The cell that the simulator's noise was fitted to."""

DEPLOYED_TESTS = {
    "seen": "nothing: other slides of the same runs and speeds",
    "speeds": "the speeds",
    "runs": "the runs",
    "both": "the speeds and runs",
    "unit": "the sensor",
}
"""What training never saw of the slides of a test."""


@dataclass(frozen=True)
class Results:
    """The accuracies of every repeat: `paper` by label set and model, `deployed` by kind of test, label set and model."""

    paper: dict[tuple[str, str], list[float]]
    deployed: dict[tuple[str, str, str], list[float]]


def results_of(lines: Sequence[str]) -> Results:
    """Reads the lines of `record`. Raises an error if a repeat of table 2 lacks its tests with new speeds, runs and
    sensors.

    All of those tests may be missing.
    """
    kept: dict[str, dict[int, dict[tuple[str, ...], float]]] = {"paper": {}, "deployed": {}}
    for line in lines:
        one = json.loads(line)
        kept[one["kind"]][one["repeat"]] = {tuple(key): value for *key, value in one["found"]}
    if not kept["paper"] or kept["deployed"] and kept["paper"].keys() != kept["deployed"].keys():
        counts = ", ".join(f"{len(repeats)} of {kind}" for kind, repeats in kept.items())
        raise SystemExit(f"results of {counts}, expected as many of both")
    each = [[repeats[n] for n in sorted(repeats)] for repeats in kept.values()]
    return Results(*({key: [one[key] for one in repeats] for key in repeats[0]} if repeats else {} for repeats in each))


def record(kind: str, repeat: int, found: dict[tuple[str, ...], float]) -> str:
    """Returns a line for a file of results."""
    return json.dumps({"kind": kind, "repeat": repeat, "found": [[*key, value] for key, value in found.items()]})


def cell(values: Sequence[float]) -> str:
    """Returns the mean and 95 % interval in percent."""
    interval = interval_of([100 * value for value in values])
    return f"{fixed(interval.mean, 1)} ({interval_words(interval, 1)})"


def paper_table(found: dict[tuple[str, str], list[float]]) -> str:
    """Returns the nine cells."""
    rows = []
    for key, published in PAPER.items():
        interval = interval_of([100 * value for value in found[key]])
        difference = fixed(interval.mean - published, 1, sign=True)
        what = "fitted" if key == FITTED else "predicted"
        row = [str(published), fixed(interval.mean, 1), interval_words(interval, 1), difference, what]
        rows.append([*key, *row])
    head = ["labels", "model", "paper, %", "simulated, %", "95 % interval", "difference", ""]
    return table(head, rows, range(2, 6))


def sizes(found: dict[tuple[str, str], list[float]]) -> str:
    """Describes the errors of the eight predicted cells."""
    off = [sum(found[key]) / len(found[key]) * 100 - PAPER[key] for key in PAPER if key != FITTED]
    most = max(off, key=abs)
    key = [key for key in PAPER if key != FITTED][off.index(most)]
    mean = sum(abs(value) for value in off) / len(off)
    return paragraph(
        f"The eight predicted cells are off by {fixed(mean, 1)} points on average.",
        f"The largest difference is {fixed(most, 1, sign=True)}: {key[1]}, {key[0]}s.",
    )


def orders(found: dict[tuple[str, str], list[float]]) -> str:
    """Describes whether the models and the label sets have the same order as in the paper's table."""
    mean = {key: sum(found[key]) / len(found[key]) for key in PAPER}
    svm, *trees = MODELS
    better = all(mean[labels, tree] > mean[labels, svm] for labels in LABELS for tree in trees)
    harder = all(mean["specimen", model] < min(mean["pattern", model], mean["depth", model]) for model in MODELS)
    here = {True: "this holds here", False: "**this does not hold here**"}
    return paragraph(
        f"In the paper, trees are better than the linear SVM for all label sets: {here[better]}.",
        f"All models name specimens less accurately than patterns and depths: {here[harder]}.",
    )


def others(found: dict[tuple[str, str], list[float]], models: Sequence[str]) -> str:
    """Describes other readings of the paper's "Linear-SVM"."""
    means = [sum(found[labels, model]) / len(found[labels, model]) for labels in LABELS for model in models]
    return f" name {fixed(100 * min(means), 1)} to {fixed(100 * max(means), 1)} % right" if means else ""


def deployed_table(found: dict[tuple[str, str, str], list[float]]) -> str:
    """Returns a table of specimens with a row for each kind of test, and a column per model."""
    models = list(dict.fromkeys(model for _, _, model in found))
    rows = [
        [words, *(cell(found[kind, "specimen", model]) for model in models)] for kind, words in DEPLOYED_TESTS.items()
    ]
    return table(["new to the model", *models], rows, range(1, len(models) + 1))


def page(results: Results, how: str) -> str:
    """Returns the report's text. `how` has hyperparameters and versions."""
    intro = paragraph(
        "Every slide on this page is simulated, and says nothing about a real sensor.",
    )
    protocol = paragraph(
        "The protocol is the paper's: 100 slides of each specimen, of which 90 % train a model and 10 % test it.",
        f"Here it is repeated {len(next(iter(results.paper.values())))} times with new slides and a new split.",
        "Intervals are Student intervals of the mean over the repeats.",
        "Slides differ only by chance.",
        "All slides are at 150 mm/s in one direction.",
    )
    fitted = paragraph(
        "The scale of the simulator's noise was fitted to one cell, with other slides and splits (`tests/reference/calibrate.py noise`).",
    )
    unscaled = paragraph(
        "The noise was fitted with the linear SVM above.",
        "With the same noise, three other readings of the paper's \"Linear-SVM\" (without the features of frames without light, without a scaler,"
        f" and the one-vs-rest `LinearSVC` without a scaler){others(results.paper, list(dict.fromkeys(name for _, name in results.paper))[3:])}.",
        "The scaler makes the noise of frames without light as large as the signal of other frames: do not scale your own model.",
    )
    return f"""{HEAD.read_text(encoding="utf-8")}{intro}

## Table 2

{protocol}

{fitted}

{paper_table(results.paper)}

{sizes(results.paper)}

{orders(results.paper)}

{how}

### Which linear SVM

{unscaled}
{fair_section(results.deployed) if results.deployed else ""}"""


def fair_section(found: dict[tuple[str, str, str], list[float]]) -> str:
    """Describes the tests with new speeds, runs and sensors."""
    said = paragraph(
        "A sensor in use slides at other speeds, or has another gain after it is mounted again (a *run*).",
        "These tests have eleven speeds, 100 to 200 mm/s, in four directions, and ten runs of one sensor with gains of 1 ± 0.2.",
        "Training leaves out two speeds and two runs, drawn anew in every repeat, and 10 % of the rest.",
        "The last test is a run of another sensor, whose whiskers have other gains.",
        "Specimen accuracy in percent, with 95 % intervals:",
    )
    return f"""
## New speeds, runs and sensors

{said}

{deployed_table(found)}
"""
