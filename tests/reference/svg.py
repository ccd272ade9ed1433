"""Plots as SVG text: axes, ticks, lines, circles, a legend.

Pixels count from the top left. Numbers are written with one decimal, so the same data give the same bytes. The
background is left transparent, and text and axes are a gray that is readable on white and on black.
"""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass, field

GREY = "#7a7a7a"
FONT = "font-family='Helvetica, Arial, sans-serif'"


def number(value: float) -> str:
    """Formats a coordinate with at most one decimal, and never as -0."""
    text = f"{value:.1f}".removesuffix(".0")
    return "0" if text == "-0" else text


def escaped(text: str) -> str:
    """Escapes text for use between tags or in an attribute's quotes."""
    return html.escape(text, quote=True)


@dataclass
class Drawing:
    """An SVG picture with a size in pixels, to which elements are added one by one."""

    width: float
    height: float
    title: str
    elements: list[str] = field(default_factory=list)

    def line(self, points: Sequence[tuple[float, float]], color: str, width: float = 1.5, dash: str = "") -> None:
        """Adds a line through points."""
        path = " ".join(f"{number(x)},{number(y)}" for x, y in points)
        dashed = f" stroke-dasharray='{dash}'" if dash else ""
        self.elements.append(
            f"<polyline points='{path}' fill='none' stroke='{color}' stroke-width='{number(width)}'{dashed}/>"
        )

    def area(self, points: Sequence[tuple[float, float]], color: str, opacity: float) -> None:
        """Adds a filled outline, with a thin edge."""
        path = " ".join(f"{number(x)},{number(y)}" for x, y in points)
        fill = f"fill='{color}' fill-opacity='{opacity:.2f}'"
        self.elements.append(f"<polygon points='{path}' {fill} stroke='{color}'/>")

    def circle(self, x: float, y: float, radius: float, color: str, opacity: float = 1.0) -> None:
        """Adds a disc."""
        at = f"cx='{number(x)}' cy='{number(y)}' r='{number(radius)}'"
        self.elements.append(f"<circle {at} fill='{color}' fill-opacity='{opacity:.2f}'/>")

    def text(
        self, x: float, y: float, text: str, size: float = 12, anchor: str = "start", upwards: bool = False
    ) -> None:
        """Adds a line of text. `anchor` is start, middle or end."""
        turn = f" transform='rotate(-90 {number(x)} {number(y)})'" if upwards else ""
        where = f"x='{number(x)}' y='{number(y)}' text-anchor='{anchor}'{turn}"
        style = f"{FONT} font-size='{number(size)}' fill='{GREY}'"
        self.elements.append(f"<text {where} {style}>{escaped(text)}</text>")

    def __str__(self) -> str:
        """Returns the file's text."""
        size = f"width='{number(self.width)}' height='{number(self.height)}'"
        box = f"viewBox='0 0 {number(self.width)} {number(self.height)}'"
        head = f"<svg xmlns='http://www.w3.org/2000/svg' {size} {box} role='img'>"
        return "\n".join([head, f"<title>{escaped(self.title)}</title>", *self.elements, "</svg>"]) + "\n"


@dataclass(frozen=True)
class Axes:
    """A rectangle of a drawing, in pixels, and the data that it spans: `x` and `y` are first and last values."""

    drawing: Drawing
    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float]
    y: tuple[float, float]

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Returns the pixels of a point of the data."""
        right = (x - self.x[0]) / (self.x[1] - self.x[0])
        up = (y - self.y[0]) / (self.y[1] - self.y[0])
        return self.left + right * self.width, self.top + (1 - up) * self.height

    def line(self, points: Sequence[tuple[float, float]], color: str, width: float = 1.5, dash: str = "") -> None:
        """Adds a line through points of the data."""
        self.drawing.line([self.at(x, y) for x, y in points], color, width, dash)

    def x_axis(self, ticks: Sequence[float], label: str) -> None:
        """Adds the axis below, with its ticks and its title, units included."""
        bottom = self.top + self.height
        self.drawing.line([(self.left, bottom), (self.left + self.width, bottom)], GREY, 1)
        for tick in ticks:
            x, _ = self.at(tick, self.y[0])
            self.drawing.line([(x, bottom), (x, bottom + 5)], GREY, 1)
            self.drawing.text(x, bottom + 18, f"{tick:g}", 11, "middle")
        self.drawing.text(self.left + self.width / 2, bottom + 36, label, 12, "middle")

    def y_axis(self, ticks: Sequence[float], label: str) -> None:
        """Adds the axis on the left, with its ticks and its title, units included."""
        self.drawing.line([(self.left, self.top), (self.left, self.top + self.height)], GREY, 1)
        for tick in ticks:
            _, y = self.at(self.x[0], tick)
            self.drawing.line([(self.left - 5, y), (self.left, y)], GREY, 1)
            self.drawing.text(self.left - 8, y + 4, f"{tick:g}", 11, "end")
        self.drawing.text(self.left - 36, self.top + self.height / 2, label, 12, "middle", upwards=True)
