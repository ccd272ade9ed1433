"""Events and their answers, as dataclasses with the names of `wstac run --json`.

The extension makes them from the lines of JSON.
"""

from __future__ import annotations

import json
from dataclasses import MISSING, asdict, dataclass, field, fields
from datetime import datetime
from typing import Any, ClassVar, Optional, Union

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Speed:
    """A sliding speed.

    >>> import wstac
    >>> [event] = wstac.open("scene:Saw3@150,90deg")
    >>> event.speed
    Speed(mm_s=150.1, sd=1.302, extrapolated=None)
    """

    mm_s: float
    """The speed in mm/s: one decimal, or four significant digits if that is finer."""
    sd: Optional[float] = None
    """Its standard deviation in mm/s; None by a law of durations, and for an upper bound."""
    extrapolated: Optional[bool] = None
    """Whether the speed is outside the range that the law of durations was fitted on; None by arrival times."""


@dataclass(frozen=True)
class Measured:
    """A length in mm.

    >>> import pathlib, tempfile, wstac
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "ball.toml"
    >>> _ = file.write_text('shape = "ball"\\ndiameter = 15\\nspeed = 100\\ndirection = 30')
    >>> [event] = wstac.open(f"scene:{file}")
    >>> event.width_mm  # of the patch that touches
    Measured(value=11.9, sd=0.52)
    """

    value: float
    """The length, with two decimals."""
    sd: float
    """Its standard deviation."""


@dataclass(frozen=True)
class Acceleration:
    """A mean acceleration while an edge passes the sensor.

    >>> import wstac
    >>> [event] = wstac.open("scene:Saw3@150,90deg")
    >>> event.acceleration
    Acceleration(mm_s2=-37.2, sd=51.44)
    """

    mm_s2: float
    """Acceleration in mm/s², below 0 if the touch slows down."""
    sd: float
    """Its standard deviation."""


@dataclass(frozen=True)
class Direction:
    """A sliding direction.

    >>> import wstac
    >>> [event] = wstac.open("scene:Saw3@150,90deg")
    >>> event.direction
    Direction(deg=89.99, sd=0.05, confidence=None)
    """

    deg: Optional[float]
    """The angle in degrees, counterclockwise, 0 is to the right along the sensor's rows: 0 to below 360, two decimals.

    By a law of durations it is 0, 90, 180 or 270, or None if it is unclear.
    """
    sd: Optional[float] = None
    """Its standard deviation in degrees; None by a law of durations."""
    confidence: Optional[float] = None
    """0 to 1 by a law of durations; None by arrival times."""


@dataclass(frozen=True)
class Texture:
    """The answer of texture models; None for what no model answers.

    >>> import wstac
    >>> [event] = wstac.open("scene:Saw3@150,90deg", models="builtin")
    >>> event.texture.specimen, event.texture.pattern, event.texture.depth_mm, event.texture.known
    ('Saw3', 'Saw', 3.0, True)
    """

    specimen: Optional[str] = None
    """Such as "Saw3"."""
    pattern: Optional[str] = None
    """"Fla", "Sin", "Saw" or "Tri"."""
    depth_mm: Optional[float] = None
    """Depth of the pattern in mm."""
    # "class" is a keyword of Python.
    class_: Optional[str] = None
    """The class of a model that tells something else apart."""
    confidence: Optional[float] = None
    """Probability that the names are right, 0 to below 1; None if a model has no calibration."""
    known: Optional[bool] = None
    """Whether the touch is like those of the training; if it is False there are no names. None if no model tells."""


