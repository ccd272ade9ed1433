"""Sources of the command, read event by event."""

from __future__ import annotations

import asyncio
import os
import warnings
from collections.abc import AsyncIterator, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from types import TracebackType
from typing import Any, Optional, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import _frames, _wstac
from ._answers import Event, Record, Recorded
from ._frames import Fps, Frames
from ._models import Config, Configuration, Models, Path, native_config, native_models

Item = TypeVar("Item")


@dataclass(frozen=True, eq=False)
class FeatureFrame:
    """A feature frame of `Frame.completed`: a camera frame, or above 45 frames per second several that are added up.

    >>> import wstac
    >>> [one] = next(wstac.open("scene:Saw3@150,90deg").frames()).completed
    >>> one.number, one.last_frame, one.features.shape, one.taxel_sums.shape
    (0, 0, (10,), (5, 5))
    """

    number: int
    """Its number."""
    last_frame: int
    """Number of the last camera frame of it that arrived."""
    features: NDArray[np.int16] = field(repr=False)
    """Its ten features, as `Frame.features` has them."""
    taxel_sums: NDArray[np.uint32] = field(repr=False)
    """The taxel sums that it is made of: uint32 (5, 5). The mean of the camera frames that arrived stands for lost
    ones. 0 of a board."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A camera frame of `Stream.frames`, and what followed from it.

    >>> import wstac
    >>> frame = next(wstac.open("scene:Saw3@150,90deg").frames(pictures=True))
    >>> frame.number, frame.timestamp, frame.taxels.shape, frame.features.shape, frame.picture.shape, frame.event
    (0, 0.0, (5, 5), (10,), (720, 1280), None)
    """

    number: int
    """Its number among all camera frames, lost ones counted."""
    timestamp: float
    """Its time in s: the driver's own, or from 0 by its number and the rate (`End.clock`)."""
    taxels: NDArray[np.float32] = field(repr=False)
    """Taxels as fractions of full scale, 0 to 1: float32 (5, 5), the first row at the top. NaN of a board, which sends
    none."""
    features: Optional[NDArray[np.int16]] = field(repr=False)
    """The ten features of the feature frame that it completed, five rows, then five columns, in units of 1/2048 of a
    natural logarithm: int16 (10,). None if it completed none: above 45 frames per second, frames are added up."""
    feature_frame: Optional[int]
    """Number of that feature frame."""
    picture: Optional[Frames] = field(repr=False)
    """Its pixels in the shape that `wstac.features` takes for their format; None unless they were asked for, or if
    there are none."""
    records: list[Record] = field(repr=False)
    """The records since the frame before, such as an `Event` that it completed."""
    sums: NDArray[np.uint32] = field(repr=False)
    """Sums of the green of each taxel's pixels: uint32 (5, 5). 0 of a board."""
    stamp: Optional[datetime] = field(repr=False)
    """Wall-clock time at which it was taken, with the time zone UTC; None where the source knows none."""
    completed: list[FeatureFrame] = field(repr=False)
    """The feature frames since the frame before: one that lost frames have completed, and one that it completed
    itself."""

    @property
    def event(self) -> Optional[Event]:
        """The event that it completed, or None."""
        return next((record for record in self.records if isinstance(record, Event)), None)


