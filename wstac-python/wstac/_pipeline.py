"""Frames of your own: all to features, or one by one to events."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from . import _frames, _skin, _wstac
from ._answers import Event, Record, Recorded
from ._frames import Fps, Frames
from ._models import Configuration, Models, Path, native_config, native_models


def features(
    frames: Frames,
    format: Optional[str] = None,
    *,
    size: Optional[tuple[int, int]] = None,
    fps: Fps = 30,
    config: Configuration = None,
    bytes_per_row: Optional[int] = None,
    matrix: Optional[str] = None,
    range: Optional[str] = None,
) -> NDArray[np.int16]:
    """Returns the ten features of each frame: int16 (n, 10), five rows, then five columns.

    Features are natural logarithms in units of 1/2048.

    `frames` is a stack of pictures:

    - uint8 (n, height, width) is GREY and uint8 (n, height, width, 3) RGB3 or BGR3 (green is in the middle of both) if
      `format` is not given; a mosaic of 8 bits is RGGB, GRBG, GBRG or BA81;
    - uint8 (n, height, width, 2) is YUYV or UYVY, (n, height, width, 4) XR24 (B G R X in memory), RX24 (X R G B) and
      the like;
    - uint16 (n, height, width) is Y10, Y12, Y16, RGBP (RGB565) or a mosaic of 10 or 12 bits such as RG10;

    or raw bytes, uint8 (n, bytes), with their `size` (width, height) and, if rows are padded, `bytes_per_row`. That
    works for every format, also NV12, YU12, 422P and 444P. Formats are four-character codes of V4L2, as for `wstac run
    --format`.

    Above 45 frames per second, round(fps / 30) frames are added up to one; an incomplete one at the end is left out.
    `matrix` ("bt601", "bt709") and `range` ("limited", "full") give the YCbCr encoding. Raises `Error` for any other
    type or shape, and if layout and frames do not fit each other. Each frame is copied before it is computed without
    the interpreter's lock.

    >>> import numpy, wstac
    >>> wstac.features(numpy.full((2, 400, 400), 51, numpy.uint8))
    array([[0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
           [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]], dtype=int16)
    >>> wstac.features(numpy.zeros((400, 400)))
    Traceback (most recent call last):
    wstac.Error: frames: type float64, expected uint8, or uint16 for formats of 10 to 16 bits
    """
    stack = _frames.array(frames)
    code = format or _frames.guess(stack, single=False)
    found = _frames.sides(size) if size is not None else _frames.size_of(stack, code)
    rows = _frames.rows(stack, code, found)
    native = _native(code, found, _frames.rate(fps), native_config(config), [], bytes_per_row, matrix, range)
    if not len(rows):
        return np.zeros((0, 10), np.int16)
    _, values = native.push(rows)
    return values


class Pipeline(Recorded):
    """Takes frames of your own, one by one, and returns events.

    Formats, shapes and arguments are those of `features`. Without `size` and `format`, those of the first frame count.
    The first 25 frames (0.8 s) are the baseline: nothing may touch the sensor during them. One thread at a time may
    push. `fps` is the rate of the frames, to which speeds are proportional. Without it a warning says that 30 are
    assumed. `config` states the camera's readout, 0 for a global shutter; without it, fast slides are not reliable.

    >>> import wstac
    >>> scene = wstac.simulate("Saw3@150,90deg,seed=7", size=(400, 400))
    >>> pipeline = wstac.Pipeline(fps=30, config={"sensor": {"readout_ms": 0}})
    >>> for frame in scene.frames:
    ...     event = pipeline.push(frame)
    ...     if event:
    ...         print(event.frame, event.speed.mm_s, event.direction.deg)
    35 150.1 90.0
    >>> pipeline.features.shape, pipeline.taxels.shape, pipeline.next_frame
    ((10,), (5, 5), 141)
    >>> pipeline.finish()
    >>> pipeline.contact_ends[0].frame, pipeline.end.frames
    (75, 141)
    >>> pipeline.motions, pipeline.slips, pipeline.early_textures, pipeline.incomplete, pipeline.lost
    ([], [], [], [], [])

    With `motion`, `motions` has speed and direction of every frame while something slides. Those of a push are new in
    it. With `path_samples`, events have the samples that models of the path take (`Event.path_sample`). With `at_once`,
    an event comes as soon as its answers are certain, without a sample; `path_samples` and models over time wait for
    it.

    `record` is a new file, FILE.mcap, for frames and records, which `wstac run`, `wstac view` and `wstac.read` read.
    `labels` are its labels, such as {"specimen": "Saw3"}. `push` waits for a slow disk. A full disk raises `Error`
    once, and the recording ends. `finish` or the end of a `with` ends the file; after a crash, `wstac recover` repairs
    it.

    If the pipeline is `timed`, `push` takes the time of each frame, and it is watched as that of a file: frames that
    are missing by it and by `fps` are `lost`, and where frames come unevenly, as at another rate, `faults` say so and
    events are not reliable. Otherwise times follow from `fps` and the number of the frame, and only `lose` says that
    one is missing. These frames come at 25 per second:

    >>> pipeline = wstac.Pipeline(fps=30, timed=True)
    >>> pushed = [pipeline.push(frame, time_ns=40_000_000 * n) for n, frame in enumerate(scene.frames)]
    >>> [event.reliable for event in pushed if event], [fault.fault for fault in pipeline.faults]
    ([False], ['uneven'])

    >>> import pathlib, tempfile
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "slide.mcap"
    >>> with wstac.Pipeline(fps=30, record=file, labels={"specimen": "Saw3"}) as pipeline:
    ...     for frame in scene.frames:
    ...         _ = pipeline.push(frame)
    >>> recording = wstac.read(file)
    >>> recording.labels, (recording.frames == scene.frames).all(), recording.events[0].frame
    ({'specimen': 'Saw3'}, np.True_, 35)
    """

    def __init__(
        self,
        format: Optional[str] = None,
        *,
        size: Optional[tuple[int, int]] = None,
        fps: Optional[Fps] = None,
        config: Configuration = None,
        models: Models = (),
        model: Optional[Models] = None,
        bytes_per_row: Optional[int] = None,
        matrix: Optional[str] = None,
        range: Optional[str] = None,
        motion: bool = False,
        path_samples: bool = False,
        at_once: bool = False,
        timed: bool = False,
        record: Optional[Path] = None,
        labels: Optional[Mapping[str, str]] = None,
    ) -> None:
        super().__init__()
        if labels and record is None:
            raise _wstac.Error("labels: are those of a recording, expected record=PATH, too")
        self._format = format
        self._size = None if size is None else _frames.sides(size)
        if fps is None:
            warnings.warn("fps is not given: speeds are those of 30 frames per second", stacklevel=2)
            fps = 30
        made = (_frames.rate(fps), native_config(config), native_models(models, model), bytes_per_row, matrix, range)
        file = None if record is None else _new_recording(os.fsdecode(record))
        self._timed = bool(timed)
        self._made = (*made, bool(motion), bool(path_samples), bool(at_once), self._timed, file, labels)
        self._native: Optional[_wstac.Pipeline] = None
        self._features: Optional[NDArray[np.int16]] = None
        if format is not None and self._size is not None:
            self._start(format, self._size)

    def _start(self, code: str, size: tuple[int, int]) -> _wstac.Pipeline:
        self._format, self._size = code, size
        self._native = _native(code, size, *self._made)
        return self._native

    def push(self, frame: Frames, time_ns: Optional[int] = None) -> Optional[Event]:
        """Takes a frame, a picture or its raw bytes. Returns the event that it completes, or None.

        `time_ns` is when it was taken, in nanoseconds by a monotonic clock such as `time.monotonic_ns()`, if the
        pipeline is `timed`.

        Raises `Error` for a frame of another type or size, and for a time that is not after that of the last frame.
        That frame was not taken: `lose(1)` keeps its place in time.
        """
        time_ns = self._time(time_ns)
        picture = _frames.array(frame)
        code = self._format or _frames.guess(picture, single=True)
        stack = picture[None]
        size = self._size or _frames.size_of(stack, code)
        rows = _frames.rows(stack, code, size)
        native = self._native or self._start(code, size)
        return self._pushed(native.push(rows, time_ns))

    def push_sums(self, sums: NDArray[Any], time_ns: Optional[int] = None) -> Optional[Event]:
        """Takes the 25 taxel sums of a frame in place of its picture. Returns the event that they complete, or None.

        `sums` are whole numbers, (25,) or (5, 5), rows from above. Each is the sum of green over the pixels of a taxel,
        which `format`, `size` and the layout give: such as 0 to 637500 for GREY of 400 x 400. What follows is what
        follows from the frame. `Skin.sums` makes them. `time_ns` is as for `push`.

        Raises `Error` for sums of another length or range, without `format` and `size`, and in a pipeline of frames.

        >>> import numpy, wstac
        >>> pipeline = wstac.Pipeline("GREY", size=(400, 400), fps=30)
        >>> pipeline.push_sums(numpy.full(25, 127500))
        >>> pipeline.taxels[0, 0], pipeline.features.shape
        (np.float32(0.2), (10,))
        >>> pipeline.push_sums(numpy.full(25, -1))
        Traceback (most recent call last):
        wstac.Error: sums: that of row 1, column 1 is -1, expected a whole number from 0 to 637500
        """
        time_ns = self._time(time_ns)
        numbers = _skin.numbers("sums", sums)
        if self._native is None:
            raise _wstac.Error(
                'sums: format or size is not given, expected both, as in Pipeline("GREY", size=(400, 400))'
            )
        return self._pushed(self._native.push_sums(numbers, time_ns))

    def _time(self, time_ns: Optional[int]) -> Optional[int]:
        if (time_ns is not None) != self._timed:
            found = (
                "no time_ns, expected its time with timed=True"
                if self._timed
                else "a time_ns, expected timed=True for it"
            )
            raise _wstac.Error(f"frame: has {found}")
        return None if time_ns is None else _frames.count("time_ns", time_ns, 0, (1 << 63) - 1)

    def lose(self, frames: int = 1) -> Optional[Event]:
        """Keeps the place of lost camera frames in time. Returns the event that they complete, or None.

        Frames that are lost before the first frame have no place.

        >>> import numpy, wstac
        >>> pipeline = wstac.Pipeline(fps=30)
        >>> pipeline.push(numpy.zeros((400, 400), numpy.uint8))
        >>> pipeline.lose(3)
        >>> pipeline.next_frame, pipeline.lost
        (4, [Lost(at=1, frames=3, why='reported lost')])
        """
        frames = _frames.count("frames", frames, 0, (1 << 63) - 1)
        return None if self._native is None else self._pushed(self._native.lose(frames))

    def finish(self) -> Optional[Event]:
        """Ends the stream. Returns the event that was pending, or None. `end` tells how the stream ended.

        Raises `Error` before the first frame, and the second time.
        """
        if self._native is None:
            raise _wstac.Error("pipeline: no frame was pushed; push frames before finish()")
        return self._pushed(self._native.finish())

    def __enter__(self) -> Pipeline:
        return self

    def __exit__(self, *_: object) -> None:
        if self._native is not None and self.end is None:
            self.finish()

    @property
    def features(self) -> Optional[NDArray[np.int16]]:
        """Features of the feature frame that the last push completed, int16 (10,); None if it completed none."""
        return self._features

    @property
    def taxels(self) -> Optional[NDArray[np.float32]]:
        """Taxels of the last frame, float32 (5, 5), each a fraction of full scale, 0 to 1; None if it was lost."""
        return None if self._native is None else self._native.taxels()

    @property
    def next_frame(self) -> int:
        """Number of the feature frame that comes next, lost ones counted."""
        return 0 if self._native is None else self._native.next_frame()

    def _pushed(self, pushed: tuple[list[Record], NDArray[np.int16]]) -> Optional[Event]:
        records, values = pushed
        self._features = values[-1] if len(values) else None
        events = self._take(records)
        return events[0] if events else None


def _new_recording(file: str) -> str:
    """Refuses the name of a recording that exists, or that ends as other files do, before the first frame."""
    ending = os.path.splitext(file)[1]
    if ending.lower() not in ("", ".mcap"):
        raise _wstac.Error(f"{file}: its name ends in {ending}, expected .mcap: no other format is written")
    if os.path.lexists(file):
        error = _wstac.Error(f"{file}: exists, expected a new file")
        error.kind = "already_exists"
        raise error
    return file


def _native(
    code: str,
    size: tuple[int, int],
    rate: tuple[int, int],
    config: Optional[_wstac.Config],
    models: list[_wstac.Model],
    bytes_per_row: Optional[int],
    matrix: Optional[str],
    range: Optional[str],
    motion: bool = False,
    path_samples: bool = False,
    at_once: bool = False,
    timed: bool = False,
    record: Optional[str] = None,
    labels: Optional[Mapping[str, str]] = None,
) -> _wstac.Pipeline:
    """Returns a pipeline of the extension."""
    if bytes_per_row is not None:
        bytes_per_row = _frames.count("bytes_per_row", bytes_per_row, 1, (1 << 32) - 1)
    given = config or _wstac.Config()
    wanted = (motion, path_samples, at_once, timed, record, dict(labels or {}))
    return _wstac.Pipeline(code, size, bytes_per_row, rate, matrix, range, given, models, *wanted)
