"""Sources of the command, read as they come or to their end; simulated scenes and data sets."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _frames, _wstac
from ._answers import EarlyTexture, End, Event, Fault, Incomplete, Lost, Records
from ._frames import Fps, Frames
from ._models import Config, Models, Path, as_json, native_config, native_models
from ._wstac import Error

Configuration = Union[Config, str, Mapping[str, Any], None]


class Stream:
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
    def early_textures(self) -> list[EarlyTexture]:
        """What models that need fewer than 70 frames said before the event was complete, so far."""
        return self._records.early_textures

    @property
    def incomplete(self) -> list[Incomplete]:
        """Events that a gap of lost frames interrupted, so far."""
        return self._records.incomplete

    @property
    def faults(self) -> list[Fault]:
        """What happened to the source, so far."""
        return self._records.faults

    @property
    def lost(self) -> list[Lost]:
        """Camera frames that were lost, so far."""
        return self._records.lost

    @property
    def end(self) -> Optional[End]:
        """How the stream ended; None before its end."""
        return self._records.end

    def __iter__(self) -> Iterator[Event]:
        return self

    def __next__(self) -> Event:
        """The next event. Raises `Error` where the source fails, once the events before have been given."""
        while not self._waiting:
            given = self._native.next()
            if not given:
                raise StopIteration
            self._waiting += self._records.take(given)
            self._records.events.clear()
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


@dataclass(frozen=True)
class Truth:
    """A slide of a simulated scene as it truly is."""

    specimen: str
    """Such as "Saw3"."""
    speed: float
    """mm/s."""
    direction: int
    """Degrees, counter-clockwise in the picture."""
    start_frame: int
    """Camera frame of the first touch."""
    start_s: float
    """First touch in s."""
    end_s: float
    """Last touch in s."""


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """All of a recording or of a simulated scene, n camera frames and m feature frames."""

    about: str
    """What it is, for a person."""
    format: str
    """Four-character code of its frames; of JPEG pictures, as they are decoded."""
    size: tuple[int, int]
    """Width and height of its frames in pixels."""
    fps: float
    """Camera frames a second."""
    config: Config
    """The configuration that it was read with."""
    labels: dict[str, str]
    """What a person said of it, such as {"specimen": "Saw3"}."""
    models: list[str]
    """Texture models that it was recorded with."""
    frames: Optional[Frames]
    """The frames that arrived, in the shape that `wstac.features` takes for their format, (n, …); None where they were not asked for, and of
    scenes with fidelity "taxel"."""
    frame_numbers: NDArray[np.int64]
    """Number of each among all of the camera's frames, lost ones included, (n,)."""
    timestamps: NDArray[np.float64]
    """When the driver took each, in s of its own clock, (n,); nan where that is not known."""
    taxels: NDArray[np.float32]
    """Taxels of each, a share of full scale, (n, 5, 5)."""
    features: NDArray[np.int16]
    """Features, five rows, then five columns, in units of 1/2048 of a natural logarithm, (m, 10)."""
    feature_frames: NDArray[np.int64]
    """Number of each feature frame, lost ones included, (m,)."""
    events: list[Event]
    """The very events that `wstac run` prints."""
    early_textures: list[EarlyTexture]
    """What models that need fewer than 70 frames said before the event was complete."""
    incomplete: list[Incomplete]
    """Events that a gap of lost frames interrupted."""
    faults: list[Fault]
    """What happened to the source."""
    lost: list[Lost]
    """Camera frames that were lost."""
    end: End
    """How it ended."""
    truth: list[Truth]
    """Of a simulated scene, what truly happens in it."""

    def __repr__(self) -> str:
        return f"<wstac.Recording {self.about}: {len(self.events)} events>"


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
    asked = _asked(config, models, fps, format, size, matrix, range, every, keep_controls, controls)
    return Stream(_wstac.open_source(os.fspath(source), asked, False))


def read(
    source: Path,
    *,
    config: Configuration = None,
    models: Models = (),
    fps: Optional[Fps] = None,
    matrix: Optional[str] = None,
    range: Optional[str] = None,
    frames: bool = True,
) -> Recording:
    """Reads all of a recording (FILE.mcap), or of any other source that ends, as arrays.

    Features and events are worked out of its frames again, with the recording's own configuration unless `config` gives another: they are
    those of the recorded run, and what `wstac run FILE.mcap` prints. Without `frames` the pixels are left out; with them
    they are all in memory. Raises `Error` where it cannot be read, or not to its end: `wstac recover` makes it whole.
    """
    name = os.fspath(source)
    if _wstac.is_camera(name):
        raise Error(f"{name}: a camera has no end, expected a file; wstac.open gives its events as they come")
    asked = _asked(config, models, fps, None, None, matrix, range, True, False, None)
    return _recording(_wstac.open_source(name, asked, True), frames, [])


