#!/usr/bin/env python3
"""Runs random Y4M streams through `wstac run` and through this reference: both must give the same results.

    agree.py WSTAC [COUNT | SECONDSs [SEED]]

The number of streams is COUNT, or as many as can be started within SECONDS, as in 3600s. Formats, sizes (odd ones too),
rates, configurations and pictures are drawn from a seed. Features may differ by one unit of 2^-11. Events, bounds,
durations, directions and ends must be equal.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from itertools import count, takewhile
from pathlib import Path
from typing import Any

import numpy as np

import oracle

UNIT = 1 / 2048
COLORS = ("mono", "mono10", "mono12", "mono16", "420jpeg", "420", "422", "444")
RATES = ("30:1", "25:1", "30000:1001", "45:1", "46:1", "60:1", "120:1", "15:2")


def light(rng: np.random.Generator, frames: int, width: int, height: int, full: int) -> np.ndarray:
    """Returns a slide or two in any direction, with noise; sometimes only noise."""
    y, x = np.mgrid[0:height, 0:width] / max(width, height)
    level = rng.uniform(0, 0.02) * full
    video = np.full((frames, height, width), level)
    for _ in range(rng.integers(0, 3)):
        angle = rng.choice([0, 90, 180, 270, rng.uniform(0, 360)]) * np.pi / 180
        along = x * np.cos(angle) - y * np.sin(angle)
        start, length = rng.uniform(0.1, 0.9) * frames, rng.uniform(2, 40)
        t = np.arange(frames)[:, None, None] - start
        video += rng.uniform(0.02, 0.8) * full * np.exp(-(((t / length) - along) ** 2) / 0.02)
    video += rng.normal(0, rng.uniform(0, 0.01) * full, video.shape)
    return np.clip(np.rint(video), 0, full)


def stream(rng: np.random.Generator) -> tuple[bytes, str]:
    """Returns a Y4M stream and its description."""
    color, rate = str(rng.choice(COLORS)), str(rng.choice(RATES))
    width, height = (int(side) for side in rng.integers(8, 70, 2))
    added = {"46:1": 2, "60:1": 2, "120:1": 4}.get(rate, 1)
    frames = int(rng.choice([3, 26, 96, 130, 200, 400])) * added
    bits = int(color[4:] or 8) if color.startswith("mono") else 8
    if rng.random() < 0.1:
        luma = rng.integers(0, 1 << bits, (frames, height, width))
    else:
        luma = light(rng, frames, width, height, (1 << bits) - 1)
    header = f"YUV4MPEG2 W{width} H{height} F{rate} Ip A1:1 C{color}"
    header += str(rng.choice(["", " XCOLORRANGE=FULL", " XCOLORRANGE=LIMITED", " Xanything"]))
    planes = [luma]
    if not color.startswith("mono"):
        rows = (height + 1) // 2 if color.startswith("420") else height
        columns = width if color == "444" else (width + 1) // 2
        spread = rng.choice([1, 10, 128])
        planes += [np.clip(rng.normal(128, spread, (frames, rows, columns)), 0, 255) for _ in range(2)]
    kind = np.dtype("<u2") if bits > 8 else np.dtype("u1")
    packed = [plane.astype(kind).reshape(frames, -1).view(np.uint8) for plane in planes]
    body = b"".join(b"FRAME\n" + b"".join(plane[t].tobytes() for plane in packed) for t in range(frames))
    return header.encode() + b"\n" + body, f"{color} {width}x{height} {rate} {frames} frames"


def configuration(rng: np.random.Generator) -> str:
    """Returns a configuration with some of its keys set."""
    window = int(rng.choice([1, 2, 5, 5, 5, 12]))
    rule = str(rng.choice(["signed", "signed", "literal"]))
    multiplier = rng.uniform(1, 1.5) if rule == "signed" else rng.uniform(0.5, 1)
    lines = [f'[green]\nyuv = "{rng.choice(["exact", "linear"])}"\nstride = {rng.choice([1, 1, 2, 3, 5])}']
    lines += [f"[features]\nfloor_levels = {rng.choice([0.5, 0.0, 0.1, 2.0])}"]
    lines += [f"[trigger]\nwindow = {window}\nbacktrack = {rng.integers(0, min(5 * window, 70 - window) + 1)}"]
    lines += [f'rule = "{rule}"\nmultiplier = {multiplier:.4f}\nmargin = {rng.choice([0.2, 0.0, 0.05])}']
    lines += [f"follow = {rng.choice([0, 0, 16, 64, 512])}"]
    lines += [f'[speed]\nlaw = "published"\nthreshold_on = "{rng.choice(["absolute", "above_baseline"])}"']
    lines += [f"range_mm_s = [{rng.choice([100, 50])}, {rng.choice([200, 130.5])}]"]
    return "\n".join(lines) + "\n"


def lines_of(command: list[str]) -> list[dict[str, Any]]:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{command} ended with {done.returncode}: {done.stderr}")
    records = [json.loads(line) for line in done.stdout.splitlines()]
    return [record for record in records if record["kind"] != "note"]


def close(found: float | None, expected: float | None, tolerance: float) -> bool:
    if found is None or expected is None:
        return found is expected
    return abs(found - expected) <= tolerance


def differences(found: dict[str, Any], expected: dict[str, Any]) -> list[str]:
    """Returns the differences of two lines."""
    kind = expected["kind"]
    if found["kind"] != kind:
        return [f"{found['kind']} for {kind}"]
    same = {"features": ["frame"], "end": ["frames", "dropped", "baseline", "incomplete"]}.get(
        kind, ["frame", "frames", "duration_frames", "frames_filled", "reliable"]
    )
    wrong = [f"{key} {found[key]} for {expected[key]}" for key in same if found[key] != expected[key]]
    if kind != "event":
        return wrong
    if found["direction"]["deg"] != expected["direction"]["deg"]:
        wrong.append(f"direction {found['direction']} for {expected['direction']}")
    # Features that are one unit off move a centroid a little.
    if not close(found["direction"]["confidence"], expected["direction"]["confidence"], 0.02):
        wrong.append(f"confidence {found['direction']} for {expected['direction']}")
    speeds = [(line["speed"] or {"mm_s": None, "extrapolated": None}) for line in (found, expected)]
    bound = (found.get("speed_at_most") or {"mm_s": None})["mm_s"], expected["bound_mm_s"]
    tolerance = 0.06
    if not close(speeds[0]["mm_s"], speeds[1]["mm_s"], tolerance) or not close(*bound, tolerance):
        wrong.append(f"speed {speeds[0]} {bound[0]} for {speeds[1]} {bound[1]}")
    if speeds[0]["extrapolated"] != speeds[1]["extrapolated"]:
        wrong.append(f"extrapolated {speeds[0]} for {speeds[1]}")
    return wrong


def drawn(how_many: str) -> Iterator[int]:
    """Yields 0, 1, 2 …: `80` of them, or, for `60s`, as many as are requested within a minute."""
    if not how_many.endswith("s"):
        yield from range(int(how_many))
        return
    end = time.monotonic() + float(how_many[:-1])
    yield from takewhile(lambda _: time.monotonic() < end, count())


def main() -> int:
    wstac, how_many, seed = sys.argv[1], (sys.argv[2:] or ["60"])[0], int((sys.argv[3:] or [1])[0])
    totals = {"streams": 0, "features": 0, "one unit off": 0, "events": 0}
    failed = 0
    for number in drawn(how_many):
        rng = np.random.default_rng([seed, number])
        with tempfile.TemporaryDirectory() as folder:
            clip, config = Path(folder, "clip.y4m"), Path(folder, "wstac.toml")
            bytes_, what = stream(rng)
            clip.write_bytes(bytes_)
            config.write_text(configuration(rng))
            options = [str(clip), "--config", str(config)]
            found = lines_of([wstac, "run", *options, "--readout", "0", "--json", "--features", "--samples"])
            expected = list(oracle.lines(clip, config))
            wrong = [f"{len(found)} lines for {len(expected)}"] if len(found) != len(expected) else []
            for ours, theirs in zip(found, expected, strict=False):
                wrong += differences(ours, theirs)
                numbers = "f" if theirs["kind"] == "features" else "sample"
                if numbers in theirs and numbers in ours:
                    off = np.abs(np.array(ours[numbers]) - np.array(theirs[numbers])) / UNIT
                    totals["features"] += off.size
                    totals["one unit off"] += int((off == 1).sum())
                    wrong += [f"features off by {off.max()} units"] if off.max() > 1 else []
                totals["events"] += theirs["kind"] == "event"
            totals["streams"] += 1
            if wrong:
                failed += 1
                print(f"stream {number} of seed {seed}, {what}: {'; '.join(wrong[:4])}\n{config.read_text()}")
    print(", ".join(f"{value} {name}" for name, value in totals.items()) + f", {failed} streams disagree")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