@dataclass(frozen=True)
class Event:
    """A tactile event: a sample around a contact, and its answers.

    >>> import wstac
    >>> [event] = wstac.open("scene:Saw3@150,90deg")
    >>> event.contact, event.speed.mm_s, event.direction.deg, event.reliable
    ('slide', 150.1, 89.99, True)
    >>> event.frame, event.touch_frame, event.time_s, event.sample.shape
    (35, 46, 1.5333, (10, 70))
    >>> event.record["kind"], event.record["speed"]
    ('event', {'mm_s': 150.1, 'sd': 1.302})
    """

    frame: int
    """Number of the sample's first feature frame, counted from 0."""
    frames: int
    """Frames of the sample: 70."""
    time_ns: int
    """Time of `touch_frame`, or by a law of durations of `frame`, in nanoseconds by the clock of the end record."""
    completed_ns: int
    """Time of the frame with which the answer was complete, in nanoseconds by the same clock."""
    touch_frame: Optional[int]
    """Number of the first lit frame of the touch; None by a law of durations."""
    end_frame: Optional[int]
    """Number of the first dark frame behind the touch; None if the light has not left, or by a law of durations."""
    time_s: Optional[float]
    """Time of `touch_frame` in seconds from the first frame; None by a law of durations."""
    completed_s: Optional[float]
    """Time of the frame with which the answer was complete, in seconds from the first frame; None by a law of
    durations."""
    stamp: Optional[datetime]
    """Wall-clock time of `time_ns`, with the time zone UTC; None where the source knows none."""
    stamp_within_ms: Optional[float]
    """The most by which the stamp may be wrong, in ms; None without a stamp."""
    contact: Optional[str]
    """Kind of the touch: "slide", "press", "poke" or "unclear"; None by a law of durations, which takes all for
    slides."""
    duration_frames: Optional[int]
    """Lit frames from the first to the last, less one; None if no frame is lit, or if the sample does not show the
    touch's begin and end."""
    speed: Optional[Speed]
    """Sliding speed; None if there is none, and `why["speed"]` gives the reason."""
    speed_at_most: Optional[Speed]
    """Upper bound of the speed of an event that is cut off, by a law of durations."""
    direction: Optional[Direction]
    """Sliding direction; None if arrival times give none, and `why["direction"]` gives the reason."""
    basis: Optional[str]
    """What speed and direction are known by: "edge" (only the motion across an edge that covers the sensor is known) or
    "outline" (an object narrower than the sensor, or a corner); None unless 25 taxels were asked."""
    place_mm: Optional[Measured]
    """Middle of the touch to the left of its motion, from the sensor's middle; None if it is unknown."""
    width_mm: Optional[Measured]
    """Width of the touch across its motion; None if it is unknown."""
    contacts: Optional[int]
    """Objects side by side, as far as 25 taxels tell them apart; None if they do not tell the velocity."""
    acceleration: Optional[Acceleration]
    """Mean acceleration while an edge passes the sensor; None if it is unknown."""
    texture: Optional[Texture]
    """Texture; None without a model, and for a touch that is no slide."""
    period_mm: Optional[Measured]
    """Period of the texture along the motion; None if it is unknown."""
    frames_filled: int
    """Frames of the sample that were filled."""
    reliable: bool
    """The baseline was quiet, and at most 7 frames were filled.

    By arrival times also: speed and direction mostly hold within their standard deviations, and the kind of the
    touch is clear.
    """
    why: dict[str, str]
    """Reasons of missing answers, by answer: "speed", "direction", "texture"; and "reliable", if the answers are not.

    "texture" is also there for a texture that is unknown because of its speed, as far as the model says which it knows.
    """
    sample: NDArray[np.int16] = field(repr=False, compare=False)
    """The sample over time: int16 (10, 70), five rows and five columns over 70 frames, in units of 1/2048 of a natural
    logarithm.

    It is a row of the array X of a data set, for models whose `input` is "frames". With `at_once` it has no frames.
    """
    path_sample: Optional[NDArray[np.int16]] = field(default=None, repr=False, compare=False)
    """The sample along the path, of ten sums: int16 (10, 70), a row of the array X_path, for models whose `input` is
    "path".

    It is zero if there is no velocity, or if the sample shows too little of the path. It is None without the argument
    `path_samples` of what gave the event.
    """
    taxel_path_sample: Optional[NDArray[np.int16]] = field(default=None, repr=False, compare=False)
    """The same of 25 taxels, a row of X_taxel_path, for models whose `input` is "taxel-path". A lost frame makes it
    zero."""
    taxels_sample: Optional[NDArray[np.int16]] = field(default=None, repr=False, compare=False)
    """Light of 25 taxels over time: int16 (25, 70), a row of X_taxels, for models whose `input` is "taxels"."""

    def to_dict(self) -> dict[str, Any]:
        """Returns the answers as one flat row, such as `pandas.DataFrame` takes: numbers, names and times, None where
        one is missing.

        Units are in the names, and the reasons of missing answers are `why_speed`, `why_direction` and `why_texture`.
        `why_reliable` is that of answers that are not reliable. The samples are left out.

        >>> import wstac
        >>> [event] = wstac.open("scene:Saw3@150,90deg")
        >>> row = event.to_dict()
        >>> row["contact"], row["speed_mm_s"], row["direction_deg"], row["specimen"], row["why_texture"]
        ('slide', 150.1, 89.99, None, 'no model was given')
        """
        texture = self.texture or Texture()
        return {
            "frame": self.frame,
            "touch_frame": self.touch_frame,
            "end_frame": self.end_frame,
            "time_s": self.time_s,
            "completed_s": self.completed_s,
            "time_ns": self.time_ns,
            "completed_ns": self.completed_ns,
            "stamp": self.stamp,
            "stamp_within_ms": self.stamp_within_ms,
            "contact": self.contact,
            "duration_frames": self.duration_frames,
            "speed_mm_s": self.speed and self.speed.mm_s,
            "speed_sd_mm_s": self.speed and self.speed.sd,
            "speed_extrapolated": self.speed and self.speed.extrapolated,
            "speed_at_most_mm_s": self.speed_at_most and self.speed_at_most.mm_s,
            "direction_deg": self.direction and self.direction.deg,
            "direction_sd_deg": self.direction and self.direction.sd,
            "direction_confidence": self.direction and self.direction.confidence,
            "basis": self.basis,
            **_lengths("place", self.place_mm),
            **_lengths("width", self.width_mm),
            "contacts": self.contacts,
            "acceleration_mm_s2": self.acceleration and self.acceleration.mm_s2,
            "acceleration_sd_mm_s2": self.acceleration and self.acceleration.sd,
            **{
                name.rstrip("_"): value
                for name, value in asdict(texture).items()
                if name not in ("confidence", "known")
            },
            "texture_confidence": texture.confidence,
            "texture_known": texture.known,
            **_lengths("period", self.period_mm),
            "frames_filled": self.frames_filled,
            "reliable": self.reliable,
            **{f"why_{answer}": self.why.get(answer) for answer in ("speed", "direction", "texture", "reliable")},
        }

    @property
    def record(self) -> dict[str, Any]:
        """The object that `wstac run --json` prints, without the sample."""
        found: dict[str, Any] = {"kind": "event", **asdict(self)}
        for name in ("sample", "path_sample", "taxel_path_sample", "taxels_sample"):
            del found[name]
        if self.contact is None:
            for name in ("touch_frame", "end_frame", "time_s", "completed_s", "stamp", "stamp_within_ms", "contact"):
                del found[name]
        elif self.stamp is None:
            del found["stamp_within_ms"]
        else:
            found["stamp"] = _in_utc(self.stamp)
        for name in ("speed_at_most", "basis", "place_mm", "width_mm", "contacts", "acceleration", "period_mm"):
            if found[name] is None:
                del found[name]
        for answer in ("speed", "speed_at_most", "direction"):
            _leave_out(found.get(answer), "sd", "extrapolated", "confidence")
        if not self.why:
            del found["why"]
        if self.texture is not None:
            other = found["texture"].pop("class_")
            if other is not None:
                found["texture"]["class"] = other
        return found


