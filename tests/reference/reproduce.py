#!/usr/bin/env python3
"""Writes docs/REPRODUCE.md and docs/plots, which compare the simulated sensor with the paper's numbers.

    WSTAC=… reproduce.py FOLDER

FOLDER gets REPRODUCE.md and plots/. Every number of the report is computed here; the same program gives the same bytes.
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import plots
import scenes
import speed_law
from report import (
    all_of,
    at_least,
    fixed,
    interval_of,
    interval_words,
    paragraph,
    percent,
    relative_error,
    summary,
    table,
    within,
)
from scenes import DIRECTIONS, SPECIMENS, Event, Slide, constant
from speed_law import PAPER_INTERCEPT, PAPER_R2, PAPER_SLOPE, SPEEDS_MM_S, Protocol, durations_of, fit_line

REPEATS = 20
SPEED_SEED = 0
DIRECTION_SEED = 500_000
"""Streams of the speed law have the seeds 0, 1 …; those of the directions start here; calibrate.py's at 1 000 000."""

GOAL_ERROR = 0.03
GOAL_R2 = 0.975
PICTURE = Slide("Saw3", 100, 0)
"""What the plot of directions shows, in all four."""


@dataclass(frozen=True)
class Section:
    """A part of the page in Markdown, and its goals: pairs of a name and its verdict."""

    text: str
    goals: list[tuple[str, str]]


def speed_answers(done: Sequence[Protocol]) -> list[tuple[Slide, Event]]:
    """Returns every slide of all protocols with its event."""
    return [pair for protocol in done for pair in zip(protocol.slides, protocol.events, strict=True)]


def fitted_section(done: Sequence[Protocol]) -> Section:
    """Writes which published numbers were fitted, and the results on seeds that were not used to fit."""
    lines = speed_law.repeat_lines(done)
    length = constant("specimen.rs", r"LENGTH_MM: f64 = ")
    afterglow = constant("light.rs", r"afterglow_ms: ")
    noise = constant("script.rs", r"NOISE: f64 = ")
    rows, goals = [], []
    for name, what, found, wanted in (
        ("slope, frames per decade", "slope", interval_of([line.slope for line in lines]), PAPER_SLOPE),
        ("intercept, frames", "intercept", interval_of([line.intercept for line in lines]), PAPER_INTERCEPT),
    ):
        verdict = within(found.mean, wanted, GOAL_ERROR)
        goals.append((what, verdict))
        error = percent(relative_error(found.mean, wanted), 2, sign=True)
        rows.append([name, fixed(wanted, 2), fixed(found.mean, 2), interval_words(found, 2), error, verdict])
    head = ["published number", "paper", "simulated", "95 % interval", "error", "goal: at most 3 %"]
    how = paragraph(
        "`tests/reference/calibrate.py speed` fitted two numbers of the simulator together to those of the"
        " [published speed law](SPEC.md#4-sliding-speed-paper-speed-regression).",
        f"They are the length of the specimens, {length:g} mm, and the afterglow, {afterglow:g} ms.",
    )
    what = paragraph(
        f"A third number, the scale of all noise, {noise:g}, was fitted to one cell of the paper's table 2:"
        " a linear SVM names 83 % of specimens correctly (`tests/reference/calibrate.py noise`).",
    )
    return Section(f"## Fitted\n\n{how}\n\n{table(head, rows, range(1, 5))}\n\n{what}", goals)