class Stream(Recorded):
    """An iterator over the events of a source as they come; `wstac.open` makes it.

    Ctrl-C ends the wait for a camera. `with` and `close` release the camera or file.

    >>> import wstac
    >>> with wstac.open("scene:Saw3@150,90deg", motion=True) as stream:
    ...     events = list(stream)
    >>> stream.about
    'scene: Saw3 at 150 mm/s, 90 degrees, seed 0, 140 frames of 1280x720 GREY'
    >>> stream.format, stream.size, stream.fps, stream.labels, stream.models, stream.config == wstac.Config()
    ('GREY', (1280, 720), 30.0, {}, [], True)
    >>> len(events), len(stream.motions), stream.contact_ends[0].frame, stream.end.frames
    (1, 19, 74, 140)
    >>> stream.slips, stream.early_textures, stream.incomplete, stream.faults, stream.lost, stream.notes
    ([], [], [], [], [], [])
    >>> stream.bytes_per_row, stream.ros_encoding, stream.completed, stream.is_recording, stream.end_recording()
    (1280, 'mono8', [], False, None)

    In a program of asyncio, `async for` waits for events in a thread, and so do `aframes` and `arecords`. A task that
    is cancelled meanwhile closes the stream.

    >>> import asyncio, wstac
    >>> async def main():
    ...     async with wstac.open("scene:Saw3@150,90deg") as stream:
    ...         async for event in stream:
    ...             print(event.contact, event.speed.mm_s)
    >>> asyncio.run(main())
    slide 150.1
    """

    def __init__(self, native: _wstac.Source) -> None:
        super().__init__()
        self._native = native
        self._waiting: list[Record] = []
        self._completed: list[FeatureFrame] = []

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
    def bytes_per_row(self) -> int:
        """Bytes from row to row of its frames, of planes in the first one. 0 of a board."""
        return self._native.shape[3]

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
    def notes(self) -> list[str]:
        """What nothing states of the source, such as where its taxels are, and what follows for the answers: for a
        person.

        Of a board, what it says of itself, and what happens to its line: the first 999 notes and the last one.
        """
        return self._native.notes

    def __iter__(self) -> Iterator[Event]:
        return self

    def __next__(self) -> Event:
        """Returns the next event. Raises `Error` if the source fails, after all events before that, and after
        `close`."""
        for record in self.records():
            if isinstance(record, Event):
                return record
        raise StopIteration

    def records(self) -> Iterator[Record]:
        """Yields every record as it comes: events, motions, ends of contacts, slips, early textures, faults, lost
        frames, and the end.

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

    def frames(self, pictures: bool = False) -> Iterator[Frame]:
        """Yields every camera frame as it comes, with its taxels, its features, and the records that followed from it.

        With `pictures` also its pixels. The records are those of `records`, which then yields what followed after the
        last frame; `completed` has the feature frames that did. Raises `Error` if the source fails.

        >>> import wstac
        >>> for frame in wstac.open("scene:Saw3@150,90deg").frames():
        ...     if frame.event:
        ...         print(frame.number, frame.taxels.shape, frame.features.shape, frame.event.contact)
        104 (5, 5) (10,) slide
        """
        while True:
            found = self._native.next_frame(pictures)
            self._take(found["records"])
            self._waiting += found["records"]
            each = (found[name] for name in ("feature_frames", "last_frames", "features", "taxel_sums"))
            self._completed += [
                FeatureFrame(int(at), int(last), features, sums) for at, last, features, sums in zip(*each)
            ]
            if not len(found["frame_numbers"]):
                if not found["records"]:
                    return
                continue
            code, width, height, bytes_per_row = self._native.shape
            raw, number = found.get("frames"), int(found["frame_numbers"][0])
            records, self._waiting = self._waiting, []
            completed, self._completed = self._completed, []
            own = completed[-1] if completed and completed[-1].last_frame == number else None
            yield Frame(
                number=number,
                timestamp=float(found["timestamps"][0]),
                taxels=found["taxels"][0],
                features=None if own is None else own.features,
                feature_frame=None if own is None else own.number,
                picture=None if raw is None else _frames.pictures(raw, code, (width, height), bytes_per_row)[0],
                records=records,
                sums=found["sums"][0],
                stamp=found["stamps"][0],
                completed=completed,
            )

    @property
    def completed(self) -> list[FeatureFrame]:
        """The feature frames since the last frame of `frames`: at the end, those that lost frames have completed."""
        return list(self._completed)

    def __aiter__(self) -> AsyncIterator[Event]:
        return self._in_threads(iter(self))

    def arecords(self) -> AsyncIterator[Record]:
        """Yields what `records` does, for `async for`.

        >>> import asyncio, wstac
        >>> async def kinds(stream):
        ...     return [type(record).__name__ async for record in stream.arecords()]
        >>> asyncio.run(kinds(wstac.open("scene:Saw3@150,90deg")))
        ['Event', 'ContactEnd', 'End']
        """
        return self._in_threads(self.records())

    def aframes(self, pictures: bool = False) -> AsyncIterator[Frame]:
        """Yields what `frames` does, for `async for`.

        >>> import asyncio, wstac
        >>> async def completing(stream):
        ...     return [frame.number async for frame in stream.aframes() if frame.event]
        >>> asyncio.run(completing(wstac.open("scene:Saw3@150,90deg")))
        [104]
        """
        return self._in_threads(self.frames(pictures))

    async def _in_threads(self, items: Iterator[Item]) -> AsyncIterator[Item]:
        """Yields what an iterator does, each waited for in a thread."""
        nothing = object()
        while True:
            try:
                item = await asyncio.to_thread(next, items, nothing)
            except asyncio.CancelledError:
                # Or the thread would wait for a camera that nobody reads.
                self.close()
                raise
            if item is nothing:
                return
            yield item  # type: ignore[misc]

    def _read(self) -> bool:
        """Reads the next records. Returns whether there are any."""
        given = self._native.next()
        self._take(given)
        self._waiting += given
        return bool(given)

    @property
    def ros_encoding(self) -> Optional[str]:
        """Encoding of its pictures in `sensor_msgs/Image` of ROS 2, of planes that of the first; None if it has
        none."""
        return self._native.ros_encoding

    def restart_baseline(self) -> None:
        """Gathers a new baseline from the next frame on: 25 frames during which nothing may touch the sensor.

        Like the orders below, it is refused with an `Error` by a board, after the end, and during a recording, whose
        replay would not know of it. It may be called while another thread reads, and then waits for at most a second.

        >>> import wstac
        >>> with wstac.open("scene:Saw3@150,90deg") as stream:
        ...     stream.restart_baseline()
        ...     print(len(list(stream)))
        1
        """
        self._native.restart_baseline()

    def reconfigure(self, config: Configuration) -> None:
        """Uses another configuration from the next frame on, with a new baseline. Numbers and times of frames go on.

        >>> import wstac
        >>> with wstac.open("scene:Saw3@150,90deg") as stream:
        ...     stream.reconfigure({"trigger": {"window": 7}})
        ...     stream.use_models("builtin")
        """
        self._native.reconfigure(native_config(config) or _wstac.Config())

    def use_models(self, models: Models) -> None:
        """Names textures with these models, in place of all others."""
        self._native.use_models(native_models(models, None))

    def start_recording(
        self, file: Path, labels: Optional[Mapping[str, str]] = None, *, features_only: bool = False
    ) -> None:
        """Restarts the baseline, and records to a new MCAP file from the next frame on.

        `labels` are its labels, such as {"specimen": "Saw3"}. With `features_only` it has taxel sums and no pictures.
        The end of the source or a full disk ends it, too; `stop_recording` then gives the result. Open a camera with
        `every`, or frames that the program does not read in time are missing.

        >>> import pathlib, tempfile, wstac
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "slide.mcap"
        >>> with wstac.open("scene:Saw3@150,90deg", size=(400, 400)) as stream:
        ...     stream.start_recording(file, {"specimen": "Saw3"})
        ...     events = list(stream)
        ...     print(stream.stop_recording())
        140
        >>> wstac.read(file).labels, len(wstac.read(file).events)
        ({'specimen': 'Saw3'}, 1)
        """
        self._native.start_recording(os.fsdecode(file), dict(labels or {}), bool(features_only))

    @property
    def is_recording(self) -> bool:
        """Whether a recording is in progress."""
        return self._native.is_recording()

    def stop_recording(self) -> int:
        """Ends the recording, and returns the number of its frames. Raises `Error` if there is none, or if not all
        could be written."""
        ended = self.end_recording()
        if ended is None:
            raise _wstac.Error(f"{self.about}: has no recording in progress")
        frames, doubt = ended
        if doubt:
            warnings.warn(f"{self.about}{doubt}", stacklevel=2)
        return frames

    def end_recording(self) -> Optional[tuple[int, str]]:
        """Ends the recording as `stop_recording` does, without a warning. Returns None if there is none.

        Returns the number of its frames, and what the warning says, which is mostly nothing.
        """
        ended = self._native.stop_recording()
        return None if ended is None else (ended[1], ended[3])

    def close(self) -> None:
        """Releases the file or camera. Reading on raises `Error`, unless the stream had ended.

        >>> import wstac
        >>> stream = wstac.open("scene:Saw3@150,90deg")
        >>> stream.close()
        >>> next(stream)  # doctest: +ELLIPSIS
        Traceback (most recent call last):
        wstac.Error: scene: Saw3 at 150 mm/s...: the stream is closed; open its source again
        """
        self._native.close()

    async def __aenter__(self) -> Stream:
        return self

    async def __aexit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], at: Optional[TracebackType]
    ) -> None:
        self.close()

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
    model: Optional[Models] = None,
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
    at_once: bool = False,
    sensor: Optional[str] = None,
    paced: bool = False,
    baud: Optional[int] = None,
) -> Stream:
    """Opens any source of the command, to iterate over its events as they come.

    `source` is a camera (/dev/videoN, or rpicam: on a Raspberry Pi), "scene:Saw3@150", "scene:FILE.toml", FILE.y4m,
    "-", a folder of PNGs or JPEGs, or FILE.mcap. It may be a board (/dev/ttyACM0, tcp:HOST:PORT), which finds events
    itself: its `frames` have features and no taxels, and `baud` is the rate of a serial line in bits per second, 115200
    by default. `models` is one or several of "builtin", paths and `Model`s; without it, events have no texture, also
    those of scenes. `model` is another name of it, as the command has; `read`, `simulate` and `Pipeline` take it, too.

    The other arguments are the options of `wstac run` of the same name. `fps`, `format` and `size` are requested
    from a camera or scene. `fps`, `matrix` and `range` replace what a file says. `controls` are those of a camera,
    such as {"gain": 3}. `motion` gives a `Motion` of every frame while something slides, among the records. With
    `path_samples`, events have the samples that models of the path take (`Event.path_sample`). With `at_once`, an
    event comes as soon as its answers are certain, without a sample; `path_samples` and models over time wait for
    it. Otherwise it comes after 70 frames. `every` hands out all frames of a camera, even if the program is slower.
    `sensor` is the name of one sensor of a recording of several. With `paced`, a file or scene is read at the rate
    of its frames. Raises `Error` if the source cannot be used.

    >>> import wstac
    >>> with wstac.open("scene:Saw3@150,180deg", model="builtin") as stream:
    ...     for event in stream:
    ...         print(event.direction.deg, event.texture.pattern)
    179.99 Saw
    >>> wstac.open("nothing.mcap")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    wstac.NotFoundError: SOURCE is "nothing.mcap": no such file; expected /dev/videoN, rpicam:, scene:…, a .y4m, ...
    """
    options = source_options(
        config,
        models,
        model,
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
        at_once=at_once,
        sensor=sensor,
        paced=paced,
        baud=baud,
    )
    return Stream(_wstac.open_source(os.fsdecode(source), options, True))


def source_options(
    config: Configuration,
    models: Models,
    model: Optional[Models],
    *,
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
    at_once: bool = False,
    sensor: Optional[str] = None,
    paced: bool = False,
    baud: Optional[int] = None,
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
        "models": native_models(models, model),
        "motion": bool(motion),
        "paths": bool(path_samples),
        "at_once": bool(at_once),
        "sensor": sensor,
        "paced": bool(paced),
        "baud": None if baud is None else _frames.count("baud", baud, 1, (1 << 32) - 1),
    }