def _lengths(name: str, length: Optional[Measured]) -> dict[str, Any]:
    """Returns a length as columns of a row."""
    return {f"{name}_mm": length and length.value, f"{name}_sd_mm": length and length.sd}


def _leave_out(answer: Optional[dict[str, Any]], *names: str) -> None:
    """Removes those of the names that have no value: a law has either."""
    for name in names:
        if answer is not None and answer.get(name) is None:
            answer.pop(name, None)


def _in_utc(stamp: datetime) -> str:
    """Returns a wall-clock time as RFC 3339 has it, with milliseconds."""
    return stamp.isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _stamped(found: dict[str, Any]) -> dict[str, Any]:
    """Returns a record whose wall-clock time is text, or missing if there is none."""
    if found["stamp"] is None:
        del found["stamp"], found["stamp_within_ms"]
    else:
        found["stamp"] = _in_utc(found["stamp"])
    return found


@dataclass(frozen=True)
class _Row:
    """Base of records whose fields are those of JSON."""

    _kind: ClassVar[str]

    def to_dict(self) -> dict[str, Any]:
        """Returns it as one flat row, such as `pandas.DataFrame` takes."""
        return asdict(self)

    @property
    def record(self) -> dict[str, Any]:
        """The object that `wstac run --json` prints."""
        return _stamped({"kind": self._kind, **asdict(self)})