def predicted_law(done: Sequence[Protocol]) -> Section:
    """Writes how straight the line is, and each specimen's own line."""
    r2 = interval_of([line.r2 for line in speed_law.repeat_lines(done)])
    verdict = at_least(r2.mean, GOAL_R2, 3)
    means = interval_of([statistics.fmean(r2_of_means([p]) for p in done if p.repeat == n) for n in range(REPEATS)])
    rows = [
        ["R² of 55 slides", fixed(PAPER_R2, 2), fixed(r2.mean, 4), interval_words(r2, 4), verdict],
        ["R² of 11 means of five slides", "", fixed(means.mean, 4), interval_words(means, 4), ""],
    ]
    text = table(["", "paper", "simulated", "95 % interval", f"goal: at least {GOAL_R2}"], rows, range(1, 4))
    said = paragraph(
        "The paper does not say which of the two its R² is:"
        f" with two decimals, these are {fixed(r2.mean, 2)} and {fixed(means.mean, 2)}.",
    )
    text += f"\n\n{said}"
    return Section(f"{text}\n\n{specimens_text(done)}", [("R²", verdict)])


def r2_of_means(done: Sequence[Protocol]) -> float:
    """Returns the R² of the line through the mean duration at each speed, over some protocols."""
    answers = speed_answers(done)
    means = [mean_duration(answers, speed) for speed in SPEEDS_MM_S]
    return fit_line(SPEEDS_MM_S, means).r2


def mean_duration(answers: Sequence[tuple[Slide, Event]], speed: float) -> float:
    """Returns the mean duration in frames of the slides at a speed."""
    return statistics.fmean(durations_of([event for slide, event in answers if slide.speed_mm_s == speed]))


def specimens_text(done: Sequence[Protocol]) -> str:
    """Describes how far the slopes of single specimens are from the paper's."""
    lines = {name: speed_law.mean_line([p.line for p in done if p.specimen == name]) for name in SPECIMENS}
    errors = {name: relative_error(line.slope, PAPER_SLOPE) for name, line in lines.items()}
    near = sum(abs(error) <= GOAL_ERROR for error in errors.values())
    farthest = max(errors, key=lambda name: abs(errors[name]))
    return paragraph(
        "Only the mean over specimens was fitted.",
        f"The slopes of {near} of {len(SPECIMENS)} specimens are within 3 % of the paper's;"
        f" that of {farthest} is farthest, by {percent(errors[farthest], 1, sign=True)}.",
    )


def direction_section(done: Sequence[Protocol]) -> Section:
    """Writes the directions: every specimen, direction and speed once, and all slides of the speed law."""
    streams = []
    for n, specimen in enumerate(SPECIMENS):
        slides = [Slide(specimen, speed, direction) for direction in DIRECTIONS for speed in SPEEDS_MM_S]
        streams.append((slides, DIRECTION_SEED + n))
    events = scenes.events_of_streams(streams)
    each = [
        pair
        for (slides, _), found in zip(streams, events, strict=True)
        for pair in zip(slides, found, strict=True)
    ]
    rows, goals = [], []
    for what, answers in (
        (f"{len(SPECIMENS)} specimens × {len(DIRECTIONS)} directions × {len(SPEEDS_MM_S)} speeds", each),
        (f"all slides of the speed law, {REPEATS} repeats", speed_answers(done)),
    ):
        right = sum(event.direction_deg == slide.direction_deg for slide, event in answers)
        unclear = sum(event.direction_deg is None for _, event in answers)
        verdict = all_of(right, len(answers))
        goals.append((f"directions of {what}", verdict))
        rows.append([what, str(len(answers)), str(right), str(unclear), str(len(answers) - right - unclear), verdict])
    head = ["slides", "number", "right", "unclear", "wrong", "goal: all right"]
    return Section(table(head, rows, range(1, 5)), goals)


def speed_section(done: Sequence[Protocol]) -> Section:
    """Compares the reported speeds, by the paper's law, with the true ones."""
    answers = speed_answers(done)
    of_speed = {speed: speed_errors([pair for pair in answers if pair[0].speed_mm_s == speed]) for speed in SPEEDS_MM_S}
    farthest = max(of_speed, key=lambda speed: abs(statistics.fmean(of_speed[speed])))
    mean, size, percentile = error_cells(speed_errors(answers))
    none = sum(event.speed_mm_s is None for _, event in answers)
    said = paragraph(
        f"The speed that `wstac run` prints is off by {size} on average ({mean} with its sign), and 95 % of slides by at most {percentile}.",
        f"Its mean is farthest from the truth at {farthest} mm/s, by {percent(statistics.fmean(of_speed[farthest]), sign=True)}.",
        f"One frame is {percent(10 ** (1 / -PAPER_SLOPE) - 1)} of the speed,"
        " so the error of a single slide cannot be much smaller.",
        f"{none} of {len(answers)} slides have no speed." if none else "",
    )
    return Section(said, [])


