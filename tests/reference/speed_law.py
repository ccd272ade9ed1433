"""Fits the paper's speed law to simulated slides, as the paper fitted it to real ones.

The protocol: one specimen slides at eleven speeds of 100, 110 … 200 mm/s, five times each. A line is fitted to the
durations over the decimal logarithm of the speed. Directions take turns. A repeat is the same with other seeds.
"""

from __future__ import annotations

import math
import statistics
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
    """Fits a line to durations in frames."""
    x = [math.log10(speed) for speed in speeds_mm_s]
    slope, intercept = statistics.linear_regression(x, durations)
    return Line(slope, intercept, statistics.correlation(x, durations) ** 2)


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