@dataclass(frozen=True)
class ContactEnd(_Row):
    """The end of the touch of an event: its light has left, and no more can follow. A law of durations gives none.

    >>> import wstac
    >>> [end] = wstac.simulate("Saw3@150,90deg", frames=False).contact_ends
    >>> end, end.to_dict()["frame"], end.record["kind"]
    (ContactEnd(frame=74, event_frame=35, time_s=2.4667), 74, 'contact_end')
    """

    _kind = "contact_end"
    frame: int
    """Number of the first dark frame behind the touch."""
    event_frame: int
    """Number of the first frame of the event's sample: its `frame`."""
    time_s: Optional[float]
    """Time of that dark frame in seconds from the first frame."""
    time_ns: Optional[int] = field(default=None, repr=False)
    """Time of that dark frame in nanoseconds, by the clock of the end record; None if it is not known."""
    stamp: Optional[datetime] = field(default=None, repr=False)
    """Wall-clock time of that frame, with the time zone UTC; None where the source knows none."""
    stamp_within_ms: Optional[float] = field(default=None, repr=False)
    """The most by which the stamp may be wrong, in ms."""


@dataclass(frozen=True)
class Slip(_Row):
    """A held part begins to slip. Only the estimator `wave` gives it.

    >>> import wstac
    >>> held = {"kind": "slide", "specimen": "Sin2", "hold": 1, "speed": 60}
    >>> scene = wstac.simulate({"touch": [held], "fidelity": "taxel"}, frames=False)
    >>> [slip.onset_frame for slip in scene.slips]
    [75]
    >>> slip = wstac.Slip(frame=131, onset_frame=129, held_since_frame=96, strength=0.4)
    >>> slip.to_dict()["onset_frame"], slip.record["kind"]
    (129, 'slip')
    """

    _kind = "slip"
    frame: int
    """Number of the frame that shows the slip."""
    onset_frame: int
    """Number of the first frame with light of the motion."""
    held_since_frame: int
    """Number of the first frame with light of the press, or, after a slip, of the frame in which its rest was known."""
    strength: float
    """Most light of a frame since the onset, as a fraction of the press's brightest frame."""
    time_ns: Optional[int] = field(default=None, repr=False)
    """Time of the frame in nanoseconds, by the clock of the end record; None if it is not known."""
    stamp: Optional[datetime] = field(default=None, repr=False)
    """Wall-clock time of that frame, with the time zone UTC; None where the source knows none."""
    stamp_within_ms: Optional[float] = field(default=None, repr=False)
    """The most by which the stamp may be wrong, in ms."""


