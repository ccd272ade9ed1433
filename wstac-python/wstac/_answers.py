"""Events and their answers: what a line of `wstac run --json` says, as dataclasses with the same names."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

Given = tuple[str, Optional[NDArray[np.int16]]]
"""What the extension gives: a line of `wstac run --json`, and an event's sample."""


@dataclass(frozen=True)
class Speed:
    """A sliding speed."""

    mm_s: float
    """mm/s: one decimal, or four significant digits where that is finer."""
    extrapolated: bool
    """Outside the range that the speed law was fitted on."""


@dataclass(frozen=True)
class Direction:
    """A sliding direction."""

    deg: Optional[int]
    """0, 90, 180 or 270, counter-clockwise in the picture, 0 is right; None where it is unclear."""
    confidence: float
    """0 to 1."""


@dataclass(frozen=True)
class Texture:
    """What texture models say; None where no model tells it."""

    specimen: Optional[str] = None
    """Such as "Saw3"."""
    pattern: Optional[str] = None
    """"Fla", "Sin", "Saw" or "Tri"."""
    depth_mm: Optional[float] = None
    """Depth of the pattern in mm."""
    # A keyword in Python: the record's "class".
    class_: Optional[str] = None
    """The class of a model that tells something else apart."""


@dataclass(frozen=True)
class Event:
    """A tactile event: a sample around a contact, and what it was."""

    frame: int
    """Number of the sample's first feature frame, counted from 0."""
    frames: int
    """Frames of the sample: 70."""
    duration_frames: Optional[int]
    """Lit frames, last less first; None where no frame is lit."""
    speed: Optional[Speed]
    """Sliding speed; None where there is none, and `why["speed"]` says why."""
    speed_at_most: Optional[Speed]
    """Of an event that is cut off, what the law makes of the part that was seen."""
    direction: Direction
    """Sliding direction."""
    texture: Optional[Texture]
    """What slid; None without a model."""
    frames_filled: int
    """Frames of the sample that were filled."""
    reliable: bool
    """Baseline quiet, and at most 7 frames filled."""
    why: dict[str, str]
    """Why an answer is missing, by answer: "speed", "direction", "texture"."""
    sample: NDArray[np.int16] = field(repr=False, compare=False)
    """The sample X: int16 (10, 70), five rows and five columns over 70 frames, in units of 1/2048 of a natural logarithm."""
    record: dict[str, Any] = field(repr=False, compare=False)
    """The object that `wstac run --json` prints."""


@dataclass(frozen=True)
class EarlyTexture:
    """What a model that needs fewer than 70 frames says of an event that is still under way."""

    frame: int
    """Number of the first frame of the event to come."""
    frames: int
    """Frames that were looked at."""
    texture: Texture
    """What slid; the event will say the same."""


@dataclass(frozen=True)
class Incomplete:
    """An event that a gap of lost frames, or the end, interrupted."""

    frame: int
    """Number of its first frame."""
    frames: int
    """Frames of it that had arrived."""


@dataclass(frozen=True)
class Fault:
    """Something that happened to a source, which goes on."""

    frame: int
    """Number of the feature frame that came next."""
    fault: str
    """Its kind in a word, such as "disconnected"."""
    message: str
    """What happened, for a person."""


@dataclass(frozen=True)
class Lost:
    """Camera frames that were lost."""

    at: int
    """Number of the first of them among the camera's frames."""
    frames: int
    """How many."""
    why: str
    """For a person."""


@dataclass(frozen=True)
class End:
    """How a stream ended."""

    frames: int
    """Feature frames, lost ones included."""
    dropped: int
    """Camera frames that were lost."""
    baseline: str
    """"complete", or "incomplete" where the stream was too short for it."""
    incomplete: Optional[Incomplete]
    """The event that the end interrupted."""


Record = Union[Event, EarlyTexture, Incomplete, Fault, Lost, End]


def _texture(found: Optional[dict[str, Any]]) -> Optional[Texture]:
    if found is None:
        return None
    return Texture(found["specimen"], found["pattern"], found["depth_mm"], found.get("class"))


def _speed(found: Optional[dict[str, Any]]) -> Optional[Speed]:
    return None if found is None else Speed(**found)


def record(line: str, sample: Optional[NDArray[np.int16]]) -> Record:
    """The record of a line of JSON; of an event, with its sample."""
    found = json.loads(line)
    kind = found["kind"]
    rest = {key: value for key, value in found.items() if key != "kind"}
    if kind == "event":
        assert sample is not None
        rest["speed"] = _speed(rest["speed"])
        rest["speed_at_most"] = _speed(rest.get("speed_at_most"))
        rest["direction"] = Direction(**rest["direction"])
        rest["texture"] = _texture(rest["texture"])
        rest["why"] = rest.get("why", {})
        return Event(**rest, sample=sample, record=found)
    if kind == "texture":
        texture = _texture(rest["texture"])
        assert texture is not None
        return EarlyTexture(rest["frame"], rest["frames"], texture)
    if kind == "end":
        incomplete = rest["incomplete"]
        return End(rest["frames"], rest["dropped"], rest["baseline"], incomplete and Incomplete(**incomplete))
    kinds: dict[str, Any] = {"incomplete": Incomplete, "fault": Fault, "lost": Lost}
    found_record: Record = kinds[kind](**rest)
    return found_record


MOST = 10_000
"""Most records of a kind that a stream under way keeps."""


@dataclass
class Records:
    """Records by kind, as they come."""

    events: list[Event] = field(default_factory=list)
    early_textures: list[EarlyTexture] = field(default_factory=list)
    incomplete: list[Incomplete] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)
    lost: list[Lost] = field(default_factory=list)
    end: Optional[End] = None

    def take(self, given: list[Given]) -> list[Event]:
        """Takes records; the events among them."""
        events = []
        for line, sample in given:
            one = record(line, sample)
            if isinstance(one, Event):
                events.append(one)
            elif isinstance(one, EarlyTexture):
                self.early_textures.append(one)
            elif isinstance(one, Incomplete):
                self.incomplete.append(one)
            elif isinstance(one, Fault):
                self.faults.append(one)
            elif isinstance(one, Lost):
                self.lost.append(one)
            else:
                self.end = one
        self.events += events
        return events

    def forget(self) -> None:
        """Lets go of events, which have been given, and of all but the last of the rest: a stream may last for weeks."""
        self.events.clear()
        del self.early_textures[:-MOST]
        del self.incomplete[:-MOST]
        del self.faults[:-MOST]
        del self.lost[:-MOST]


class Recorded:
    """What anything that gives events has, beside them: records so far, the last 10 000 of a kind."""

    _records: Records

    @property
    def early_textures(self) -> list[EarlyTexture]:
        """What models that need fewer than 70 frames said before the event was complete, so far; the last 10 000."""
        return self._records.early_textures

    @property
    def incomplete(self) -> list[Incomplete]:
        """Events that a gap of lost frames interrupted, so far; the last 10 000."""
        return self._records.incomplete

    @property
    def end(self) -> Optional[End]:
        """How the stream ended; None before its end."""
        return self._records.end
