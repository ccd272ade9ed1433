"""Repeats the paper's table 2 on simulated slides, and evaluates the same models in tests that represent their use.

Needs scikit-learn (requirements-train.txt).
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np

import texture
from runs import run_all, sweeps
from scenes import WORKERS
from slides import Slides, made
from speed_law import SPEEDS_MM_S
from splits import deployed, tenth
from texture_report import DEPLOYED_TESTS, LABELS, record
from trainers import OTHER_SVMS, TABLE, fit, new_model

Job = tuple[str, int]
"""A kind of results and a repeat, from 0."""
PAPER_SEED = 10_000_000
DEPLOYED_SEED = 20_000_000
"""Data sets of the paper's protocol have this seed and every 100 000th after it; those of the other tests likewise.

calibrate.py's start at 1 000 000.
"""
RUNS = 10
"""Of a repeat of the tests that are fair to use."""
SLIDES = 22
"""Of every specimen in a run: each of eleven speeds in two of the four directions."""
OUT = 2
"""Speeds and runs that are kept from training."""


def paper_repeat(repeat: int) -> dict[tuple[str, str], float]:
    """Returns accuracies by label set and model, on slides and a split of this repeat's own."""
    data = made(texture.sweep(PAPER_SEED + repeat * texture.SEEDS_APART))
    test = tenth(data.specimen, repeat)
    x, found = data.features(), {}
    for labels in LABELS:
        truth = getattr(data, labels)
        for name in TABLE + OTHER_SVMS:
            model = new_model(name, repeat)
            classes = fit(model, x[~test], truth[~test])
            found[labels, name] = float(np.mean(classes[model.predict(x[test])] == truth[test]))
    return found


def deployed_repeat(repeat: int) -> dict[tuple[str, str, str], float]:
    """Returns accuracies by kind of test, label set and model. The models name specimens, and their answers give
    pattern and depth.
    """
    seed = DEPLOYED_SEED + repeat * texture.SEEDS_APART * 10
    *wanted, other = sweeps(seed, [SPEEDS_MM_S] * (RUNS + 1), SLIDES, [0] * RUNS + [repeat + 1])
    runs, unit = run_all(wanted), made(other)
    masks = deployed(runs.slides.speed, runs.run, runs.slides.specimen, OUT, repeat)
    train = runs.slides.of(masks.train)
    tests = {name: runs.slides.of(getattr(masks, name)) for name in DEPLOYED_TESTS if hasattr(masks, name)}
    tests["unit"] = unit
    found = {}
    for name in TABLE + OTHER_SVMS[-1:]:
        model = new_model(name, repeat)
        classes = fit(model, train.features(), train.specimen)
        for kind, slides in tests.items():
            for labels, share in accuracies(slides, classes[model.predict(slides.features())]).items():
                found[kind, labels, name] = share
    return found


def accuracies(slides: Slides, specimens: np.ndarray) -> dict[str, float]:
    """Returns the accuracy of specimens, patterns and depths."""
    pattern = np.array([name[:3] for name in specimens])
    depth = np.array([int(name[3:]) for name in specimens])
    answers = {"specimen": specimens, "pattern": pattern, "depth": depth}
    return {labels: float(np.mean(answers[labels] == getattr(slides, labels))) for labels in LABELS}


def measure(file: Path, repeats: int, only: str | None = None) -> None:
    """Runs all jobs, or one of JOBS, this many times. Adds a line to the file for each that is missing there."""
    jobs = [(kind, n) for kind in JOBS if only in (None, kind) for n in range(repeats)]
    run(jobs, file, lambda job: record(*job, JOBS[job[0]](job[1])), WORKERS)


def run(jobs: Sequence[Job], file: Path, do: Callable[[Job], str], workers: int) -> None:
    """Does the jobs, and adds a line for each that is missing in the file, in their order.

    A last line that a killed process left without an end is dropped.
    """
    text = file.read_text() if file.exists() else ""
    there = text[:text.rfind("\n") + 1]
    if there != text:
        file.write_text(there)
    lines = [json.loads(line) for line in there.splitlines()]
    done = {(line["kind"], line["repeat"]) for line in lines}
    with ThreadPoolExecutor(workers) as pool, file.open("a") as out:
        running: list[tuple[Job, Future[str]]] = [(job, pool.submit(do, job)) for job in jobs if job not in done]
        for (kind, repeat), result in running:
            print(result.result(), file=out, flush=True)
            print(f"{kind}: repeat {repeat + 1}", file=sys.stderr, flush=True)


JOBS = {"paper": paper_repeat, "deployed": deployed_repeat}
"""What a kind of results is made by."""
