"""Fits the published speed law to a sensor's own slides."""

from __future__ import annotations

import math
import os
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _plots
from ._errors import NotFoundError
from ._models import Path
from ._wstac import Error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DURATIONS = (67, 1)
"""Longest and shortest duration of an event that is not cut off and not a single frame, in frames of its sample."""
RATE_OFF = 0.01
"""Fraction by which frame rates may differ and still count as equal: 30 and 30000/1001 do."""

DataSet = Union[Path, Mapping[str, ArrayLike]]


@dataclass(frozen=True, eq=False)
class SpeedFit:
    """The law D = intercept − slope · log10 v, fitted to slides by least squares in D.

    D is the number of lit frames at 30 frames per second, and v the speed in mm/s.

    >>> import wstac
    >>> slides = {"speed": [100, 150, 200, 250], "duration": [38.5, 28.6, 21.5, 16.1]}
    >>> fit = wstac.fit_speed(slides)
    >>> round(float(fit.duration(150))), round(float(fit.speed(28.6)))
    (29, 150)
    >>> print(fit.toml().splitlines()[:2])
    ['[speed]', 'law = "published"']
    >>> fit.plot().get_xlabel()
    'speed (mm/s)'
    """

    intercept: float
    slope: float
    intercept_error: float
    """Standard error of the intercept."""
    slope_error: float
    """Standard error of the slope."""
    r2: float
    deviation_frames: float
    """By how much the durations deviate from the law: the residual standard deviation in frames."""
    speed_error: float
    """By how much the speeds that the law gives for the durations are off: the root mean square of fractions."""
    range_mm_s: tuple[float, float]
    """The slowest and the fastest slide. `wstac run` marks speeds outside this range as extrapolated."""
    answers_mm_s: tuple[float, float]
    """The speeds that the law can answer: slower slides are cut off by the sample of 70 frames."""
    speeds: int
    """The number of different speeds."""
    left_out: dict[str, int]
    """Slides that were left out, by the reason: `no_speed`, `no_duration`, `unreliable`."""
    speed_mm_s: NDArray[np.float64]
    """The speed of each slide that was used."""
    frames: NDArray[np.float64]
    """The duration of each slide that was used, at 30 frames per second."""

    def duration(self, mm_s: ArrayLike) -> NDArray[np.float64]:
        """Returns the law's duration for speeds, in frames at 30 per second."""
        return np.asarray(self.intercept - self.slope * np.log10(mm_s), float)

    def speed(self, frames: ArrayLike) -> NDArray[np.float64]:
        """Returns the law's speed for durations at 30 frames per second, in mm/s."""
        return np.asarray(10 ** ((self.intercept - np.asarray(frames, float)) / self.slope), float)

    def toml(self, *, threshold: Optional[float] = None, threshold_on: Optional[str] = None) -> str:
        """Returns the table [speed] of a configuration with this law, for `wstac run --config`.

        Durations depend on the threshold: if the data set was made with another one than the default, give its
        `threshold` and `threshold_on`, so that both are in the table.
        """
        # The command works with 32 bits. The range is rounded outwards, so that it holds the speed of every slide.
        slowest, fastest = (_below(self.range_mm_s[0]), -_below(-self.range_mm_s[1]))
        law = f"intercept = {np.float32(self.intercept)!s}\nslope = {np.float32(self.slope)!s}\n"
        text = f'[speed]\nlaw = "published"\n{law}range_mm_s = [{slowest!s}, {fastest!s}]\n'
        if threshold is not None:
            text += f"threshold = {threshold}\n"
        if threshold_on is not None:
            text += f'threshold_on = "{threshold_on}"\n'
        return text

    def plot(self, ax: Optional[Axes] = None) -> Axes:
        """Draws the durations of the slides and the law. Without `ax`, a new figure is made. Needs matplotlib."""
        ax = _plots._axes(ax)
        ax.plot(self.speed_mm_s, self.frames, "o", fillstyle="none", label=_counted(len(self.frames), "slide"))
        speeds = np.geomspace(*self.range_mm_s, 200)
        law = f"D = {self.intercept:.2f} − {self.slope:.2f} log10 v, R² {self.r2:.4f}"
        ax.plot(speeds, self.duration(speeds), label=law)
        ax.set_xlabel("speed (mm/s)")
        ax.set_ylabel("frames lit, at 30 per second")
        ax.legend()
        return ax


