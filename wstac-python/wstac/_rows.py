"""The rows of an episode of `wstac.lerobot`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from ._answers import Motion, Slip
from ._arm import Arm
from ._stream import Frame, Stream
from ._wstac import Error

_AXES = range(1, 6)
_KEYS = {"state": "observation.state", "action": "action"}
# What the rows have besides the arm: type and names.
_COLUMNS: dict[str, tuple[str, Optional[list[str]]]] = {
    "observation.tactile.taxels": ("float32", [f"row{r}_column{c}" for r in _AXES for c in _AXES]),
    "observation.tactile.features": ("float32", [f"row{r}" for r in _AXES] + [f"column{c}" for c in _AXES]),
    "observation.tactile.motion": ("float32", ["x_mm_s", "y_mm_s"]),
    "observation.tactile.motion_known": ("bool", None),
    "observation.tactile.slip": ("bool", None),
    "tactile.time_s": ("float64", None),
    "tactile.lost": ("int64", None),
}


class Rows:
    """Reads an episode: an iterator over the frames that have a row."""

    def __init__(self, source: str, stream: Stream, arms: dict[str, Arm]) -> None:
        self._source, self._stream, self._arms = source, stream, arms
        self._rows: dict[str, list[Any]] = {key: [] for key in [*_COLUMNS, *(_KEYS[name] for name in arms)]}
        self.lost, self.cut = 0, 0
        self.start_ns: Optional[int] = None
        """Wall-clock time of the first row's light since 1970, in ns; None where the source knows none."""
        # What the newest feature frame says: above 45 frames per second, not every frame completes one.
        self._known: dict[str, Any] = {}
        self._first: Optional[Frame] = None
        self._last: Optional[Frame] = None

    @property
    def length(self) -> int:
        return len(self._rows["tactile.lost"])

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The columns, (n,) or (n, k)."""
        made = {key: np.array(self._rows[key], dtype) for key, (dtype, _) in _COLUMNS.items()}
        made.update({_KEYS[name]: np.array(self._rows[_KEYS[name]], np.float32) for name in self._arms})
        return made

    def features(self) -> dict[str, dict[str, Any]]:
        """Returns what the columns are, as `info.json` has it."""
        of = {**_COLUMNS, **{_KEYS[name]: ("float32", arm.names) for name, arm in self._arms.items()}}
        return {
            key: {"dtype": dtype, "shape": [len(names or [0])], "names": names} for key, (dtype, names) in of.items()
        }

    def __iter__(self) -> Iterator[Frame]:
        before, started = -1, None
        for frame in self._stream.frames(pictures=True):
            if np.isnan(frame.taxels).any():
                raise Error(f"{self._source}: a board sends no taxels, expected a recording or a scene")
            gap, before = frame.number - before - 1, frame.number
            self._first = self._first or frame
            self._last = frame
            self._follow(frame, gap)
            arm = {name: arm.at(self._time(frame, arm.clock)) for name, arm in self._arms.items()}
            if any(values is None for values in arm.values()):
                self.cut += 1
                continue
            if started is None:
                # Of a gap before the first row nothing is missing.
                started, gap = frame.timestamp, 0
                self.start_ns = None if frame.stamp is None else round(frame.stamp.timestamp() * 1e6) * 1000
            self.lost += gap
            self._add(frame, gap, frame.timestamp - started, arm)
            yield frame

    def _follow(self, frame: Frame, gap: int) -> None:
        """Keeps features and motion until the next are known, or frames are lost."""
        if frame.features is None and not gap and self._known:
            return
        motions = [record for record in frame.records if isinstance(record, Motion)]
        direction = motions[-1].direction.deg if motions else None
        velocity = (math.nan, math.nan)
        if direction is not None:
            speed, angle = motions[-1].speed.mm_s, math.radians(direction)
            velocity = (speed * math.cos(angle), speed * math.sin(angle))
        self._known = {
            "observation.tactile.features": [math.nan] * 10 if frame.features is None else frame.features / 2048,
            "observation.tactile.motion": velocity,
            "observation.tactile.motion_known": direction is not None,
        }

    def _add(self, frame: Frame, gap: int, time: float, arm: dict[str, Any]) -> None:
        row = {
            "observation.tactile.taxels": frame.taxels.reshape(25),
            **self._known,
            "observation.tactile.slip": any(isinstance(record, Slip) for record in frame.records),
            "tactile.time_s": time,
            "tactile.lost": gap,
            **{_KEYS[name]: values for name, values in arm.items()},
        }
        for key, value in row.items():
            self._rows[key].append(value)

    def _time(self, frame: Frame, clock: str) -> float:
        """Returns the time of a frame's light by the clock of an arm, in s."""
        if clock == "wall":
            if frame.stamp is None:
                message = "has no wall-clock times, which the arm needs"
                raise Error(f'{self._source}: {message}\nhelp: set clock = "driver" or "start" (wstac dataset --help)')
            return frame.stamp.timestamp()
        assert self._first is not None
        return frame.timestamp - (self._first.timestamp if clock == "start" else 0.0)

    def why_none(self) -> str:
        """Returns why there are no rows."""
        if self._first is None or self._last is None:
            return "has no frames, expected at least 1"
        spans = [
            f"{arm.file} ({arm.clock} clock) is from {arm.span}, the frames from "
            f"{self._time(self._first, arm.clock):.3f} s to {self._time(self._last, arm.clock):.3f} s"
            for arm in self._arms.values()
        ]
        return f"no frame is in the time of the arm: {'; '.join(spans)}"

    def check_end(self) -> None:
        """Refuses times of the driver that were none."""
        end = self._stream.end
        if end and end.clock != "driver" and any(arm.clock == "driver" for arm in self._arms.values()):
            raise Error(f'{self._source}: has no times of a driver, which the arm needs\nhelp: set clock = "start"')

    def notes(self) -> list[str]:
        """Returns what a person should know of the episode."""
        made = [f"{self._source}: {note}" for note in self._stream.notes]
        if self.lost:
            count = "1 frame was lost and has" if self.lost == 1 else f"{self.lost} frames were lost and have"
            made.append(f"{self._source}: {count} no row (column tactile.lost)")
        if self.cut:
            count = "1 frame" if self.cut == 1 else f"{self.cut} frames"
            has = "has" if self.cut == 1 else "have"
            made.append(f"{self._source}: {count} before and after the arm's values {has} no row")
        return made
