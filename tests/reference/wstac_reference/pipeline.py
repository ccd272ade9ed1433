"""The whole pipeline from camera frames to events."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from .binning import Binner, Group, frames_added
from .direction import DirectionAnswer, measure_direction
from .features import Features, row_and_column_sums
from .green import GreenSums
from .speed import SpeedAnswer, SpeedConfig, measure_speed
from .trigger import Incomplete, Sample, Trigger, TriggerConfig


@dataclass(frozen=True)
class FeatureFrame:
    """A measured feature frame: its place on the time line and its 10 features."""

    frame: int
    features: tuple[int, ...]
    partial: bool


@dataclass(frozen=True)
class Event:
    """A sample with its answers."""

    sample: Sample
    speed: SpeedAnswer
    direction: DirectionAnswer


@dataclass
class Pipeline:
    """Takes the sums of camera frames, and losses. Returns feature frames and events in order."""

    full_scale: int
    pixels: int
    fps: Fraction
    floor_levels: float = 0.5
    trigger_config: TriggerConfig = field(default_factory=TriggerConfig)
    speed_config: SpeedConfig = field(default_factory=SpeedConfig)

    def __post_init__(self) -> None:
        self.added = frames_added(self.fps)
        self.trigger = Trigger(self.trigger_config)
        self.dropped = 0
        self._binner = Binner(self.added)
        self.features = Features(self.full_scale, self.pixels, self.floor_levels, self.added)
        self._gap = 0

    @classmethod
    def of(cls, green: GreenSums, fps: Fraction, **options) -> Pipeline:
        """Creates a pipeline that follows a given summation."""
        return cls(green.full_scale, green.pixels, fps, **options)

    def push(self, sums: Sequence[int]) -> list[FeatureFrame | Event]:
        """Takes the 25 sums of one camera frame."""
        return self._take(self._binner.frame(row_and_column_sums(sums)))

    def lose(self, count: int) -> list[FeatureFrame | Event]:
        """Counts `count` lost camera frames before the next one (or the end)."""
        self.dropped += count
        return self._take(self._binner.lose(count))

    def finish(self) -> list[FeatureFrame | Event]:
        """Ends the stream. A gap at the end is handled now."""
        return self._resolve_gap()

    @property
    def incomplete(self) -> Incomplete | None:
        """Returns the sample that is open now."""
        return self.trigger.open_sample

    def _take(self, groups: Sequence[Group]) -> list[FeatureFrame | Event]:
        out: list[FeatureFrame | Event] = []
        for group in groups:
            if group.sums is None:
                self._gap += 1
                continue
            out += self._resolve_gap()
            q = tuple(self.features.of(group.sums))
            out.append(FeatureFrame(self.trigger.frames, q, group.lost > 0))
            sample = self.trigger.frame(q, filled=group.lost > 0)
            if sample is not None:
                out.append(self._event(sample))
        return out

    def _resolve_gap(self) -> list[FeatureFrame | Event]:
        samples = self.trigger.gap(self._gap)
        self._gap = 0
        return [self._event(sample) for sample in samples]

    def _event(self, sample: Sample) -> Event:
        baseline = self.trigger.baseline
        assert baseline is not None
        speed = measure_speed(self.speed_config, baseline, sample, self.fps / self.added)
        return Event(sample, speed, measure_direction(baseline, sample))