def fit_speed(data: Union[DataSet, Sequence[DataSet]], *, fps: Optional[float] = None) -> SpeedFit:
    """Fits the published speed law to slides of known speeds. The slower a slide is, the longer it is lit.

    `data` is a file of `wstac dataset`, the arrays of `wstac.dataset`, or several of them. The arrays are `speed` in
    mm/s (NaN if it is not known), `duration` in lit frames (-1 if there is none), and optionally `reliable` and `fps`.
    `fps` is the camera's frames per second, for data sets that do not state it; 30 by default. At least three different
    speeds are needed. The law is valid for one sensor, one specimen length and one threshold.

    >>> import wstac
    >>> data = wstac.dataset({"specimens": ["Saw3"], "speeds": [100, 120, 140, 160, 180, 200], "slides": 18})
    >>> fit = wstac.fit_speed(data)
    >>> len(fit.frames), fit.range_mm_s, 50 < fit.slope < 62, fit.r2 > 0.95
    (18, (100.0, 200.0), True, True)
    >>> print(fit.toml(threshold=0.0475).splitlines()[:2])
    ['[speed]', 'law = "published"']
    >>> stream = wstac.open("scene:Saw3@150", config=wstac.Config(fit.toml()))
    >>> [abs(event.speed.mm_s - 150) < 15 for event in stream]
    [True]
    """
    sets: list[DataSet] = [data] if isinstance(data, (str, bytes, os.PathLike, Mapping)) else list(data)
    speeds, frames = [], []
    rates: list[float] = []
    left_out = {"no_speed": 0, "no_duration": 0, "unreliable": 0}
    names = ", ".join(_name(one) for one in sets) or "data"
    for one in sets:
        rate, arrays = _arrays(one, fps)
        if rates and abs(rate / rates[0] - 1) > RATE_OFF:
            raise _wrong(
                _name(one), "fps", f"{rate:g} frames per second, expected {rates[0]:g}, as the sets before have"
            )
        rates.append(rate)
        speed, duration, reliable = arrays
        has_speed, has_duration, is_reliable = ~np.isnan(speed), duration >= 0, reliable != 0
        left_out["no_speed"] += int((~has_speed).sum())
        left_out["no_duration"] += int((has_speed & ~has_duration).sum())
        left_out["unreliable"] += int((has_speed & has_duration & ~is_reliable).sum())
        used = has_speed & has_duration & is_reliable
        speeds.append(speed[used])
        frames.append(duration[used] * _nominal(rate))
    speed, duration = np.concatenate([*speeds, np.empty(0)]), np.concatenate([*frames, np.empty(0)])
    different = len(np.unique(speed))
    if different < 3:
        found = f"{_counted(len(speed), 'slide')} at {_counted(different, 'different speed')}"
        raise Error(f"{names}: {found} ({sum(left_out.values())} left out), expected at least 3 different speeds")
    return _fitted(names, speed, duration, left_out, _nominal(rates[0]))


def _fitted(
    names: str, speed: NDArray[np.float64], duration: NDArray[np.float64], left_out: dict[str, int], nominal: float
) -> SpeedFit:
    """Fits a line through durations over log10 v."""
    x = np.log10(speed)
    dx, dy = x - x.mean(), duration - duration.mean()
    if not np.any(dy):
        raise Error(f"{names}: all slides last equally long, expected durations that fall with speed")
    sxx, sxy, syy = (float(a @ b) for a, b in ((dx, dx), (dx, dy), (dy, dy)))
    slope = -sxy / sxx
    if slope <= 0:
        raise Error(f"{names}: durations do not fall with speed; check their order and the speeds")
    intercept = float(duration.mean() + slope * x.mean())
    residuals = duration - intercept + slope * x
    deviation = math.sqrt(float(residuals @ residuals) / (len(x) - 2))
    read = 10 ** ((intercept - duration) / slope)
    slowest, fastest = (float(10 ** ((intercept - frames * nominal) / slope)) for frames in DURATIONS)
    return SpeedFit(
        intercept=intercept,
        slope=slope,
        intercept_error=deviation * math.sqrt(1 / len(x) + float(x.mean()) ** 2 / sxx),
        slope_error=deviation / math.sqrt(sxx),
        r2=sxy * sxy / (sxx * syy),
        deviation_frames=deviation,
        speed_error=float(np.sqrt(np.mean((read / speed - 1) ** 2))),
        range_mm_s=(float(speed.min()), float(speed.max())),
        answers_mm_s=(slowest, fastest),
        speeds=len(np.unique(speed)),
        left_out=left_out,
        speed_mm_s=speed,
        frames=duration,
    )


