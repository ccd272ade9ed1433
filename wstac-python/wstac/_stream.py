"""Sources of the command, read event by event."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from types import TracebackType
from typing import Any, Optional

from . import _frames, _wstac
from ._answers import Event, Fault, Record, Recorded
from ._frames import Fps
from ._models import Config, Configuration, Models, Path, native_config, native_models


class Stream(Recorded):
    """An iterator over the events of a source as they come; `wstac.open` makes it.

    Ctrl-C ends the wait for a camera. `with` and `close` release the camera or file.
    """

    def __init__(self, native: _wstac.Source) -> None:
        super().__init__()
        self._native = native
        self._waiting: list[Record] = []

    @property
    def about(self) -> str:
        """A line about the source, for a person."""
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
        """Camera frames per second."""
        return self._native.rate[0] / self._native.rate[1]

    @property
    def config(self) -> Config:
        """The configuration that it is read with: the given one, or else a recording's own, or else the default."""
        return Config._of(self._native.config)

    @property
    def labels(self) -> dict[str, str]:
        """Labels of a recording, such as {"specimen": "Saw3"}."""
        return self._native.labels

    @property
    def models(self) -> list[str]:
        """Texture models that a recording was made with. They are not used: textures come from the given models."""
        return self._native.models

    @property
    def faults(self) -> list[Fault]:
        """Faults of the source so far; the last 10 000."""
        return self._records.faults

    def __iter__(self) -> Iterator[Event]:
        return self

    def __next__(self) -> Event:
        """Returns the next event. Raises `Error` if the source fails, after all events before that, and after `close`."""
        for record in self.records():
            if isinstance(record, Event):
                return record
        raise StopIteration

    def records(self) -> Iterator[Record]:
        """Yields every record as it comes: events, motions, ends of contacts, early textures, faults, lost frames, and the end.

        Raises `Error` if the source fails, after all records before that.

        >>> import wstac
        >>> for record in wstac.open("scene:Saw3@150,90deg").records():
        ...     if isinstance(record, wstac.Event):
        ...         print(record.contact, "from frame", record.touch_frame)
        ...     elif isinstance(record, wstac.ContactEnd):
        ...         print("ended at frame", record.frame)
        slide from frame 46
        ended at frame 74
        """
        while self._waiting or self._read():
            yield self._waiting.pop(0)

    def _read(self) -> bool:
        """Reads the next records. Returns whether there are any."""
        given = self._native.next()
        self._take(given)
        self._waiting += given
        return bool(given)

    def close(self) -> None:
        """Releases the file or camera. Reading on raises `Error`, unless the stream had ended."""
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
    motion: bool = False,
    path_samples: bool = False,
) -> Stream:
    """Opens any source of the command, to iterate over its events as they come.

    `source` is a camera (/dev/videoN), "scene:Saw3@150", "scene:FILE.toml", FILE.y4m, "-", a folder of PNGs or JPEGs, or FILE.mcap.
    `models` is one or several of "builtin:svm", paths and `Model`s; without it, events have no texture.

    The other arguments are the options of `wstac run` of the same name. `fps`, `format` and `size` are requested from a camera
    or scene. `fps`, `matrix` and `range` replace what a file says. `controls` are those of a camera, such as {"gain": 3}.
    `motion` gives a `Motion` of every frame while something slides, among the records. With `path_samples`, events have the
    samples that models of the path take (`Event.path_sample`). `every` hands out all frames of a camera, even if the program is
    slower. Raises `Error` if the source cannot be used.

    >>> import wstac
    >>> with wstac.open("scene:Saw3@150,180deg", models="builtin:forest") as stream:
    ...     for event in stream:
    ...         print(event.direction.deg, event.texture.pattern)
    180.5 Saw
    >>> wstac.open("nothing.mcap")
    Traceback (most recent call last):
    wstac.NotFoundError: SOURCE is "nothing.mcap": no such file; expected /dev/videoN, scene:…, a .y4m, .mcap or video file, a folder of PNGs or JPEGs, or -
    """
    options = source_options(
        config,
        models,
        fps=fps,
        format=format,
        size=size,
        matrix=matrix,
        range=range,
        every=every,
        keep_controls=keep_controls,
        controls=controls,
        motion=motion,
        path_samples=path_samples,
    )
    return Stream(_wstac.open_source(os.fsdecode(source), options, False))


def source_options(
    config: Configuration,
    models: Models,
    *,
    fps: Optional[Fps] = None,
    format: Optional[str] = None,
    size: Optional[tuple[int, int]] = None,
    matrix: Optional[str] = None,
    range: Optional[str] = None,
    every: bool = True,
    keep_controls: bool = False,
    controls: Optional[Mapping[str, int]] = None,
    motion: bool = False,
    path_samples: bool = False,
) -> dict[str, Any]:
    """Returns the options of a source as the extension takes them."""
    least, most = -(1 << 31), (1 << 31) - 1
    values = {name: _frames.count(f"control {name}", value, least, most) for name, value in (controls or {}).items()}
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
        "motion": bool(motion),
        "paths": bool(path_samples),
    }
