"""Turns a Y4M file into what `wstac run FILE --features --samples --json` should print, but for textures and reasons."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from wstac_reference import settings as settings_of
from wstac_reference import y4m
from wstac_reference.constants import SAMPLE_FRAMES, UNIT
from wstac_reference.green import GreenSums, YCbCr
from wstac_reference.pipeline import Event, FeatureFrame, Pipeline


def event_line(event: Event) -> dict[str, Any]:
    """Returns an event as its JSON object."""
    sample, speed, direction = event.sample, event.speed, event.direction
    return {
        "kind": "event",
        "frame": sample.frame,
        "frames": SAMPLE_FRAMES,
        "duration_frames": speed.duration,
        "speed": None if speed.mm_s is None else {"mm_s": speed.mm_s, "extrapolated": speed.extrapolated},
        "bound_mm_s": speed.bound_mm_s,
        "direction": {"deg": direction.deg, "confidence": direction.confidence},
        "frames_filled": sample.frames_filled,
        "reliable": sample.reliable,
        "sample": [[q / UNIT for q in feature] for feature in zip(*sample.features, strict=True)],
    }


def end_line(line: Pipeline) -> dict[str, Any]:
    """Returns the end of the stream as its JSON object. `frames` are feature frames."""
    still_open = line.incomplete
    return {
        "kind": "end",
        "frames": line.trigger.frames,
        "dropped": line.dropped,
        "baseline": "incomplete" if line.trigger.baseline is None else "complete",
        "incomplete": None if still_open is None else asdict(still_open),
    }


def lines(clip: Path, config: Path) -> Iterator[dict[str, Any]]:
    """Yields the objects of a clip, with a configuration of the product."""
    settings = settings_of.load(config)
    with clip.open("rb") as stream:
        header = y4m.read_header(stream)
        ycbcr = YCbCr("bt601", "full" if header.full_range else "limited", settings.get("green", "yuv", "exact"))
        layout, stride = settings.layout(header.width, header.height), settings.get("green", "stride", 1)
        bytes_per_line = header.format.min_bytes_per_line(header.width)
        green = GreenSums(header.format, header.width, header.height, bytes_per_line, layout, stride, ycbcr)
        line = Pipeline.of(
            green,
            header.fps,
            floor_levels=settings.get("features", "floor_levels", 0.5),
            trigger_config=settings.trigger,
            speed_config=settings.speed,
        )

        def objects(items: list[FeatureFrame | Event]) -> Iterator[dict[str, Any]]:
            for item in items:
                if isinstance(item, Event):
                    yield event_line(item)
                else:
                    yield {"kind": "features", "frame": item.frame, "f": [q / UNIT for q in item.features]}

        for frame in y4m.read_frames(stream, header):
            yield from objects(line.push(green.sums(frame)))
        yield from objects(line.finish())
    yield end_line(line)