def _arrays(data: DataSet, given: Optional[float]) -> tuple[float, tuple[NDArray[np.float64], ...]]:
    """Returns the frames per second of a data set, and the speed, the duration and the reliability of its slides."""
    name = _name(data)
    if isinstance(data, Mapping):
        return _checked(name, data, given)
    try:
        with np.load(data) as file:
            wanted = {array: file[array] for array in ("speed", "duration", "reliable", "fps") if array in file.files}
            others = file.files
    except FileNotFoundError:
        raise NotFoundError(f"{name}: no such file or folder") from None
    except (OSError, ValueError, EOFError, AttributeError, TypeError, zipfile.BadZipFile) as error:
        raise Error(f"{name}: cannot be read, expected a .npz file of wstac dataset") from error
    return _checked(name, {**dict.fromkeys(others, np.empty(0)), **wanted}, given)


def _checked(
    name: str, data: Mapping[str, ArrayLike], given: Optional[float]
) -> tuple[float, tuple[NDArray[np.float64], ...]]:
    speed, duration = _numbers(name, data, "speed"), _numbers(name, data, "duration")
    reliable = _numbers(name, data, "reliable") if "reliable" in data else np.ones(len(speed))
    for array, values in (("duration", duration), ("reliable", reliable)):
        if len(values) != len(speed):
            raise _wrong(name, array, f"has {_counted(len(values), 'element')}, expected {len(speed)} as speed has")
    _check(name, "speed", speed, (speed <= 0) | np.isinf(speed), "mm/s above 0, or NaN where it is not known")
    is_wrong = ~np.isfinite(duration) | ((duration < 0) & (duration != -1))
    _check(name, "duration", duration, is_wrong, "frames, or -1 where there is none")
    rate = float(_numbers(name, data, "fps", 0)) if "fps" in data else 30.0 if given is None else float(given)
    if not 0 < rate < math.inf:
        raise _wrong(name, "fps", f"{rate:g}, expected frames per second above 0")
    if given is not None and abs(given / rate - 1) > RATE_OFF:
        raise _wrong(name, "fps", f"{rate:g} frames per second, but fps is {given:g}; leave fps out")
    return rate, (speed, duration, reliable)


def _numbers(name: str, data: Mapping[str, ArrayLike], array: str, dimensions: int = 1) -> NDArray[np.float64]:
    if array not in data:
        raise _wrong(name, array, f"missing, found {', '.join(data) or 'none'}")
    values = np.asarray(data[array])
    if values.ndim != dimensions:
        expected = "one dimension" if dimensions else "no dimension"
        raise _wrong(name, array, f"shape {list(values.shape)}, expected {expected}")
    if values.dtype.kind not in "biuf":
        raise _wrong(name, array, f"type {values.dtype}, expected numbers")
    return values.astype(np.float64)


def _check(name: str, array: str, values: NDArray[np.float64], is_wrong: NDArray[np.bool_], expected: str) -> None:
    if is_wrong.any():
        at = int(np.argmax(is_wrong))
        raise _wrong(name, array, f"element {at} is {values[at]:g}, expected {expected}")


def _wrong(name: str, array: str, what: str) -> Error:
    return Error(f"{name}: array {array}: {what}")


def _name(data: DataSet) -> str:
    return "data" if isinstance(data, Mapping) else os.fsdecode(data)


def _nominal(rate: float) -> float:
    """Returns how many frames at 30 per second a frame is, in the 32 bits of the command."""
    return float(np.float32(30 / rate))


def _below(number: float) -> Any:
    """Returns the highest number of 32 bits that is not above this one."""
    near = np.float32(number)
    return np.nextafter(near, np.float32(-np.inf)) if float(near) > number else near


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" + ("" if count == 1 else "s")