def simulate(
    scene: Union[Path, Mapping[str, Any]],
    *,
    config: Configuration = None,
    models: Models = (),
    fps: Optional[Fps] = None,
    format: Optional[str] = None,
    size: Optional[tuple[int, int]] = None,
    frames: bool = True,
) -> Recording:
    """Simulates a scene: frames, features, events, and the truth about them.

    `scene` is "Saw3@150", then any of ",90deg" and ",seed=7"; a path, FILE.toml; or a scene's keys and tables (`wstac scene --help` lists them).
    The same scene gives the same bytes on every machine. Without `frames` pixels are made and left out; the key fidelity = "taxel" makes none,
    which is much faster.

    >>> import wstac
    >>> scene = wstac.simulate({"specimen": "Tri3", "speed": 120, "fidelity": "taxel", "sensor": {"size": [640, 480]}})
    >>> scene.truth[0].speed, scene.events[0].speed.mm_s, scene.frames is None
    (120.0, 120.1, True)
    """
    asked = _asked(config, models, fps, format, size, None, None, True, False, None)
    if isinstance(scene, Mapping):
        for name, value in (("fps", fps), ("format", format), ("size", size)):
            if value is not None:
                raise Error(f'scene: {name} is {value!r}, expected it in the scene\'s table "sensor"')
        native, truth = _wstac.open_scene(as_json("scene", scene), True, asked)
    else:
        native, truth = _wstac.open_scene(os.fspath(scene).removeprefix("scene:"), False, asked)
    return _recording(native, frames, [Truth(**one) for one in json.loads(truth)])


def dataset(
    sweep: Union[Path, Mapping[str, Any]],
    *,
    config: Configuration = None,
    threads: Optional[int] = None,
) -> dict[str, NDArray[Any]]:
    """A training set of simulated slides: the arrays that `wstac dataset` writes, in memory.

    `sweep` is a path, SWEEP.toml, or its keys (`wstac dataset --help` lists them); {} is 1000 slides of the paper's ten specimens. Of n samples: X int16
    (n, 10, 70), y_specimen, y_pattern, y_depth, speed, direction, seed, reliable, duration, source; and scale, fps. `threads` is the number
    of slides that are made at a time, by default that of processors. The same sweep gives the same arrays. Slides without a whole sample are left out.

    >>> import wstac
    >>> data = wstac.dataset({"specimens": ["Saw3", "Fla0"], "slides": 3})
    >>> data["X"].shape, data["X"].dtype, data["y_specimen"].tolist()
    ((6, 10, 70), dtype('int16'), ['Saw3', 'Saw3', 'Saw3', 'Fla0', 'Fla0', 'Fla0'])
    """
    is_table = isinstance(sweep, Mapping)
    text = as_json("sweep", sweep) if isinstance(sweep, Mapping) else os.fspath(sweep)
    if threads is not None:
        threads = _frames.count("threads", threads, 1, 1024)
    made = _wstac.dataset(text, is_table, native_config(config), threads)
    if not len(made["X"]):
        counts = f"{made['no_event']} had no event and {made['incomplete']} an incomplete sample"
        raise Error(f"sweep: no slide became a sample ({counts}), expected one at least")
    numerator, denominator = made["rate"]
    depth = made["y_depth"].astype(np.int64) if made["whole_depths"] else made["y_depth"]
    return {
        "X": made["X"],
        "scale": np.array(1 / 2048),
        "y_specimen": np.array(made["y_specimen"]),
        "y_pattern": np.array(made["y_pattern"]),
        "y_depth": depth,
        "speed": made["speed"],
        "direction": made["direction"],
        "seed": made["seed"],
        "reliable": made["reliable"],
        "duration": made["duration"],
        "source": np.array(made["source"]),
        "fps": np.array(numerator / denominator),
    }


def _asked(
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


def _recording(native: _wstac.Source, with_frames: bool, truth: list[Truth]) -> Recording:
    """Reads a source to its end."""
    all_of_it = native.gather(with_frames)
    records = Records()
    records.take(all_of_it["records"])
    code, width, height, bytes_per_row = native.shape
    raw = all_of_it.get("frames")
    assert records.end is not None
    return Recording(
        about=native.about,
        format=code,
        size=(width, height),
        fps=native.rate[0] / native.rate[1],
        config=Config._of(native.config),
        labels=native.labels,
        models=native.models,
        frames=None if raw is None else _frames.pictures(raw, code, (width, height), bytes_per_row),
        frame_numbers=all_of_it["frame_numbers"],
        timestamps=all_of_it["timestamps"],
        taxels=all_of_it["taxels"],
        features=all_of_it["features"],
        feature_frames=all_of_it["feature_frames"],
        events=records.events,
        early_textures=records.early_textures,
        incomplete=records.incomplete,
        faults=records.faults,
        lost=records.lost,
        end=records.end,
        truth=truth,
    )
