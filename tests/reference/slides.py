"""Slides for training: sweeps and their samples. Needs NumPy; `made` needs the Python package (`ci/build wheel into PYTHON`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from scenes import DEFAULTS, SPECIMENS, Changes, constant


@dataclass(frozen=True)
class Sweep:
    """Slides of all ten specimens.

    The k-th slide of a specimen takes speed k mod n of n speeds in mm/s, and the directions in degrees take turns with
    every n slides. The first slide has the seed `seed`, and every further one the next. `gain` is a factor of all
    light, that of a sensor as it is mounted for one run. `unit` is the number of the sensor: each has its own gains for
    its whiskers.
    """

    seed: int
    slides: int
    speeds: Sequence[float]
    directions: Sequence[int]
    gain: float = 1.0
    unit: int = 0
    changes: Changes = DEFAULTS

    def keys(self) -> dict[str, Any]:
        """Returns the keys of a sweep, as `wstac dataset` reads them from a file."""
        scene: dict[str, Any] = {"fidelity": "taxel"}
        if self.changes.noise is not None:
            scene["noise"] = self.changes.noise
        if self.changes.length_mm is not None:
            scene["length"] = self.changes.length_mm
        light = {}
        if self.changes.afterglow_ms is not None:
            light["afterglow_ms"] = self.changes.afterglow_ms
        if self.gain != 1:
            light.update({key: self.gain * constant("light.rs", key + ": ") for key in ("flash_ms", "rubbing_ms")})
        if self.unit:
            light["unit"] = self.unit
        return {
            "specimens": list(SPECIMENS),
            "speeds": [float(speed) for speed in self.speeds],
            "directions": [int(direction) for direction in self.directions],
            "slides": self.slides,
            "seed": self.seed,
            "scene": {**scene, "light": light} if light else scene,
        }


@dataclass(frozen=True)
class Slides:
    """Samples of n slides, and their labels.

    `x` is int16 (n, 700), feature by feature, in units of 1/2048; `specimen`, `pattern` and `depth` are the three sets of
    labels, `speed` is in mm/s, `direction` in degrees, `seed` the slide's own.
    """

    x: np.ndarray
    specimen: np.ndarray
    pattern: np.ndarray
    depth: np.ndarray
    speed: np.ndarray
    direction: np.ndarray
    seed: np.ndarray

    def __len__(self) -> int:
        return len(self.x)

    def features(self) -> np.ndarray:
        """Returns natural logarithms, float64 (n, 700), which are exact also in float32."""
        return self.x * SCALE

    def of(self, rows: np.ndarray) -> Slides:
        """Returns the slides of a mask or of indices."""
        return Slides(*(getattr(self, field.name)[rows] for field in fields(self)))


SCALE = 1 / 2048
"""Natural logarithms to a unit of a feature."""

ARRAYS = {"specimen": "y_specimen", "pattern": "y_pattern", "depth": "y_depth"}
"""Names of arrays in a data set's file, where they are not those of the fields."""


def made(sweep: Sweep) -> Slides:
    """Returns the samples of a sweep, simulated by the Python package. Raises an error if a slide did not become a
    sample.
    """
    # Imported here, because everything else works without the package.
    import wstac

    arrays = wstac.dataset(sweep.keys(), threads=1)
    if float(arrays["scale"]) != SCALE:
        raise SystemExit(f"wstac.dataset: scale is {arrays['scale']}, expected {SCALE}")
    names = [field.name for field in fields(Slides)][1:]
    rest = [arrays[ARRAYS.get(name, name)] for name in names]
    slides = Slides(arrays["X"].reshape(len(arrays["X"]), -1), *rest)
    expected = sweep.slides * len(SPECIMENS)
    if len(slides) != expected:
        raise SystemExit(f"wstac.dataset made {len(slides)} samples, expected {expected}, seed {sweep.seed}")
    return slides


def together(parts: Sequence[Slides]) -> Slides:
    """Returns several sets as one. Raises an error if two slides have the same seed, because their random numbers would
    be equal.
    """
    whole = Slides(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Slides)))
    if len(np.unique(whole.seed)) != len(whole):
        raise SystemExit("two slides have the same seed, expected a seed of its own for each")
    return whole
