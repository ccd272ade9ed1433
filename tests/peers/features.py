"""Measures frames to features with wstac, with programs that one would write in Python, and with a plain read of the
same bytes. One run on one core fills one table.

features.py LIBRARY PLAIN [--keep]: LIBRARY is built from tests/peers/frames, and PLAIN is the same built with --cfg
wstac_plain. --keep writes the tables to docs/SIGNAL.md.
"""

import argparse
import ctypes
import math
import os
import platform
import sys
import time
from pathlib import Path

import cv2
import numpy as np

import pipelines
from native import Native

PAGE = Path(__file__).parents[2] / "docs/SIGNAL.md"
BEGIN, END = "<!-- measured: ci/bench --keep -->\n", "<!-- end -->\n"

WIDTH, HEIGHT, TAXEL = 1280, 720, 90
CORNERS = [(307 + 144 * column, 27 + 144 * row) for row in range(5) for column in range(5)]
# The read that prefetches cache lines.
AHEAD = "read, asked for ahead"
# The unit of a feature.
UNIT = 1 / 2048
# The frames per call if one frame stays in the cache, the rounds of that, and the rounds of all frames in turn. They
# are the same for all contestants.
CACHED, CACHED_ROUNDS, TURN_ROUNDS = 16, 60, 5
# All frames in turn touch this many times the bytes of the largest cache.
OF_CACHE = 4
# The bytes of a cache line.
LINE = 64
PYTHON = {"GREY": pipelines.GREY, "YUYV": pipelines.YUYV}


def farthest_cache():
    """Returns the bytes of the largest cache, or 32 MiB if the machine does not report it."""
    sizes = [path.read_text().strip() for path in Path("/sys/devices/system/cpu/cpu0/cache").glob("index*/size")]
    return max((int(size.removesuffix("K")) * 1024 for size in sizes if size.endswith("K")), default=32 << 20)


