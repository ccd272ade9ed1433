"""Recordings and simulated scenes as arrays."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _frames, _wstac
from ._answers import ContactEnd, EarlyTexture, End, Event, Fault, Incomplete, Lost, Records, Slip
from ._frames import Fps, Frames
from ._models import Config, Configuration, Models, Path, as_json
from ._stream import source_options
from ._wstac import Error


@dataclass(frozen=True)
class Truth:
    """The true properties of a touch of a simulated scene. The extension gives the fields in this order.

    >>> import wstac
    >>> [truth] = wstac.simulate("Saw3@150,90deg", frames=False).truth
    >>> truth.kind, truth.specimen, truth.speed, truth.direction, truth.start_frame
    ('slide', 'Saw3', 150.0, 90.0, 45)
    """

    kind: str
    """ "slide", "press", "poke" or "hold"."""
    specimen: str | None
    """Such as "Saw3"; None unless it slides."""
    speed: float | None
    """Speed at the first touch in mm/s; None unless it slides."""
    direction: float | None
    """Direction in degrees, counterclockwise; 0 is right along the sensor's rows; None unless it slides."""
    start_frame: int
    """Camera frame of the first touch."""
    start_s: float
    """Time of the first touch in s."""
    end_s: float
    """Time of the last touch in s."""


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """A whole recording or simulated scene: n camera frames and m feature frames.

    >>> import wstac
    >>> recording = wstac.read("scene:Saw3@150,90deg")
    >>> recording.frames.shape, recording.taxels.shape, recording.features.shape
    ((140, 720, 1280), (140, 5, 5), (140, 10))
    >>> recording.format, recording.size, recording.fps, len(recording.events), recording.end.dropped
    ('GREY', (1280, 720), 30.0, 1, 0)
    """

    about: str
    """A line about it, for a person."""
    format: str
    """Four-character code of its frames; for JPEG pictures, that of the decoded frames."""
    size: tuple[int, int]
    """Width and height of its frames in pixels."""
    fps: float
    """Camera frames per second."""
    config: Config
    """The configuration that it was read with."""
    labels: dict[str, str]
    """Its labels, such as {"specimen": "Saw3"}."""
    models: list[str]
    """Texture models that it was recorded with."""
    notes: list[str]
    """What nothing states of it, such as where its taxels are, and what follows for the answers: for a person."""
    frames: Optional[Frames]
    """The frames that arrived, in the shape that `wstac.features` takes for their format, (n, …). None without
    `frames`, and for scenes with fidelity "taxel"."""
    frame_numbers: NDArray[np.int64]
    """The number of each frame among all camera frames, lost ones included, (n,)."""
    timestamps: NDArray[np.float64]
    """The time of each frame in s, (n,), by `end.clock`: the driver's own, or from 0 by its number and the rate."""
    taxels: NDArray[np.float32]
    """The taxels of each frame, fractions of full scale, (n, 5, 5)."""
    features: NDArray[np.int16]
    """Features, five rows, then five columns, in units of 1/2048 of a natural logarithm, (m, 10)."""
    feature_frames: NDArray[np.int64]
    """Number of each feature frame, lost ones included, (m,)."""
    events: list[Event]
    """The events that `wstac run` prints."""
    early_textures: list[EarlyTexture]
    """Answers of models that need fewer than 70 frames."""
    incomplete: list[Incomplete]
    """Samples that a gap of lost frames interrupted."""
    contact_ends: list[ContactEnd]
    """Ends of the touches of events; empty by a law of durations."""
    slips: list[Slip]
    """Slips of held parts."""
    faults: list[Fault]
    """Faults of the source."""
    lost: list[Lost]
    """Camera frames that were lost."""
    end: End
    """How the stream ended."""
    truth: list[Truth]
    """What truly happens in a simulated scene; empty for recordings."""

    def __repr__(self) -> str:
        return f"<wstac.Recording {self.about}: {len(self.events)} events>"


