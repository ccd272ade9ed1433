"""A source of the command, read as it comes."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from types import TracebackType
from typing import Any, Optional

from . import _frames, _wstac
from ._answers import Event, Fault, Lost, Recorded, Records
from ._frames import Fps
from ._models import Config, Configuration, Models, Path, native_config, native_models


class Stream(Recorded):
    """Events of a source as they come: an iterator, made by `wstac.open`.

    Ctrl-C ends the wait for a camera. `with` lets go of a camera or file at the end; so does `close`.
    """

    def __init__(self, native: _wstac.Source) -> None:
        self._native = native
        self._records = Records()
        self._waiting: list[Event] = []

    @property
    def about(self) -> str:
        """What the source is, for a person."""
        return self._native.about

    @property
    def format(self) -> str:
        """Four-character code of its frames."""
        return self._native.shape[0]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of its frames in pixels."""
        return self._native.shape[1:3]

    @property
    def fps(self) -> float:
        """Camera frames a second."""
        return self._native.rate[0] / self._native.rate[1]

    @property
    def config(self) -> Config:
        """The configuration that it is read with: the one that was given, else a recording's own, else the default."""
        return Config._of(self._native.config)

    @property
    def labels(self) -> dict[str, str]:
        """What a person said of a recording, such as {"specimen": "Saw3"}."""
        return self._native.labels

    @property
    def models(self) -> list[str]:
        """Texture models that a recording was made with; textures come from models that are given, not from these."""
        return self._native.models

    @property
    def faults(self) -> list[Fault]:
        """What happened to the source, so far; the last 10 000."""
        return self._records.faults

    @property
    def lost(self) -> list[Lost]:
        """Camera frames that were lost, so far; the last 10 000."""
        return self._records.lost

    def __iter__(self) -> Iterator[Event]:
        return self

    def __next__(self) -> Event:
        """The next event. Raises `Error` where the source fails, once the events before have been given."""
        while not self._waiting:
            given = self._native.next()
            if not given:
                raise StopIteration
            self._waiting += self._records.take(given)
            self._records.forget()
        return self._waiting.pop(0)

    def close(self) -> None:
        """Lets go of the file or camera; the stream is at its end then."""
        self._native.close()

    def __enter__(self) -> Stream:
        return self

    def __exit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], at: Optional[TracebackType]
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<wstac.Stream {self.about}>"


def open(
    source: Path,
    *,
    config: Configuration = None,
    models: Models = (),
    fps: Optional[Fps] = None,
    format: Optional[str] = None,
    size: Optional[tuple[int, int]] = None,
    matrix: Optional[str] = None,
    range: Optional[str] = None,
    every: bool = False,
    keep_controls: bool = False,
    controls: Optional[Mapping[str, int]] = None,
) -> Stream:
    """Opens any source of the command, to iterate over its events as they come.

    `source` is a camera (/dev/videoN), "scene:Saw3@150", "scene:FILE.toml", FILE.y4m, "-", a folder of PNGs, or FILE.mcap. `models` names
    textures: one or several of "builtin:svm", paths and `Model`s. The other arguments are the options of `wstac run` of the same name:
    `fps`, `format` and `size` are asked of a camera or scene, `fps`, `matrix` and `range` replace what a file says; `controls` are a camera's, such as
    {"gain": 3}. `every` hands out all frames of a camera, also where the program is slower than it. Raises `Error` where the source cannot be used.

    >>> import wstac
    >>> with wstac.open("scene:Saw3@150,180deg", models="builtin:forest") as stream:
    ...     for event in stream:
    ...         print(event.direction.deg, event.texture.pattern)
    180 Saw
    >>> wstac.open("nothing.mcap")
    Traceback (most recent call last):
    wstac.Error: SOURCE is "nothing.mcap": no such file; expected /dev/videoN, scene:…, a .y4m or .mcap file, a folder of PNGs or -
    """
    asking = asked(config, models, fps, format, size, matrix, range, every, keep_controls, controls)
    return Stream(_wstac.open_source(os.fspath(source), asking, False))


def asked(
    config: Configuration,
    models: Models,
    fps: Optional[Fps],
    format: Optional[str],
    size: Optional[tuple[int, int]],
    matrix: Optional[str],
    range: Optional[str],
    every: bool,
    keep_controls: bool,
    controls: Optional[Mapping[str, int]],
) -> dict[str, Any]:
    """What is asked of a source, as the extension takes it."""
    values = {name: _frames.count(f"control {name}", value, -(1 << 31), (1 << 31) - 1) for name, value in (controls or {}).items()}
    return {
        "rate": None if fps is None else _frames.rate(fps),
        "format": format,
        "size": None if size is None else _frames.sides(size),
        "matrix": matrix,
        "range": range,
        "every": bool(every),
        "keep_controls": bool(keep_controls),
        "controls": values,
        "config": native_config(config),
        "models": native_models(models),
    }