def touched(pixel):
    """Returns the bytes of the cache lines under the taxels of a frame that starts with a line."""
    ends = [((y + row) * WIDTH * pixel + x * pixel, TAXEL * pixel) for x, y in CORNERS for row in range(TAXEL)]
    return LINE * len({line for at, size in ends for line in range(at // LINE, (at + size - 1) // LINE + 1)})


def frames(native, rng, number):
    """Returns frames of noise. Y is over its range, and chroma is near its zero level, so that few pixels are clipped.
    Other formats have any bytes.
    """
    count = number * native.frame_bytes
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
    """Returns the minimum microseconds of each function, which take turns in rounds. With `warm`, each runs once
    untimed before it is timed, so that the cache has its data again.
    """
    least = dict.fromkeys(contestants, math.inf)
    for _ in range(rounds):
        for name, (work, count) in contestants.items():
            if warm:
                work()
            least[name] = min(least[name], timed(work) / count)
    return least


def check(name, native, made):
    """Returns the largest distance of each pipeline's features from exact arithmetic, in units. wstac's may be at most
    one.
    """
    frame = made[: native.frame_bytes]
    reference = pipelines.reference(name, frame.reshape(HEIGHT, WIDTH, -1), CORNERS, TAXEL)
    found = {native.name: native.features(made, 1, 1) * UNIT}
    for label, work in PYTHON[name].items():
        found[label] = work(frame.reshape(HEIGHT, WIDTH, -1), CORNERS, TAXEL)
    return {label: float(np.abs(features - reference).max() / UNIT) for label, features in found.items()}


def repeated(work, *arguments):
    for _ in range(CACHED):
        work(*arguments)


def peers(library, plain, sizes):
    """Returns rows of the table: format, who, units off, least time of a frame in the cache and of frames in turn.
    `sizes` gets a line about each format's frames.
    """
    rng = np.random.default_rng(1)
    rows = []
    for name, formats, pixel in (("GREY", ["GREY"], 1), ("YUYV", ["YUYV linear", "YUYV exact"], 2)):
        natives = [Native(library, each, WIDTH, HEIGHT, TAXEL, CORNERS) for each in formats]
        slower = [Native(plain, each, WIDTH, HEIGHT, TAXEL, CORNERS) for each in formats]
        for each in slower:
            each.name += ", plain"
        number = -(-OF_CACHE * farthest_cache() // touched(pixel))
        sizes.append(f"{name} {number} frames, {number * touched(pixel) / 1e6:.0f} MB of cache lines under taxels")
        made = frames(natives[0], rng, number)
        off = {}
        for native in natives + slower:
            off |= check(name, native, made)
            # Linear rounds once per taxel, and is compared with rounding every pixel. Nothing is promised, so it is
            # only printed.
            if "linear" not in native.name and off[native.name] > 1:
                sys.exit(f"{native.name}: {off[native.name]:.2f} units off, expected at most 1")
        pictures = made.reshape(number, HEIGHT, WIDTH, -1)
        cached, turn = {}, {}
        read = f"plain read of {pixel} byte{'s' * (pixel > 1)} per pixel"
        for label, ahead in ((read, False), (AHEAD, True)):
            cached[label] = (lambda n=natives[0], a=ahead: n.read(made, 1, CACHED, pixel, a), CACHED)
            turn[label] = (lambda n=natives[0], a=ahead, f=number: n.read(made, f, f, pixel, a), number)
        for native in natives + slower:
            cached[native.name] = (lambda n=native: n.features(made, 1, CACHED), CACHED)
            turn[native.name] = (lambda n=native, f=number: n.features(made, f, f), number)
        for label, work in PYTHON[name].items():
            cached[label] = (lambda w=work: repeated(w, pictures[0], CORNERS, TAXEL), CACHED)
            turn[label] = (lambda w=work: [w(picture, CORNERS, TAXEL) for picture in pictures], number)
        cached, turn = measure(cached, CACHED_ROUNDS), measure(turn, TURN_ROUNDS, warm=False)
        # The limit is the better of both reads.
        for times in (cached, turn):
            times[read] = min(times[read], times.pop(AHEAD))
        for label in cached:
            rows.append([name, label, off.get(label), cached[label], turn[label]])
    return rows


def others(library):
    """Measures the other formats: only wstac, in the cache."""
    rng = np.random.default_rng(2)
    contestants = {}
    for name in Native.FORMATS[3:]:
        native = Native(library, name, WIDTH, HEIGHT, TAXEL, CORNERS)
        made = rng.integers(0, 256, native.frame_bytes, dtype=np.uint8)
        contestants[name] = (lambda n=native, m=made: n.features(m, 1, CACHED), CACHED)
    return measure(contestants, CACHED_ROUNDS)


def table(library, plain):
    """Returns lines of Markdown."""
    yield "| format | method | units off | one frame, cached: µs | all frames in turn: µs |"
    yield "| --- | --- |" + " ---: |" * 3
    sizes = []
    for name, label, off, *times in peers(library, plain, sizes):
        cells = [f"{time:.3g}" for time in times]
        units = "" if off is None else f"{off:.2g}"
        yield f"| {name} | {label} | {units} | {' | '.join(cells)} |"
    yield ""
    yield f"All frames in turn: {'; '.join(sizes)}; the largest cache has {farthest_cache() / 1e6:.0f} MB."
    yield ""
    yield "Other formats, one frame in the cache, µs: " + ", ".join(f"{name} {least:.3g}" for name, least in others(library).items()) + "."
    yield ""
    yield (
        f"Instruction set: {Native.instruction_set(library)}; {cpu()}. Python {platform.python_version()}, OpenCV {cv2.__version__}, "
        f"NumPy {np.__version__}, one thread each, on CPU {next(iter(os.sched_getaffinity(0)))} only; load of the machine at the end {os.getloadavg()[0]:.1f}."
    )


def cpu():
    names = [line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")]
    return names[0] if names else platform.machine()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("library", type=ctypes.CDLL)
    parser.add_argument("plain", type=ctypes.CDLL)
    parser.add_argument("--keep", action="store_true")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    lines = []
    for line in table(arguments.library, arguments.plain):
        print(line, flush=True)
        lines.append(line)
    if arguments.keep:
        before, rest = PAGE.read_text().split(BEGIN)
        text = "\n".join(lines)
        PAGE.write_text(f"{before}{BEGIN}\n{text}\n\n{END}{rest.split(END, 1)[1]}")


if __name__ == "__main__":
    main()