def read(
    source: Path,
    *,
    config: Configuration = None,
    models: Models = (),
    model: Optional[Models] = None,
    fps: Optional[Fps] = None,
    matrix: Optional[str] = None,
    range: Optional[str] = None,
    frames: bool = True,
    path_samples: bool = False,
    sensor: Optional[str] = None,
) -> Recording:
    """Reads all of a recording (FILE.mcap), or of any other source that ends, as arrays.

    Features and events are computed again from the frames, with the recording's own configuration unless `config` gives
    another. They are those of the recorded run, and what `wstac run FILE.mcap` prints. Without `frames` the pixels are
    left out; with them they are all in memory. With `path_samples`, events have the samples that models of the path
    take (`Event.path_sample`). `sensor` is the name of one sensor of a recording of several. Raises `Error` if it
    cannot be read to its end: `wstac recover` repairs a recording.

    >>> import numpy, pathlib, tempfile, wstac
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "slide.y4m"
    >>> scene = wstac.simulate("Saw3@150,90deg", size=(400, 400))
    >>> frames = b"".join(b"FRAME\\n" + frame.tobytes() for frame in scene.frames)
    >>> _ = file.write_bytes(b"YUV4MPEG2 W400 H400 F30:1 Cmono\\n" + frames)
    >>> recording = wstac.read(file, config={"sensor": {"readout_ms": 0}})    # a Y4M file does not state it
    >>> numpy.array_equal(recording.features, scene.features), recording.events[0].speed == scene.events[0].speed
    (True, True)
    """
    name = os.fsdecode(source)
    if _wstac.is_camera(name):
        raise Error(f"{name}: a camera has no end, expected a file; wstac.open gives its events as they come")
    options = source_options(
        config, models, model, fps=fps, matrix=matrix, range=range, path_samples=path_samples, sensor=sensor
    )
    return _recording(_wstac.open_source(name, options, True), frames, [])


def simulate(
    scene: Union[Path, Mapping[str, Any]],
    *,
    config: Configuration = None,
    models: Models = (),
    model: Optional[Models] = None,
    fps: Optional[Fps] = None,
    format: Optional[str] = None,
    size: Optional[tuple[int, int]] = None,
    frames: bool = True,
    path_samples: bool = False,
) -> Recording:
    """Simulates a scene: frames, features, events, and the truth about them.

    `scene` is "Saw3@150", optionally with ",90deg" and ",seed=7"; or a path, FILE.toml; or the keys and tables of a
    scene (`wstac scene --help` lists them). The same scene gives the same bytes on every machine. Without `frames`
    pixels are made and left out. With `path_samples`, events have the samples that models of the path take. The key
    fidelity = "taxel" makes no pixels, which is much faster.

    >>> import wstac
    >>> scene = wstac.simulate({"specimen": "Tri3", "speed": 120, "fidelity": "taxel", "sensor": {"size": [640, 480]}})
    >>> scene.truth[0].speed, scene.events[0].speed.mm_s, scene.frames is None
    (120.0, 120.0, True)
    """
    options = source_options(config, models, model, fps=fps, format=format, size=size, path_samples=path_samples)
    if isinstance(scene, Mapping):
        for name, value in (("fps", fps), ("format", format), ("size", size)):
            if value is not None:
                raise Error(f'scene: {name} is {value!r}; write it into the scene\'s table "sensor"')
        native, truth = _wstac.open_scene(as_json("scene", scene), True, options)
    else:
        native, truth = _wstac.open_scene(os.fsdecode(scene).removeprefix("scene:"), False, options)
    return _recording(native, frames, [Truth(*one) for one in truth])


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
        notes=native.notes,
        frames=None if raw is None else _frames.pictures(raw, code, (width, height), bytes_per_row),
        frame_numbers=all_of_it["frame_numbers"],
        timestamps=all_of_it["timestamps"],
        taxels=all_of_it["taxels"],
        features=all_of_it["features"],
        feature_frames=all_of_it["feature_frames"],
        events=records.events,
        early_textures=records.early_textures,
        incomplete=records.incomplete,
        contact_ends=records.contact_ends,
        slips=records.slips,
        faults=records.faults,
        lost=records.lost,
        end=records.end,
        truth=truth,
    )
