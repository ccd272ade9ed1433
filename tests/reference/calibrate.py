#!/usr/bin/env python3
"""Fits the simulator's free numbers to published ones, and prints where to write the results. No source is edited.

    WSTAC=… calibrate.py speed [--repeats N] [--noise N]
    WSTAC=… calibrate.py noise [--splits N] [--data-seeds N] [--length MM] [--afterglow MS]
                                                        # needs requirements-train.txt

`speed` fits the specimens' length and the light's afterglow, so that the mean line of the ten specimens is the paper's
speed law. `noise` fits the scale of all noise, so that a linear support vector machine names as many of the ten
specimens correctly as in the paper's table 2. Nothing else is fitted.

Noise changes the speed law a little, and the length changes the texture answers a little. So run `speed`, write its
numbers into the sources, build, run `noise`, and write its number. Then run `speed` again to check that its numbers
stay.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
from collections.abc import Callable

import numpy as np

import speed_law
from scenes import Changes
from speed_law import FITTING_SEED, PAPER_INTERCEPT, PAPER_SLOPE, Line, Protocol

START = (105.0, 38.0)
"""Length in mm and afterglow in ms that the search starts from."""
STEPS = (5.0, 6.0)
"""How far they are moved to see what it changes, in mm and ms."""
PRECISION = (0.5, 0.5)
"""The fitted numbers are rounded to this, in mm and ms."""

PAPER_SVM_ACCURACY = 0.83
"""Table 2: linear SVM, specimens (*paper*)."""
NOISE_RANGE = (0.4, 2.0)
"""Where the noise is looked for."""
NOISE_PRECISION = 0.04
"""Bisection ends at this share."""

LENGTH_AT = "LENGTH_MM in wstac-scene/src/specimen.rs"
AFTERGLOW_AT = "LightConfig's afterglow_ms in wstac-scene/src/light.rs"
NOISE_AT = "NOISE in wstac-scene/src/script.rs"


def rounded(value: float, step: float) -> float:
    """Returns the nearest multiple of a step."""
    return round(value / step) * step


def speed_at(numbers: np.ndarray, repeats: int, noise: float | None, seed: int = FITTING_SEED) -> list[Protocol]:
    """Returns all protocols at a length in mm and an afterglow in ms. The seeds are always the same."""
    length_mm, afterglow_ms = (float(number) for number in numbers)
    return speed_law.protocols(repeats, seed, Changes(length_mm, afterglow_ms, noise))


def errors_of(line: Line) -> np.ndarray:
    """Returns the differences of slope and intercept from the paper's, in frames."""
    return np.array([line.slope - PAPER_SLOPE, line.intercept - PAPER_INTERCEPT])


