"""Whiskers whose overlaps a program states, such as a physics engine: light and taxel sums without a picture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _frames, _wstac
from ._models import Config, as_json, native_config

if TYPE_CHECKING:
    from ._pipeline import Pipeline


def numbers(name: str, array: Any) -> NDArray[np.float64]:
    """Returns one number for each taxel, (25,) or (5, 5), as float64 (25,)."""
    if not isinstance(array, np.ndarray):
        raise TypeError(f"{name} is a {type(array).__name__}, expected a NumPy array")
    _frames.without_mask(name, array)
    if array.shape not in ((25,), (5, 5)) or array.dtype.kind not in "iuf":
        raise _wstac.Error(f"{name}: {array.dtype} {array.shape}, expected numbers of shape (25,) or (5, 5)")
    return np.ascontiguousarray(array, np.float64).reshape(25)


class Skin:
    """The 25 whiskers of a simulated sensor, and the light of their bases as its camera sees it.

    A program says how deep each whisker is in whatever is there; the light follows by the arithmetic of `simulate`.
    What the whiskers do to the object, drag and a force that pushes it back, is not modeled. `scene` has keys of a
    scene that are not of touches: `seed`, `noise`, `whisker`, `light`, and `sensor` with a global shutter.

    >>> import numpy, wstac
    >>> skin = wstac.Skin({"seed": 3})
    >>> skin.fps, skin.length_mm, skin.whiskers[12].tolist()      # the middle one
    (30.0, 5.0, [0.0, 0.0, 0.0])
    >>> pipeline = skin.pipeline()
    >>> for step in range(5000):                     # of 1 ms; a plate comes down by 3 mm, and rises again
    ...     moment = step * 1e-3 - 2.0
    ...     overlap = numpy.full(25, min(moment, 0.5 - moment) / 0.05).clip(-1, 3) - skin.whiskers[:, 2]
    ...     light = skin.step(overlap, 0.0, 1e-3)
    ...     event = None if light is None else pipeline.push_sums(skin.sums(light))
    ...     if event:
    ...         print(event.contact)
    press
    """

    def __init__(self, scene: Optional[Mapping[str, Any]] = None) -> None:
        self._native = _wstac.Skin(as_json("skin", scene or {}))
        self._length, self._whiskers = self._native.whiskers
        self._whiskers.flags.writeable = False

    def step(
        self, overlap_mm: NDArray[Any], rubbing_mm_s: Union[float, NDArray[Any]], seconds: float
    ) -> Optional[NDArray[np.float64]]:
        """Advances by `seconds`, in which each whisker's overlap changes evenly to `overlap_mm`.

        Returns the mean light of the bases over the exposure of the frame that ends in this step, float64 (25,) in
        fractions of full scale, or None if none ends. An overlap is the length in mm by which the upright whisker is in
        what is there; a gap is below 0. `rubbing_mm_s` is the speed at which a surface moves sideways over the tips,
        for all or for each. Arrays are (25,) or (5, 5), rows from above. Steps should be about 0.5 ms long.

        Raises `Error` for numbers out of range, and for a step that is longer than a frame.
        """
        _frames.without_mask("rubbing_mm_s", rubbing_mm_s)
        is_one = np.ndim(rubbing_mm_s) == 0 and np.asarray(rubbing_mm_s).dtype.kind in "iuf"
        speeds = np.full(25, rubbing_mm_s, np.float64) if is_one else numbers("rubbing_mm_s", rubbing_mm_s)
        return self._native.step(numbers("overlap_mm", overlap_mm), speeds, seconds)

    def sums(self, light: NDArray[np.float64]) -> NDArray[np.uint32]:
        """Returns the taxel sums of the next frame with this light, with the camera's noise: uint32 (25,)."""
        return self._native.sums(numbers("light", light))

    def pipeline(self, **options: Any) -> Pipeline:
        """Returns a `Pipeline` for the sums of this camera, with a readout of 0 if `config` has none."""
        from ._pipeline import Pipeline

        config = native_config(options.pop("config", None)) or _wstac.Config()
        code, width, height, (numerator, denominator) = self._native.camera
        options["config"] = Config._of(config.with_readout(0.0))
        return Pipeline(code, size=(width, height), fps=f"{numerator}/{denominator}", **options)

    @property
    def fps(self) -> float:
        """Frames per second of the camera."""
        numerator, denominator = self._native.camera[3]
        return numerator / denominator

    @property
    def length_mm(self) -> float:
        """Length of a whisker in mm."""
        return self._length

    @property
    def whiskers(self) -> NDArray[np.float64]:
        """Each whisker's place to the right and above, and how far the dome lowers its tip: float64 (25, 3) in mm.

        A whisker that `present` leaves out has NaN.
        """
        return self._whiskers
