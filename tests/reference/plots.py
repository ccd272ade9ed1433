"""The plots of the report: simulated slides as SVG text."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from scenes import Event
from speed_law import SPEEDS_MM_S, Protocol, durations_of, paper_duration
from svg import Axes, Drawing

BLUE, ORANGE = "#2f81c7", "#d9731a"
ROWS = 5
DARK_FRAMES = 5
"""Frames at the start of a sample that are before any contact."""


def duration_plot(done: Sequence[Protocol]) -> str:
    """Returns the durations of simulated slides against speed, over the paper's curve."""
    drawing = Drawing(640, 420, "Duration of an event against sliding speed")
    axes = Axes(drawing, 62, 20, 560, 340, (95, 205), (18, 42))
    axes.x_axis(range(100, 201, 10), "sliding speed in mm/s")
    axes.y_axis(range(20, 41, 5), "duration in frames of 1/30 s")
    slides = [
        (slide.speed_mm_s, duration)
        for protocol in done
        for slide, duration in zip(protocol.slides, durations_of(protocol.events), strict=True)
    ]
    counts = Counter(slides)
    a_speed = len(slides) / len(SPEEDS_MM_S)
    for (speed, duration), count in sorted(counts.items()):
        drawing.circle(*axes.at(speed, duration), bubble(count / a_speed), BLUE, 0.75)
    curve = [(speed, paper_duration(speed)) for speed in range(100, 201, 2)]
    axes.line(curve, ORANGE, 2)
    drawing.line([(300, 40), (330, 40)], ORANGE, 2)
    drawing.text(340, 44, "paper: 151.06 − 56.29 log10 v")
    for place, share in ((302, 0.1), (320, 0.5)):
        drawing.circle(place, 64, bubble(share), BLUE, 0.75)
    drawing.text(340, 68, "simulated: 10 % and 50 % of a speed's slides")
    return str(drawing)


def bubble(share: float) -> float:
    """Returns the radius in pixels of a disc whose area shows a fraction. It is never too small to be seen."""
    return max(11 * math.sqrt(share), 1.2)


def order_plot(what: str, slides: Sequence[tuple[int, Event]]) -> str:
    """Returns the ten features of four slides, pairs of direction in degrees and event, one panel each."""
    drawing = Drawing(760, 640, f"Order in which rows and columns light up: {what}")
    for n, (degrees, event) in enumerate(slides):
        left, top = 70 + 370 * (n % 2), 34 + 296 * (n // 2)
        panel(drawing, left, top, f"{degrees}°, {WAYS[degrees]}", event)
    drawing.line([(70, 622), (94, 622)], BLUE, 2)
    drawing.text(100, 626, "rows, top to bottom")
    drawing.line([(240, 622), (264, 622)], ORANGE, 2)
    drawing.text(270, 626, "columns, left to right")
    drawing.circle(424, 622, 3.5, BLUE)
    drawing.circle(436, 622, 3.5, ORANGE)
    drawing.text(448, 626, "centroid of the light")
    return str(drawing)


WAYS = {0: "to the right", 90: "upwards", 180: "to the left", 270: "downwards"}


def panel(drawing: Drawing, left: float, top: float, title: str, event: Event) -> None:
    """Draws one slide: a lane for each feature, with its light above the dark frames over time."""
    width, height = 290, 220
    light = [above_dark(feature) for feature in event.sample or []]
    most = max(max(feature) for feature in light)
    frames = len(light[0])
    drawing.text(left + width / 2, top - 8, title, 13, "middle")
    axes = Axes(drawing, left, top, width, height, (0, frames), (0, 1))
    axes.x_axis(range(0, frames + 1, 10), "frame of the sample")
    lane = height / len(light)
    for k, feature in enumerate(light):
        color = BLUE if k < ROWS else ORANGE
        base = top + (k + 1) * lane
        name = f"row {k + 1}" if k < ROWS else f"column {k + 1 - ROWS}"
        drawing.text(left - 6, base - 5, name, 10, "end")
        band = Axes(drawing, left, base - 0.85 * lane, width, 0.85 * lane, (0, frames), (0, most))
        outline = [band.at(t, value) for t, value in enumerate(feature)]
        drawing.area([(left, base), *outline, (outline[-1][0], base)], color, 0.3)
        drawing.circle(band.at(centroid(feature), 0)[0], base - lane / 2, 3.5, color)


def above_dark(feature: Sequence[float]) -> list[float]:
    """Returns light from a feature's logarithms, less the mean of the dark frames, at least 0, as fractions of full
    scale.
    """
    light = [math.exp(value) for value in feature]
    dark = math.fsum(light[:DARK_FRAMES]) / DARK_FRAMES
    return [max(value - dark, 0.0) for value in light]


def centroid(light: Sequence[float]) -> float:
    """Returns the mean moment of light over frames, in frames."""
    return math.fsum(t * value for t, value in enumerate(light)) / math.fsum(light)
