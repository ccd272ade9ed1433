"""Figures with matplotlib, which is needed by these alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional

import numpy as np
from numpy.typing import NDArray

from ._answers import Event
from ._recording import Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAMES = [*(f"r{k}" for k in range(1, 6)), *(f"c{k}" for k in range(1, 6))]
"""The features: rows from above, columns from the left."""
UNIT = 1 / 2048
"""A unit of the features, in natural logarithms."""


def plot_event(event: Event, ax: Optional[Axes] = None) -> Axes:
    """Draws the sample of an event: the ten features over its 70 frames, rows solid and columns dashed.

    Without `ax`, a new figure is made. Returns the axes. Needs matplotlib.

    >>> import matplotlib, wstac
    >>> matplotlib.use("Agg")
    >>> [event] = wstac.open("scene:Saw3@150,90deg")
    >>> ax = wstac.plot_event(event)
    >>> ax.get_title(), len(ax.get_lines()) >= 10
    ('slide, 150.1 ± 1.3 mm/s, 90.0 ± 0.1°', True)
    """
    _check(event, Event)
    ax = _axes(ax)
    _traces(ax, event.frame + np.arange(event.sample.shape[1]), event.sample)
    if event.touch_frame is not None:
        ax.axvline(event.touch_frame, color="gray", linewidth=0.8)
    ax.set_title(_title(event))
    ax.set_xlabel("feature frame")
    return ax


def plot_features(recording: Recording, ax: Optional[Axes] = None) -> Axes:
    """Draws the ten features of a recording or a simulated scene over its frames, and a shade behind each event's
    touch.

    Without `ax`, a new figure is made. Returns the axes. Needs matplotlib.

    >>> import matplotlib, wstac
    >>> matplotlib.use("Agg")
    >>> ax = wstac.plot_features(wstac.simulate("Tri3@120", frames=False))
    >>> len(ax.get_lines()), len(ax.patches), ax.get_ylabel()
    (10, 1, 'natural logarithm')
    """
    _check(recording, Recording)
    ax = _axes(ax)
    _traces(ax, recording.feature_frames, recording.features.T)
    ends = {end.event_frame: end.frame for end in recording.contact_ends}
    for event in recording.events:
        begin = event.frame if event.touch_frame is None else event.touch_frame
        end = event.end_frame or ends.get(event.frame) or event.frame + event.frames
        ax.axvspan(begin, end, color="gray", alpha=0.15, linewidth=0)
    ax.set_xlabel("feature frame")
    return ax


def _check(value: object, kind: type) -> None:
    if not isinstance(value, kind):
        raise TypeError(f"found {type(value).__name__}, expected wstac.{kind.__name__}")


def _axes(ax: Optional[Axes]) -> Axes:
    if ax is not None:
        return ax
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError("figures need matplotlib: pip install matplotlib") from error
    return pyplot.subplots(figsize=(8, 4), layout="constrained")[1]


def _traces(ax: Axes, frames: NDArray[Any], features: NDArray[np.int16]) -> None:
    for number, (name, values) in enumerate(zip(NAMES, features)):
        style = "-" if number < 5 else "--"
        ax.plot(frames, values * UNIT, style, color=f"C{number % 5}", linewidth=1, label=name)
    ax.set_ylabel("natural logarithm")
    ax.legend(ncols=2, fontsize="small")


def _deviation(sd: Optional[float]) -> str:
    return "" if sd is None else f" ± {max(sd, 0.1):.1f}"


def _title(event: Event) -> str:
    words = [event.contact or "event"]
    if event.speed is not None:
        words.append(f"{event.speed.mm_s:.1f}{_deviation(event.speed.sd)} mm/s")
    if event.direction is not None and event.direction.deg is not None:
        words.append(f"{event.direction.deg:.1f}{_deviation(event.direction.sd)}°")
    if event.texture is not None:
        texture = event.texture
        words.append(texture.specimen or texture.pattern or texture.class_ or "unknown texture")
    return ", ".join(words)
