#!/usr/bin/env python3
"""Fits the paper's speed law to simulated slides, as the paper fitted it to real ones.

    WSTAC=… speed_law.py [--repeats N] [--seed N]

The protocol: one specimen slides at eleven speeds of 100, 110 … 200 mm/s, five times each. A line is fitted to the
durations over the decimal logarithm of the speed. Directions take turns. A repeat is the same with other seeds.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import scenes
from scenes import DEFAULTS, DIRECTIONS, SPECIMENS, Changes, Event, Slide

SPEEDS_MM_S = tuple(range(100, 201, 10))
SLIDES_PER_SPEED = 5

PAPER_SLOPE = -56.29
"""Frames a decade of speed (*paper*)."""
PAPER_INTERCEPT = 151.06
"""Frames at 1 mm/s (*paper*)."""
PAPER_R2 = 0.99

FITTING_SEED = 1_000_000
"""Seeds of repeats that constants are fitted on start here; those of the report start at 0."""


@dataclass(frozen=True)
class Line:
    """A least-squares line of durations in frames over log10 of the speed in mm/s."""

    slope: float
    intercept: float
    r2: float


@dataclass(frozen=True)
class Protocol:
    """The result of the whole protocol with one specimen: slides, their events, and the line."""

    specimen: str
    repeat: int
    slides: list[Slide]
    events: list[Event]
    line: Line


def paper_duration(speed_mm_s: float) -> float:
    """Returns the duration in frames by the published law."""
    return PAPER_INTERCEPT + PAPER_SLOPE * math.log10(speed_mm_s)


def fit_line(speeds_mm_s: Sequence[float], durations: Sequence[float]) -> Line:
    """Fits a line to durations in frames. Sums are exactly rounded, so every machine finds the same line."""
    x = [math.log10(speed) for speed in speeds_mm_s]
    mean_x, mean_y = math.fsum(x) / len(x), math.fsum(durations) / len(x)
    sxx = math.fsum((a - mean_x) ** 2 for a in x)
    sxy = math.fsum((a - mean_x) * (b - mean_y) for a, b in zip(x, durations, strict=True))
    syy = math.fsum((b - mean_y) ** 2 for b in durations)
    if sxx == 0 or syy == 0:
        raise ValueError("no line: all speeds or all durations are the same")
    slope = sxy / sxx
    return Line(slope, mean_y - slope * mean_x, sxy * sxy / (sxx * syy))


def protocol_slides(specimen: str) -> list[Slide]:
    """Returns the slides of one protocol: 55, with directions in turn."""
    speeds = [speed for speed in SPEEDS_MM_S for _ in range(SLIDES_PER_SPEED)]
    return [Slide(specimen, speed, DIRECTIONS[n % len(DIRECTIONS)]) for n, speed in enumerate(speeds)]


def durations_of(events: Sequence[Event]) -> list[int]:
    """Returns the durations in frames. Raises an error if an event has none."""
    found = [event.duration_frames for event in events if event.duration_frames is not None]
    if len(found) != len(events):
        raise SystemExit(f"{len(events) - len(found)} of {len(events)} events have no duration")
    return found


def protocols(repeats: int, seed: int, changes: Changes = DEFAULTS) -> list[Protocol]:
    """Runs the protocol over all ten specimens, several times. Each repeat of a specimen has its own stream and seed."""
    runs = [(repeat, specimen) for repeat in range(repeats) for specimen in SPECIMENS]
    streams = [(protocol_slides(specimen), seed + n) for n, (_, specimen) in enumerate(runs)]
    done = scenes.events_of_streams(streams, changes)
    found = []
    for (repeat, specimen), (slides, _), events in zip(runs, streams, done, strict=True):
        line = fit_line([slide.speed_mm_s for slide in slides], durations_of(events))
        found.append(Protocol(specimen, repeat, slides, events, line))
    return found


def mean_line(lines: Sequence[Line]) -> Line:
    """Returns the means of slope, intercept and R²."""
    return Line(
        statistics.fmean(line.slope for line in lines),
        statistics.fmean(line.intercept for line in lines),
        statistics.fmean(line.r2 for line in lines),
    )


def repeat_lines(done: Sequence[Protocol]) -> list[Line]:
    """Returns the mean line of the ten specimens for each repeat."""
    repeats = sorted({protocol.repeat for protocol in done})
    return [mean_line([p.line for p in done if p.repeat == repeat]) for repeat in repeats]


def words(line: Line) -> str:
    """Describes a line in words."""
    return f"D = {line.intercept:.2f} - {-line.slope:.2f} log10 v, R² {line.r2:.4f}"


def main() -> int:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description="the speed law of simulated slides")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    done = protocols(arguments.repeats, arguments.seed)
    for specimen in SPECIMENS:
        print(f"{specimen}  {words(mean_line([p.line for p in done if p.specimen == specimen]))}")
    print(f"mean  {words(mean_line([p.line for p in done]))}")
    print(f"paper {words(Line(PAPER_SLOPE, PAPER_INTERCEPT, PAPER_R2))}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
