"""Rolling shutters, as the readout cases have them."""

from __future__ import annotations

from typing import Any

from wstac_reference.layout import Layout, paper_layout
from wstac_reference.readout import Readout, readout

FRAME = (640, 480)
UPRIGHT = paper_layout(*FRAME)
TILTED = Layout(
    UPRIGHT.width,
    UPRIGHT.height,
    tuple((x - 8 * (k // 5 - 2), y + 8 * (k % 5 - 2)) for k, (x, y) in enumerate(UPRIGHT.corners)),
)
"""Lines of taxels are not parallel to those of the picture, so rows and columns both have a delay."""

TILTED.check(*FRAME)

Shutter = tuple[float | None, str, Layout]
"""Milliseconds from the first row to the last, or None if unknown; where the rows follow each other; the taxels."""
SHUTTERS: tuple[Shutter, ...] = (
    *((20.0, "down", UPRIGHT), (0.0, "down", UPRIGHT), (-10.0, "down", UPRIGHT), (33.0, "up", UPRIGHT)),
    *((10.0, "right", UPRIGHT), (-33.0, "left", UPRIGHT), (33.0, "right", TILTED)),
    *((None, "down", UPRIGHT), (None, "left", UPRIGHT), (None, "up", TILTED)),
)


def readout_of(shutter: Shutter) -> Readout:
    """The readout of a picture with these taxels."""
    return readout(*shutter, FRAME)


def named(shutter: Shutter) -> dict[str, Any]:
    """A shutter as the vectors have it."""
    ms, order, layout = shutter
    return {
        "readout_ms": ms,
        "order": order,
        "frame": FRAME,
        "taxel": [layout.width, layout.height],
        "corners": layout.corners,
    }
