#!/usr/bin/env python3
"""Turns a Y4M file into the JSON Lines that `wstac run FILE --features --samples --json` should print.

`-` reads standard input. Texture is always null, because this reference has no model. If an answer is null, the event's
`why` object has the reason, by the name of the answer.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from typing import Any, BinaryIO

from wstac_reference import settings as settings_of
from wstac_reference import y4m
from wstac_reference.constants import SAMPLE_FRAMES, UNIT
from wstac_reference.green import GreenSums, YCbCr
from wstac_reference.pipeline import Event, FeatureFrame, Pipeline


def event_line(event: Event, with_sample: bool) -> dict[str, Any]:
    """Returns an event as its JSON object."""
    sample, speed, direction = event.sample, event.speed, event.direction
    why = {"texture": "no_model"}
    if speed.mm_s is None:
        why["speed"] = speed.why or ""
    if direction.deg is None:
        why["direction"] = "unclear"
    line: dict[str, Any] = {
        "kind": "event",
        "frame": sample.frame,
        "frames": SAMPLE_FRAMES,
        "duration_frames": speed.duration,
        "speed": None if speed.mm_s is None else {"mm_s": speed.mm_s, "extrapolated": speed.extrapolated},
        "direction": {"deg": direction.deg, "confidence": direction.confidence},
        "texture": None,
        "frames_filled": sample.frames_filled,
        "reliable": sample.reliable,
        "why": why,
    }
    if speed.bound_mm_s is not None:
        line["bound_mm_s"] = speed.bound_mm_s
    if with_sample:
        line["sample"] = [[q / UNIT for q in feature] for feature in zip(*sample.features, strict=True)]
    return line


def end_line(line: Pipeline) -> dict[str, Any]:
    """Returns the end of the stream as its JSON object. `frames` are feature frames."""
    baseline, still_open = line.trigger.baseline, line.incomplete
    return {
        "kind": "end",
        "frames": line.trigger.frames,
        "dropped": line.dropped,
        "baseline": "incomplete" if baseline is None else "complete",
        "quiet": None if baseline is None else baseline.quiet,
        "incomplete": None if still_open is None else asdict(still_open),
    }


def run(stream: BinaryIO, arguments: argparse.Namespace) -> None:
    """Prints the lines of one stream."""
    settings = settings_of.from_arguments(arguments)
    header = y4m.read_header(stream)
    fps = arguments.fps or header.fps
    if fps is None:
        raise ValueError("the file states no frame rate; give --fps")
    ycbcr = YCbCr(
        arguments.matrix or "bt601",
        arguments.range or ("full" if header.full_range else "limited"),
        settings.get("green", "yuv", "exact"),
    )
    layout = settings.layout(header.width, header.height)
    stride = settings.get("green", "stride", 1)
    bytes_per_line = header.format.min_bytes_per_line(header.width)
    green = GreenSums(header.format, header.width, header.height, bytes_per_line, layout, stride, ycbcr)
    line = Pipeline.of(
        green,
        fps,
        floor_levels=settings.get("features", "floor_levels", 0.5),
        trigger_config=settings.trigger,
        speed_config=settings.speed,
    )

    def show(items: list[FeatureFrame | Event]) -> None:
        for item in items:
            if isinstance(item, Event):
                emit(event_line(item, not arguments.no_samples))
            elif not arguments.no_features:
                emit({"kind": "features", "frame": item.frame, "f": [q / UNIT for q in item.features]})

    for frame in y4m.read_frames(stream, header):
        show(line.push(green.sums(frame)))
    show(line.finish())
    emit(end_line(line))


def emit(value: dict[str, Any]) -> None:
    """Prints one JSON line."""
    print(json.dumps(value, separators=(",", ":")))


def main() -> int:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description="events of a Y4M file, computed by the reference")
    parser.add_argument("file", help="a Y4M file, or - for standard input")
    parser.add_argument("--fps", type=settings_of.parse_fps, help="frame rate; overrides the file's")
    parser.add_argument("--no-features", action="store_true", help="leave the features lines out")
    parser.add_argument("--no-samples", action="store_true", help="leave the samples out of events")
    settings_of.add_options(parser)
    arguments = parser.parse_args()
    try:
        if arguments.file == "-":
            run(sys.stdin.buffer, arguments)
        else:
            with open(arguments.file, "rb") as stream:
                run(stream, arguments)
    except (ValueError, OSError) as error:
        print(f"oracle: {arguments.file}: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
