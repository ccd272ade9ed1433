#!/usr/bin/env python3
"""Prints sums and features of raw frames, as `v4l2-ctl --stream-to` saves them, one JSON line per frame.

Each line is {"frame": i, "sums": [25], "q": [10]}, with q in units of 1/2048. Frames are counted over all given files.
No frames are added up, whatever the camera's rate.
"""

from __future__ import annotations

import argparse
import json
import sys

from wstac_reference import settings as settings_of
from wstac_reference.features import Features, row_and_column_sums
from wstac_reference.formats import by_fourcc
from wstac_reference.green import GreenSums, YCbCr


def main() -> int:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description="sums and features of raw frames")
    parser.add_argument("files", nargs="+", help="files of consecutive frames")
    parser.add_argument("--format", required=True, help="V4L2 fourcc, e.g. YUYV or 'Y10 '")
    parser.add_argument("--width", type=int, required=True)
    parser.add_argument("--height", type=int, required=True)
    parser.add_argument("--bytes-per-line", type=int, help="default: no padding")
    parser.add_argument("--frame-bytes", type=int, help="bytes from frame to frame (sizeimage); default: no gap")
    settings_of.add_options(parser)
    arguments = parser.parse_args()
    try:
        run(arguments)
    except (ValueError, OSError) as error:
        print(f"raw_features: {error}", file=sys.stderr)
        return 1
    return 0


def run(arguments: argparse.Namespace) -> None:
    """Prints the lines of all files."""
    settings = settings_of.from_arguments(arguments)
    fmt = by_fourcc(arguments.format)
    width, height = arguments.width, arguments.height
    bytes_per_line = arguments.bytes_per_line or fmt.min_bytes_per_line(width)
    ycbcr = YCbCr(
        arguments.matrix or "bt601", arguments.range or "limited", settings.get("green", "yuv", "exact")
    )
    layout, stride = settings.layout(width, height), settings.get("green", "stride", 1)
    green = GreenSums(fmt, width, height, bytes_per_line, layout, stride, ycbcr)
    features = Features(green.full_scale, green.pixels, settings.get("features", "floor_levels", 0.5))
    step = arguments.frame_bytes or green.frame_bytes
    if step < green.frame_bytes:
        raise ValueError(f"--frame-bytes {step} is less than a frame's {green.frame_bytes}")
    number = 0
    for name in arguments.files:
        with open(name, "rb") as stream:
            while frame := stream.read(step):
                if len(frame) < green.frame_bytes:
                    raise ValueError(f"{name}: {len(frame)} bytes are left over")
                sums = green.sums(frame)
                q = features.of(row_and_column_sums(sums))
                print(json.dumps({"frame": number, "sums": sums, "q": q}, separators=(",", ":")))
                number += 1


if __name__ == "__main__":
    sys.exit(main())