def speed_errors(answers: Sequence[tuple[Slide, Event]]) -> list[float]:
    """Returns the errors of the reported speeds, as fractions of the true ones."""
    return [
        relative_error(event.speed_mm_s, slide.speed_mm_s) for slide, event in answers if event.speed_mm_s is not None
    ]


def error_cells(errors: Sequence[float]) -> list[str]:
    """Returns mean, mean size and 95th percentile of the size of errors."""
    sizes = sorted(abs(error) for error in errors)
    percentile = sizes[(95 * len(sizes) + 99) // 100 - 1]
    return [percent(statistics.fmean(errors), sign=True), percent(statistics.fmean(sizes)), percent(percentile)]


def report(done: Sequence[Protocol]) -> str:
    """Returns the report's text."""
    fitted = fitted_section(done)
    law, direction, speed = predicted_law(done), direction_section(done), speed_section(done)
    predicted = [goal for part in (law, direction, speed) for goal in part.goals]
    intro = paragraph(
        "Every slide on this page is simulated: it says nothing about a real sensor.",
    )
    protocol = paragraph(
        "The protocol is the paper's: a specimen slides at 100, 110 … 200 mm/s, five times each,"
        " and a line is fitted to the durations over log10 v.",
        f"Here all ten specimens slide, directions take turns, and everything is repeated {REPEATS} times:"
        f" {sum(len(p.slides) for p in done)} slides.",
        "A 95 % interval is a Student interval of the mean over the repeats.",
    )
    picture = paragraph(
        f"The figure shows {PICTURE.specimen} at {PICTURE.speed_mm_s} mm/s in four directions.",
        "Each lane is a row or a column; the order of its dots, the centroids over time, gives the direction.",
    )
    text = f"""# The simulated sensor and the paper's numbers

`ci/measure reproduce` writes this page and its plots, and `ci/measure reproduce --check` checks them.
Do not edit this page.

{intro}

Fitted: {summary(fitted.goals)}

Predicted: {summary(predicted)}

{protocol}

{fitted.text}

![Duration of an event against sliding speed](plots/duration_against_speed.svg)

## Predicted

R² and the speeds follow in part from the two fitted numbers.

### The speed law's straightness

{law.text}

### Directions

{direction.text}

![Order in which rows and columns light up](plots/order_of_light.svg)

{picture}

### Speeds

{speed.text}
"""
    return text


def order_plot() -> str:
    """Returns the plot of one slide in four directions."""
    name, speed = PICTURE.specimen, PICTURE.speed_mm_s
    streams = [([Slide(name, speed, degrees)], DIRECTION_SEED) for degrees in DIRECTIONS]
    events = scenes.events_of_streams(streams, samples=True)
    found = [(degrees, event[0]) for degrees, event in zip(DIRECTIONS, events, strict=True)]
    return plots.order_plot(f"{name} at {speed:g} mm/s", found)


def main() -> int:
    """Runs the command line."""
    if len(sys.argv) != 2:
        print("reproduce.py: expected a folder to write to", file=sys.stderr)
        return 2
    folder = Path(sys.argv[1])
    done = speed_law.protocols(REPEATS, SPEED_SEED)
    files = {
        "REPRODUCE.md": report(done),
        "plots/duration_against_speed.svg": plots.duration_plot(done),
        "plots/order_of_light.svg": order_plot(),
    }
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
        print(folder / name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