@dataclass(frozen=True)
class Motion:
    """Speed and direction in the newest frame, while something slides.

    >>> import wstac
    >>> stream = wstac.open("scene:Saw3@150,90deg", motion=True)
    >>> motions = [record for record in stream.records() if isinstance(record, wstac.Motion)]
    >>> motions[-1].frame, motions[-1].speed.mm_s, motions[-1].direction.deg
    (71, 150.1, 89.99)
    >>> motions == stream.motions, motions[-1].to_dict()["speed_mm_s"], motions[-1].record["kind"]
    (True, 150.1, 'motion')
    """

    frame: int
    """Number of the feature frame."""
    time_s: Optional[float]
    """Its time in seconds from the first frame."""
    speed: Speed
    """Sliding speed."""
    direction: Direction
    """Sliding direction."""
    time_ns: Optional[int] = field(default=None, repr=False)
    """Time of the frame in nanoseconds, by the clock of the end record; None if it is not known."""
    stamp: Optional[datetime] = field(default=None, repr=False)
    """Wall-clock time of that frame, with the time zone UTC; None where the source knows none."""
    stamp_within_ms: Optional[float] = field(default=None, repr=False)
    """The most by which the stamp may be wrong, in ms."""
    basis: Optional[str] = field(default=None, repr=False)
    """What both are known by, `edge` or `outline`; None unless 25 taxels tell them."""

    def to_dict(self) -> dict[str, Any]:
        """Returns it as one flat row, such as `pandas.DataFrame` takes; units are in the names."""
        return {
            "frame": self.frame,
            "time_s": self.time_s,
            "time_ns": self.time_ns,
            "stamp": self.stamp,
            "stamp_within_ms": self.stamp_within_ms,
            "speed_mm_s": self.speed.mm_s,
            "speed_sd_mm_s": self.speed.sd,
            "direction_deg": self.direction.deg,
            "direction_sd_deg": self.direction.sd,
            "basis": self.basis,
        }

    @property
    def record(self) -> dict[str, Any]:
        """The object that `wstac run --json --motion` prints."""
        found = _stamped({"kind": "motion", "contact": "slide", **asdict(self)})
        for answer in ("speed", "direction"):
            _leave_out(found[answer], "sd", "extrapolated", "confidence")
        _leave_out(found, "basis")
        return found


@dataclass(frozen=True)
class EarlyTexture:
    """The answer of a model that needs fewer than 70 frames, before the event is complete.

    The models that come with wstac need all frames, so this one is made by hand:

    >>> import wstac
    >>> texture = wstac.Texture(specimen="Saw3", pattern="Saw", depth_mm=3)
    >>> early = wstac.EarlyTexture(frame=35, frames=40, texture=texture)
    >>> f"frames {early.frame} to {early.frame + early.frames - 1}: {early.texture.specimen}"
    'frames 35 to 74: Saw3'
    """

    frame: int
    """Number of the first frame of the event to come."""
    frames: int
    """Frames of the sample that the model reads."""
    texture: Texture
    """The texture; the event will have the same."""
    time_ns: Optional[int] = field(default=None, repr=False)
    """Time of the sample's first frame in nanoseconds, by the clock of the end record; None if it is not known."""
    stamp: Optional[datetime] = field(default=None, repr=False)
    """Wall-clock time of that frame, with the time zone UTC; None where the source knows none."""
    stamp_within_ms: Optional[float] = field(default=None, repr=False)
    """The most by which the stamp may be wrong, in ms."""


@dataclass(frozen=True)
class Incomplete:
    """A sample that a gap of lost frames, or the end, interrupted.

    >>> import wstac
    >>> scene = wstac.simulate("Saw3@150,90deg", size=(400, 400))
    >>> pipeline = wstac.Pipeline(fps=30)
    >>> for frame in scene.frames[:80]:
    ...     event = pipeline.push(frame)
    >>> _ = pipeline.finish()
    >>> pipeline.end.incomplete
    Incomplete(frame=35, frames=45)
    """

    frame: int
    """Number of its first frame."""
    frames: int
    """Frames of it that had arrived."""
    time_ns: Optional[int] = field(default=None, repr=False)
    """Time of its first frame in nanoseconds, by the clock of the end record; None if it is not known."""
    stamp: Optional[datetime] = field(default=None, repr=False)
    """Wall-clock time of that frame, with the time zone UTC; None where the source knows none."""
    stamp_within_ms: Optional[float] = field(default=None, repr=False)
    """The most by which the stamp may be wrong, in ms."""