def derivatives(at: np.ndarray, error: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Returns the changes of slope and intercept (rows) per mm and per ms (columns), from one step either way."""
    columns = []
    for k, step in enumerate(STEPS):
        move = np.zeros(2)
        move[k] = step
        columns.append((error(at + move) - error(at - move)) / (2 * step))
    return np.array(columns).T


def fit_speed(repeats: int, noise: float | None) -> int:
    """Runs Newton's method on two numbers with the derivatives at the start, then again around the rounded result."""

    def error(at: np.ndarray) -> np.ndarray:
        line = speed_law.mean_line(speed_law.repeat_lines(speed_at(at, repeats, noise)))
        found = errors_of(line)
        print(f"length {at[0]:7.2f} mm, afterglow {at[1]:6.2f} ms: {speed_law.words(line)}", flush=True)
        return found

    at = np.array(START)
    matrix = derivatives(at, error)
    for _ in range(8):
        step = np.linalg.solve(matrix, -error(at))
        at = at + step
        if np.all(np.abs(step) < 0.1 * np.array(PRECISION)):
            break
    else:
        print("the search does not settle", file=sys.stderr)
        return 1
    nearest = np.array([rounded(value, step) for value, step in zip(at, PRECISION, strict=True)])
    report_speed(at, nearest, matrix, repeats, noise)
    return 0


def report_speed(at: np.ndarray, nearest: np.ndarray, matrix: np.ndarray, repeats: int, noise: float | None) -> None:
    """Prints the fitted numbers, their uncertainty, and the results of the rounded numbers with other seeds."""
    lines = speed_law.repeat_lines(speed_at(nearest, repeats, noise))
    spread = np.cov([errors_of(line) for line in lines], rowvar=False) / len(lines)
    inverse = np.linalg.inv(matrix)
    sure = np.sqrt(np.diag(inverse @ spread @ inverse.T))
    others = speed_law.mean_line(speed_law.repeat_lines(speed_at(nearest, repeats, noise, 2 * FITTING_SEED)))
    print(f"""
fitted: length {at[0]:.2f} mm ± {sure[0]:.2f}, afterglow {at[1]:.2f} ms ± {sure[1]:.2f} (standard errors)
a mm more length:     slope {matrix[0, 0]:+.3f}, intercept {matrix[1, 0]:+.3f} frames
a ms more afterglow:  slope {matrix[0, 1]:+.3f}, intercept {matrix[1, 1]:+.3f} frames

write {nearest[0]:g} into {LENGTH_AT}
write {nearest[1]:g} into {AFTERGLOW_AT}

there, with the seeds of the fit: {residual(speed_law.mean_line(lines))}
there, with other seeds:          {residual(others)}""")


def residual(line: Line) -> str:
    """Describes a line, and its distance from the paper's."""
    slope, intercept = errors_of(line)
    return f"{speed_law.words(line)}; off by {slope:+.2f} and {intercept:+.2f} frames"


def fit_noise(splits: int, data_seeds: int, length_mm: float | None, afterglow_ms: float | None) -> int:
    """Finds the noise by bisection of its logarithm. The seeds are always the same."""
    import texture  # Imported here, because `speed` needs no scikit-learn.

    def accuracies(noise: float) -> list[float]:
        changes = Changes(length_mm, afterglow_ms, noise)
        seeds = [FITTING_SEED + n * texture.SEEDS_APART for n in range(data_seeds)]
        data = [texture.dataset(seed, changes) for seed in seeds]
        found = texture.svm_accuracies(data, splits)
        each = ", ".join(f"{100 * accuracy:.1f}" for accuracy in found)
        print(f"noise {noise:6.3f}: {100 * statistics.fmean(found):5.2f} % right ({each})", flush=True)
        return found

    least, most = NOISE_RANGE
    if not statistics.fmean(accuracies(least)) > PAPER_SVM_ACCURACY > statistics.fmean(accuracies(most)):
        print(f"{100 * PAPER_SVM_ACCURACY:g} % is not between these", file=sys.stderr)
        return 1
    while most / least > 1 + NOISE_PRECISION:
        middle = math.sqrt(least * most)
        if statistics.fmean(accuracies(middle)) > PAPER_SVM_ACCURACY:
            least = middle
        else:
            most = middle
    nearest = rounded(math.sqrt(least * most), 0.05)
    there = accuracies(nearest)
    either = [statistics.fmean(accuracies(nearest * factor)) for factor in (0.8, 1.25)]
    steepness = (either[1] - either[0]) / (nearest * 1.25 - nearest * 0.8)
    print(f"""
write {nearest:.2f} into {NOISE_AT}

there: {100 * statistics.fmean(there):.1f} % right, of {100 * PAPER_SVM_ACCURACY:g} % in the paper
0.1 more noise: {10 * steepness:+.1f} % right""")
    if data_seeds > 1:
        sure = statistics.stdev(there) / math.sqrt(data_seeds)
        print(f"standard error from data to data: {100 * sure:.1f} % right, {abs(sure / steepness):.2f} of noise")
    return 0


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description="fit the simulator to published numbers")
    commands = parser.add_subparsers(dest="what", required=True)
    speed = commands.add_parser("speed", help="length and afterglow, to the paper's speed law")
    speed.add_argument("--repeats", type=int, default=20, help="of the protocol over ten specimens, default 20")
    speed.add_argument("--noise", type=float, help="scale of the noise, instead of the simulator's default")
    noise = commands.add_parser("noise", help="scale of the noise, to the paper's linear SVM on specimens")
    noise.add_argument("--splits", type=int, default=20, help="seeds of the 9 : 1 split, default 20")
    noise.add_argument("--data-seeds", type=int, default=3, help="datasets, default 3")
    noise.add_argument("--length", type=float, help="of the specimens in mm, instead of the simulator's default")
    noise.add_argument("--afterglow", type=float, help="in ms, instead of the simulator's default")
    arguments = parser.parse_args()
    if arguments.what == "noise":
        return fit_noise(arguments.splits, arguments.data_seeds, arguments.length, arguments.afterglow)
    return fit_speed(arguments.repeats, arguments.noise)


if __name__ == "__main__":
    sys.exit(main())
