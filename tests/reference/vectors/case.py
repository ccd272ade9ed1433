"""A golden case: the input bytes, the settings, and the results of the reference."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from fractions import Fraction
from typing import Any

from wstac_reference.formats import FORMATS
from wstac_reference.green import GreenSums, YCbCr
from wstac_reference.layout import Layout, paper_layout
from wstac_reference.pipeline import Event, FeatureFrame, Pipeline
from wstac_reference.rng import mix
from wstac_reference.speed import SpeedConfig
from wstac_reference.trigger import Sample, Trigger, TriggerConfig

DIGITS = 9
TRIALS = 8


@dataclass
class Case:
    """Everything that a test needs to run one case.

    `data` are the frames that arrive, one after another. `lost` are pairs: the index of the arriving frame before which
    frames are lost, and how many. An index equal to the number of frames is a loss at the end. `long` leaves the sums
    out of the expectation, and `with_samples` puts whole samples into it.
    """

    name: str
    about: str
    format: str
    width: int
    height: int
    bytes_per_line: int
    data: list[bytes]
    fps: tuple[int, int] = (30, 1)
    ycbcr: YCbCr = field(default_factory=YCbCr)
    stride: int = 1
    layout: Layout | None = None
    floor_levels: float = 0.5
    trigger: TriggerConfig = field(default_factory=TriggerConfig)
    speed: SpeedConfig = field(default_factory=SpeedConfig)
    lost: list[tuple[int, int]] = field(default_factory=list)
    long: bool = False
    with_samples: bool = False

    def manifest(self) -> dict[str, Any]:
        """Returns the case as the manifest lists it."""
        layout: dict[str, Any] = {"preset": "paper"}
        if self.layout is not None:
            size = [self.layout.width, self.layout.height]
            layout = {"taxel": size, "corners": [list(corner) for corner in self.layout.corners]}
        return {
            "name": self.name,
            "about": self.about,
            "format": self.format,
            "width": self.width,
            "height": self.height,
            "bytes_per_line": self.bytes_per_line,
            "frame_bytes": FORMATS[self.format].frame_bytes(self.height, self.bytes_per_line),
            "fps": list(self.fps),
            "matrix": self.ycbcr.matrix,
            "range": self.ycbcr.range,
            "yuv": self.ycbcr.mode,
            "stride": self.stride,
            "layout": layout,
            "floor_levels": self.floor_levels,
            "trigger": without_default(self.trigger, "follow", "per_touch"),
            "speed": without_default(self.speed, "range_mm_s"),
            "frames": len(self.data),
            "lost": [list(loss) for loss in self.lost],
        }

    def expected(self) -> dict[str, Any]:
        """Returns the results of the reference."""
        layout = self.layout or paper_layout(self.width, self.height)
        fmt = FORMATS[self.format]
        green = GreenSums(fmt, self.width, self.height, self.bytes_per_line, layout, self.stride, self.ycbcr)
        assert all(len(frame) == green.frame_bytes for frame in self.data), self.name
        sums = [green.sums(frame) for frame in self.data]
        line = Pipeline.of(
            green,
            Fraction(*self.fps),
            floor_levels=self.floor_levels,
            trigger_config=self.trigger,
            speed_config=self.speed,
        )
        out: list[FeatureFrame | Event] = []
        losses = dict(self.lost)
        assert len(losses) == len(self.lost)
        for index, frame_sums in enumerate(sums):
            out += line.lose(losses.get(index, 0)) + line.push(frame_sums)
        out += line.lose(losses.get(len(sums), 0)) + line.finish()
        return self._describe(green, sums, line, out)

    def _describe(
        self, green: GreenSums, sums: list[list[int]], line: Pipeline, out: list[FeatureFrame | Event]
    ) -> dict[str, Any]:
        measured = [item for item in out if isinstance(item, FeatureFrame)]
        events = [item for item in out if isinstance(item, Event)]
        baseline, trigger = line.trigger.baseline, line.trigger
        expected: dict[str, Any] = {"pixels": green.pixels, "full_scale": green.full_scale, "added": line.added}
        if not self.long:
            expected["sums"] = sums
        expected["features"] = [list(frame.features) for frame in measured]
        numbers = [frame.frame for frame in measured]
        if numbers != list(range(len(numbers))):
            expected["feature_frames"] = numbers
        partial = [frame.frame for frame in measured if frame.partial]
        if partial:
            expected["partial_frames"] = partial
        if baseline is not None:
            expected["trigger"] = {
                "baseline_sum": list(baseline.totals),
                "eta": [float(eta) for eta in baseline.etas],
                "threshold_floor": [t.numerator // t.denominator for t in baseline.thresholds],
            }
        expected["events"] = [self._event(event) for event in events]
        expected["incomplete_samples"] = [asdict(sample) for sample in trigger.interrupted]
        if self.trigger.per_touch:
            expected["contact_ends"] = [asdict(end) for end in trigger.contact_ends]
        still_open = trigger.open_sample
        expected["end"] = {
            "frames": trigger.frames,
            "dropped": line.dropped,
            "baseline": "incomplete" if baseline is None else "complete",
            "quiet": None if baseline is None else baseline.quiet,
            "incomplete": None if still_open is None else asdict(still_open),
        }
        expected["robust"] = self._robust(line, out, expected)
        return expected

    def _event(self, event: Event) -> dict[str, Any]:
        speed, direction, sample = event.speed, event.direction, event.sample
        described: dict[str, Any] = {
            "frame": sample.frame,
            "frames_filled": sample.frames_filled,
            "reliable": sample.reliable,
            "duration_frames": speed.duration,
            "first_valid": speed.first_valid,
            "last_valid": speed.last_valid,
            "speed": {
                "mm_s": rounded(speed.mm_s),
                "extrapolated": speed.extrapolated,
                "why": speed.why,
                "bound_mm_s": rounded(speed.bound_mm_s),
            },
            "direction": {
                "deg": direction.deg,
                "confidence": rounded(direction.confidence),
                "row_slope": rounded(direction.row_slope),
                "column_slope": rounded(direction.column_slope),
            },
        }
        if self.trigger.per_touch:
            described["touch"] = [sample.touch_frame, sample.end_frame]
        if self.with_samples:
            described["sample"] = [list(feature) for feature in zip(*sample.features, strict=True)]
        return described

    def _robust(self, line: Pipeline, out: list[FeatureFrame | Event], expected: dict[str, Any]) -> bool:
        """Returns whether every decision of the case stays the same if features are off by one unit.

        Tries several functions from a feature to itself and its neighbors. A test of a logarithm that may be one unit
        off can rely on the decisions of a robust case. In the other cases, it feeds the listed features to the trigger.
        """
        ends = expected.get("contact_ends", [])
        wanted = [*decisions(expected["events"], expected["incomplete_samples"], expected["end"]), ends]
        measured = [item for item in out if isinstance(item, FeatureFrame)]
        for trial in range(TRIALS):
            again = Pipeline(line.full_scale, line.pixels, line.fps, self.floor_levels, self.trigger, self.speed)
            trigger = again.trigger = Trigger(self.trigger)
            samples: list[Sample | None] = []
            for frame in measured:
                samples += trigger.gap(frame.frame - trigger.frames)
                nudged = [q + mix(q * TRIALS + trial) % 3 - 1 for q in frame.features]
                samples += [trigger.frame(nudged, frame.partial)]
            samples += trigger.gap(line.trigger.frames - trigger.frames)
            events = [self._event(again._event(sample)) for sample in samples if sample is not None]
            still_open = trigger.open_sample
            end = dict(expected["end"])
            end["quiet"] = None if trigger.baseline is None else trigger.baseline.quiet
            end["incomplete"] = None if still_open is None else asdict(still_open)
            ends = [asdict(end) for end in trigger.contact_ends]
            if [*decisions(events, [asdict(sample) for sample in trigger.interrupted], end), ends] != wanted:
                return False
        return True


def without_default(settings: TriggerConfig | SpeedConfig, *keys: str) -> dict[str, Any]:
    """Returns settings as an object, without those of these keys that have their defaults."""
    values = asdict(settings)
    for key in keys:
        if values[key] == getattr(type(settings)(), key):
            del values[key]
    return values


def rounded(value: float | None) -> float | None:
    """Rounds a real number of an answer, so that differences between machines' exp do not show."""
    return None if value is None else round(value, DIGITS) + 0.0


def decisions(events: list[dict], interrupted: list[dict], end: dict) -> list[Any]:
    """Returns the yes-or-no part of an expectation."""
    whole = ("frame", "frames_filled", "reliable", "duration_frames", "first_valid", "last_valid")
    kept = [
        [event[key] for key in whole]
        + event.get("touch", [])
        + [event["speed"]["why"], event["speed"]["extrapolated"], event["direction"]["deg"]]
        for event in events
    ]
    return [kept, interrupted, end]