@dataclass(frozen=True)
class Fault:
    """A fault of a source that goes on.

    `faults` of a stream or a timed pipeline has them. A simulated sensor has none, so this one is made by hand:

    >>> import wstac
    >>> fault = wstac.Fault(frame=120, fault="disconnected", message="no frame for 2 s; check the cable")
    >>> f"before frame {fault.frame}: {fault.fault}: {fault.message}"
    'before frame 120: disconnected: no frame for 2 s; check the cable'
    """

    frame: int
    """Number of the feature frame that came next."""
    fault: str
    """Its kind in a word, such as "disconnected"."""
    message: str
    """What happened, for a person."""
    time_ns: Optional[int] = field(default=None, repr=False)
    """Time of that frame, by the frame before it and the frame rate, in nanoseconds, by the clock of the end record;
    None if it is not known."""
    stamp: Optional[datetime] = field(default=None, repr=False)
    """Wall-clock time of that frame, with the time zone UTC; None where the source knows none."""
    stamp_within_ms: Optional[float] = field(default=None, repr=False)
    """The most by which the stamp may be wrong, in ms."""


@dataclass(frozen=True)
class Lost:
    """Camera frames that were lost.

    >>> import numpy, wstac
    >>> pipeline = wstac.Pipeline(fps=30)
    >>> _ = pipeline.push(numpy.zeros((400, 400), numpy.uint8)), pipeline.lose(3)
    >>> pipeline.lost
    [Lost(at=1, frames=3, why='reported lost')]
    """

    at: int
    """Number of the first of them among the camera's frames."""
    frames: int
    """How many were lost."""
    why: str
    """Why they were lost, for a person."""


@dataclass(frozen=True)
class End:
    """How a stream ended.

    >>> import wstac
    >>> stream = wstac.open("scene:Saw3@150,90deg")
    >>> events = list(stream)
    >>> stream.end
    End(frames=140, dropped=0, baseline='complete', incomplete=None, clock='frames')
    """

    frames: int
    """Feature frames, lost ones included."""
    dropped: int
    """Camera frames that were lost or unusable."""
    baseline: str
    """"complete", or "incomplete" if the stream was too short for it."""
    incomplete: Optional[Incomplete]
    """The sample that the end interrupted."""
    clock: str = "frames"
    """Clock of all times in nanoseconds.

    "driver" is the monotonic clock, which all cameras of a machine share (`time.monotonic_ns`); recordings keep it.
    "frames": the source states no times, so they count from 0 by number and rate of the frames.
    """
    time_ns: Optional[int] = field(default=None, repr=False)
    """Time of the last frame in nanoseconds, by the clock of the end record; None if it is not known."""
    stamp: Optional[datetime] = field(default=None, repr=False)
    """Wall-clock time of that frame, with the time zone UTC; None where the source knows none."""
    stamp_within_ms: Optional[float] = field(default=None, repr=False)
    """The most by which the stamp may be wrong, in ms."""
    dropped_by: dict[str, int] = field(default_factory=dict, repr=False, hash=False)
    """The lost frames by reason, in words such as "shorter than a frame"."""
    readout_ms: Optional[float] = field(default=None, repr=False)
    """Time in which the camera reads its rows, in ms: 0 for a global shutter, None if nothing states it."""


Record = Union[Event, Motion, EarlyTexture, Incomplete, ContactEnd, Slip, Fault, Lost, End]

_KINDS: dict[str, Any] = {
    "event": Event,
    "motion": Motion,
    "texture": EarlyTexture,
    "incomplete": Incomplete,
    "contact_end": ContactEnd,
    "slip": Slip,
    "fault": Fault,
    "end": End,
}
# The fields that are objects.
_PARTS: dict[str, Any] = {
    "speed": Speed,
    "speed_at_most": Speed,
    "direction": Direction,
    "place_mm": Measured,
    "width_mm": Measured,
    "period_mm": Measured,
    "acceleration": Acceleration,
    "texture": Texture,
    "incomplete": Incomplete,
}


