"""Computes the duration of an event, and the sliding speed that it implies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from .constants import FEATURES, NOMINAL_FPS, UNIT
from .trigger import Baseline, Sample

PAPER_INTERCEPT = 151.06
PAPER_SLOPE = 56.29
FITTED_MM_S = (100.0, 200.0)
"""Speeds the published law was fitted on (*paper*)."""


@dataclass(frozen=True)
class SpeedConfig:
    """The law, and the threshold of light.

    "paper" is the earlier name of the published law, which golden cases have. `range_mm_s` are the slowest and the
    fastest speed that the law was fitted on.
    """

    law: str = "paper"
    threshold: float = 0.0475
    threshold_on: str = "absolute"
    range_mm_s: Sequence[float] = FITTED_MM_S

    def __post_init__(self) -> None:
        if self.law not in ("published", "paper"):
            raise ValueError(f"law {self.law!r}")
        if self.threshold_on not in ("absolute", "above_baseline"):
            raise ValueError(f"threshold_on {self.threshold_on!r}")
        if self.threshold <= 0:
            raise ValueError(f"threshold {self.threshold}")
        if len(self.range_mm_s) != 2 or not 0 < self.range_mm_s[0] <= self.range_mm_s[1] < math.inf:
            raise ValueError(f"range_mm_s {self.range_mm_s}")

    def speed(self, duration: float) -> float:
        """Returns the speed in mm/s for a duration in frames at 30 per second."""
        return 10 ** ((PAPER_INTERCEPT - duration) / PAPER_SLOPE)


@dataclass(frozen=True)
class SpeedAnswer:
    """Valid frames are counted from the sample's first frame.

    `why` is the reason why there is no speed: "baseline" (the baseline itself is above the threshold), "no_light" (no
    valid frame), "cut_off" (the sample's first or last frame is valid: the duration is only a lower bound, so
    `bound_mm_s` is an upper bound of the speed). They are tested in this order (*decided*).
    """

    first_valid: int | None
    last_valid: int | None
    mm_s: float | None = None
    extrapolated: bool = False
    why: str | None = None
    bound_mm_s: float | None = None

    @property
    def duration(self) -> int | None:
        """Returns D: last less first valid frame."""
        if self.first_valid is None or self.last_valid is None:
            return None
        return self.last_valid - self.first_valid


def valid_frames(config: SpeedConfig, baseline: Baseline, sample: Sample) -> list[int]:
    """Returns the frames of the sample in which any row or column is above the threshold."""
    if config.threshold_on == "absolute":
        bound = UNIT * math.log(config.threshold)
        return [t for t, f in enumerate(sample.features) if any(q > bound for q in f)]
    dark = [baseline.mean_light(k) for k in range(FEATURES)]
    return [
        t
        for t, f in enumerate(sample.features)
        if any(math.exp(f[k] / UNIT) - dark[k] > config.threshold for k in range(FEATURES))
    ]


def measure_speed(config: SpeedConfig, baseline: Baseline, sample: Sample, fps: Fraction) -> SpeedAnswer:
    """Returns the speed of one event. `fps` is the rate of feature frames."""
    valid = valid_frames(config, baseline, sample)
    first, last = (valid[0], valid[-1]) if valid else (None, None)
    if config.threshold_on == "absolute":
        bound = UNIT * math.log(config.threshold)
        if any(baseline.mean_above(k, bound) for k in range(FEATURES)):
            return SpeedAnswer(first, last, why="baseline")
    if first is None or last is None:
        return SpeedAnswer(None, None, why="no_light")
    speed = config.speed(float((last - first) * Fraction(NOMINAL_FPS) / fps))
    if first == 0 or last == len(sample.features) - 1:
        return SpeedAnswer(first, last, why="cut_off", bound_mm_s=speed)
    inside = config.range_mm_s[0] <= speed <= config.range_mm_s[1]
    return SpeedAnswer(first, last, mm_s=speed, extrapolated=not inside)
