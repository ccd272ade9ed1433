"""Frames to features by wstac and by what one would write in Python, beside a plain read of the same bytes: one run, one core, one table.

signal.py LIBRARY [--keep]: LIBRARY is what tests/peers/frames makes; --keep writes the tables to docs/SIGNAL.md.
"""

import argparse
import ctypes
import math
import platform
import sys
import time
from pathlib import Path

import cv2
import numpy as np

import pipelines
import scaling
from native import Native

PAGE = Path(__file__).parents[2] / "docs/SIGNAL.md"
BEGIN, END = "<!-- measured: ci/bench --keep -->\n", "<!-- end -->\n"

WIDTH, HEIGHT, TAXEL, FRAMES = 1280, 720, 90, 64
CORNERS = [(307 + 144 * column, 27 + 144 * row) for row in range(5) for column in range(5)]
# A unit of a feature.
UNIT = 1 / 2048
# Of frames that stay in the cache so many a call, and so many rounds; of all of them in turn.
CACHED, CACHED_ROUNDS, TURN_ROUNDS = 16, 200, 15
PYTHON = {"GREY": pipelines.GREY, "YUYV": pipelines.YUYV}


def frames(native, rng):
    """Frames of noise: Y over its range, chroma near its zero level, so that few pixels are clipped; any bytes for other formats."""
    count = FRAMES * native.frame_bytes
    if native.name.startswith("YUYV"):
        made = rng.integers(16, 236, count, dtype=np.uint8)
        made[1::2] = rng.integers(108, 149, count // 2, dtype=np.uint8)
    else:
        made = rng.integers(0, 256, count, dtype=np.uint8)
    return made


def timed(work):
    start = time.perf_counter_ns()
    work()
    return (time.perf_counter_ns() - start) / 1000


def measure(contestants, rounds, warm=True):
    """Microseconds that each takes at least, in rounds of one after the other; `warm` ones once untimed before, so that what was in the cache is again."""
    least = dict.fromkeys(contestants, math.inf)
    for _ in range(rounds):
        for name, (work, count) in contestants.items():
            if warm:
                work()
            least[name] = min(least[name], timed(work) / count)
    return least


def both(contestants, quick, rounds, warm):
    """The same; quick ones take turns with each other, too, in more rounds."""
    least = measure(contestants, rounds, warm)
    more = measure({name: contestants[name] for name in quick}, 3 * rounds, warm)
    return least | {name: min(least[name], more[name]) for name in quick}


def check(name, native, made):
    """How far each pipeline's features are from the ones of exact arithmetic, in units; wstac's may be one off."""
    frame = made[: native.frame_bytes]
    reference = pipelines.reference(name, frame.reshape(HEIGHT, WIDTH, -1), CORNERS, TAXEL)
    found = {native.name: native.features(made, 1, 1) * UNIT}
    for label, work in PYTHON[name].items():
        found[label] = work(frame.reshape(HEIGHT, WIDTH, -1), CORNERS, TAXEL)
    return {label: float(np.abs(features - reference).max() / UNIT) for label, features in found.items()}


def peers(library):
    """Rows of the table: format, who, units off, least time of a frame in the cache and of frames in turn."""
    rng = np.random.default_rng(1)
    rows = []
    for name, formats, pixel in (("GREY", ["GREY"], 1), ("YUYV", ["YUYV linear", "YUYV exact"], 2)):
        natives = [Native(library, each, WIDTH, HEIGHT, TAXEL, CORNERS) for each in formats]
        made = frames(natives[0], rng)
        off = {}
        for native in natives:
            off |= check(name, native, made)
            # Linear rounds once a taxel, and is compared with rounding every pixel: nothing is promised, and it is printed.
            if "linear" not in native.name and off[native.name] > 1:
                sys.exit(f"{native.name}: {off[native.name]:.2f} units off, expected at most 1")
        pictures = made.reshape(FRAMES, HEIGHT, WIDTH, -1)
        cached, turn = {}, {}
        read = f"read of {pixel} byte{'s' * (pixel > 1)} a pixel"
        cached[read] = (lambda n=natives[0]: n.read(made, 1, CACHED, pixel), CACHED)
        turn[read] = (lambda n=natives[0]: n.read(made, FRAMES, FRAMES, pixel), FRAMES)
        for native in natives:
            cached[native.name] = (lambda n=native: n.features(made, 1, CACHED), CACHED)
            turn[native.name] = (lambda n=native: n.features(made, FRAMES, FRAMES), FRAMES)
        for label, work in PYTHON[name].items():
            cached[label] = (lambda w=work: w(pictures[0], CORNERS, TAXEL), 1)
            turn[label] = (lambda w=work: [w(picture, CORNERS, TAXEL) for picture in pictures], FRAMES)
        quick = [read, *formats]
        cached, turn = both(cached, quick, CACHED_ROUNDS, warm=True), both(turn, quick, TURN_ROUNDS, warm=False)
        slow = next(iter(PYTHON[name]))
        rows += [
            [name, label, off.get(label), cached[label], turn[label]]
            + [times[other] / times[label] for times in (cached, turn) for other in (read, slow)]
            for label in cached
        ]
    return rows


def others(library):
    """The other formats: wstac alone, in the cache."""
    rng = np.random.default_rng(2)
    contestants = {}
    for name in Native.FORMATS[3:]:
        native = Native(library, name, WIDTH, HEIGHT, TAXEL, CORNERS)
        made = rng.integers(0, 256, native.frame_bytes, dtype=np.uint8)
        contestants[name] = (lambda n=native, m=made: n.features(m, 1, CACHED), CACHED)
    return measure(contestants, CACHED_ROUNDS)


def table(library):
    """Lines of Markdown."""
    yield "| frames of | by | units off | one, cached: µs | of the read | × OpenCV | 64 in turn: µs | of the read | × OpenCV |"
    yield "| --- | --- |" + " ---: |" * 7
    for name, label, off, cached, turn, read, slow, turn_read, turn_slow in peers(library):
        units = "" if off is None else f"{off:.2g}"
        shares = [f"{share:.0%}" for share in (read, turn_read)]
        times = [f"{times:.3g}" for times in (slow, turn_slow)]
        yield f"| {name} | {label} | {units} | {cached:.3g} | {shares[0]} | {times[0]} | {turn:.3g} | {shares[1]} | {times[1]} |"
    yield ""
    yield "Other formats, one frame in the cache, µs: " + ", ".join(f"{name} {least:.3g}" for name, least in others(library).items()) + "."
    yield ""
    yield "| what grows by 1, 4, 16, 64 | µs | exponent | expected |"
    yield "| --- | --- | ---: | --- |"
    for what, costs, exponent, expected in scaling.rows(library, measure):
        yield f"| {what} | {', '.join(f'{cost:.3g}' for cost in costs)} | {exponent:.2f} | {expected} |"
    yield ""
    yield (
        f"Instruction set: {Native.instruction_set(library)}; {cpu()}. Python {platform.python_version()}, OpenCV {cv2.__version__}, "
        f"NumPy {np.__version__}, one thread each."
    )


def cpu():
    names = [line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")]
    return names[0] if names else platform.machine()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("library", type=ctypes.CDLL)
    parser.add_argument("--keep", action="store_true")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    lines = []
    for line in table(arguments.library):
        print(line, flush=True)
        lines.append(line)
    if arguments.keep:
        before, rest = PAGE.read_text().split(BEGIN)
        text = "\n".join(lines)
        PAGE.write_text(f"{before}{BEGIN}\n{text}\n\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    main()