def of_line(line: str, **more: Any) -> Record:
    """Returns the object of a line of JSON; `more` are fields that it has in another form."""
    found = json.loads(line)
    kind = _KINDS[found["kind"]]
    if kind is End and found["clock"] != "board":
        # A global shutter is not mentioned.
        found.setdefault("readout_ms", 0.0)
    for name, part in _PARTS.items():
        if isinstance(found.get(name), dict):
            found[name] = part(**{key if key != "class" else "class_": value for key, value in found[name].items()})
    found = {"why": {}, **found, "stamp": None, **more}
    # JSON leaves out what is optional; anything else that is missing is an error.
    absent = {of.name: None for of in fields(kind) if of.default is MISSING and str(of.type).startswith("Optional")}
    made: Record = kind(**{**absent, **{of.name: found[of.name] for of in fields(kind) if of.name in found}})
    return made


MOST = 10_000
"""How many records of a kind a stream keeps at most."""


@dataclass
class Records:
    """Records by kind."""

    events: list[Event] = field(default_factory=list)
    motions: list[Motion] = field(default_factory=list)
    early_textures: list[EarlyTexture] = field(default_factory=list)
    incomplete: list[Incomplete] = field(default_factory=list)
    contact_ends: list[ContactEnd] = field(default_factory=list)
    slips: list[Slip] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)
    lost: list[Lost] = field(default_factory=list)
    end: Optional[End] = None

    def take(self, records: list[Record]) -> list[Event]:
        """Takes records. Returns the events among them."""
        events: list[Event] = []
        kinds: dict[type, list[Any]] = {
            Event: events,
            Motion: self.motions,
            EarlyTexture: self.early_textures,
            Incomplete: self.incomplete,
            ContactEnd: self.contact_ends,
            Slip: self.slips,
            Fault: self.faults,
            Lost: self.lost,
        }
        for record in records:
            if isinstance(record, End):
                self.end = record
            else:
                kinds[type(record)].append(record)
        self.events += events
        return events

    def forget(self) -> None:
        """Forgets the events, which were returned, and all but the last of the other records: a stream may last for
        weeks.
        """
        self.events.clear()
        for records in vars(self).values():
            if isinstance(records, list):
                del records[:-MOST]


class Recorded:
    """Base of everything that yields events. It has the other records so far, the last 10 000 of a kind."""

    def __init__(self) -> None:
        self._records = Records()

    def _take(self, records: list[Record]) -> list[Event]:
        """Takes records. Returns the events among them."""
        events = self._records.take(records)
        self._records.forget()
        return events

    @property
    def motions(self) -> list[Motion]:
        """Speed and direction of the frames in which something slid, so far; the last 10 000. Only with `motion`."""
        return self._records.motions

    @property
    def early_textures(self) -> list[EarlyTexture]:
        """Answers of models that need fewer than 70 frames, so far; the last 10 000."""
        return self._records.early_textures

    @property
    def incomplete(self) -> list[Incomplete]:
        """Samples that a gap of lost frames interrupted, so far; the last 10 000."""
        return self._records.incomplete

    @property
    def contact_ends(self) -> list[ContactEnd]:
        """Ends of the touches of events, so far; the last 10 000. A law of durations gives none."""
        return self._records.contact_ends

    @property
    def slips(self) -> list[Slip]:
        """Slips of held parts, so far; the last 10 000."""
        return self._records.slips

    @property
    def lost(self) -> list[Lost]:
        """Camera frames that were lost, so far; the last 10 000."""
        return self._records.lost

    @property
    def faults(self) -> list[Fault]:
        """Faults of the source so far, such as frames that come unevenly; the last 10 000."""
        return self._records.faults

    @property
    def end(self) -> Optional[End]:
        """How the stream ended; None before its end."""
        return self._records.end
