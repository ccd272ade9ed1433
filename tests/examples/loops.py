"""Measures the loops with a deadline in C++, Rust and Python: the time from a frame's time stamp to its answer. All
three run at once, alone and beside a load of 1.5 processors, so that they can be compared.

    loops.py WSTAC RUST PREFIX PYTHON [--seconds S] [--keep]    the command; the example in Rust; where the library for
                                                                C is installed; a Python with the package

--keep writes the table into docs/PROGRAMS.md.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/PROGRAMS.md"
BEGIN, END = "<!-- loops: ci/bench loops --keep -->\n", "<!-- loops end -->"
SCENE, FRAME_BYTES, RATE = "scene:Saw3@150,90deg", 640 * 480, 30
FOUND = re.compile(
    r"frames: (\d+), lost: (\d+), late: (\d+), events: (\d+); "
    r"stamp to answer in ms: median ([\d.]+), 99 % ([\d.]+), worst ([\d.]+)\n"
)
# One processor all the time, and one half of it: 5 of each 10 ms.
WHOLE = "while True: pass"
HALF = """
import time
while True:
    end = time.monotonic() + 0.005
    while time.monotonic() < end: pass
    time.sleep(0.005)
"""
CONDITIONS = (("no load of its own", 0, False), ("load", 0, True), ("load, nice −15", -15, True))


def busy() -> float:
    """Returns the processor time in s that the machine has used so far."""
    fields = [int(field) for field in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:]]
    return (sum(fields[:3]) + sum(fields[5:8])) / os.sysconf("SC_CLK_TCK")


@contextlib.contextmanager
def load(is_on: bool) -> Iterator[None]:
    """Keeps 1.5 processors busy."""
    programs = [subprocess.Popen([sys.executable, "-c", one]) for one in ((WHOLE, HALF) if is_on else ())]
    try:
        yield
    finally:
        for program in programs:
            program.kill()
            program.wait()


def run(loops: dict[str, list[str]], nice: int) -> dict[str, re.Match[str]]:
    """Runs all loops at once. Returns what they print."""

    def begin() -> None:
        os.setpriority(os.PRIO_PROCESS, 0, nice)

    of_nice = {"preexec_fn": begin} if nice else {}
    started = {
        name: subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **of_nice) for name, command in loops.items()
    }
    found = {}
    for name, program in started.items():
        said, _ = program.communicate()
        match = FOUND.fullmatch(said)
        if program.returncode or not match:
            sys.exit(f"loops: {name} printed {said!r} and has exit code {program.returncode}")
        found[name] = match
    return found


def commands(
    folder: Path, wstac: Path, rust: Path, prefix: Path, python: Path, seconds: float
) -> tuple[dict[str, list[str]], int]:
    """Renders frames, and compiles the loop in C++. Returns the commands that take so long, one pass at least, and the
    number of frames.
    """
    frames, program = folder / "frames", folder / "bounded_loop"
    subprocess.run(
        [wstac, "run", SCENE, "--size", "640x480", "--save-raw", frames, "--quiet"],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    variables = {**os.environ, "PKG_CONFIG_PATH": str(prefix / "lib/pkgconfig")}
    query = ["pkg-config", "--cflags", "--libs", "wstac"]
    flags = shlex.split(subprocess.run(query, check=True, capture_output=True, text=True, env=variables).stdout)
    strict = ["-std=c++11", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fno-rtti"]
    subprocess.run(["c++", *strict, ROOT / "wstac-c/examples/bounded_loop.cpp", "-o", program, *flags], check=True)
    count = frames.stat().st_size // FRAME_BYTES
    passes = max(1, round(seconds * RATE / count))
    loops = {"C++": [program], "Rust": [rust], "Python": [python, ROOT / "wstac-python/examples/bounded_loop.py"]}
    return {name: [*map(str, loop), str(frames), str(passes)] for name, loop in loops.items()}, count * passes


def check(found: dict[str, re.Match[str]], all_frames: int) -> None:
    """Every frame is answered or counted as lost, and something is found in them: whatever the clock does."""
    for name, match in found.items():
        frames, lost, late, events = (int(match[field]) for field in range(1, 5))
        if frames + lost != all_frames or late > frames:
            sys.exit(f"loops: {name} counts {frames} frames and {lost} lost, expected {all_frames} in all")
        # Who loses more may lose the touch.
        if lost * 10 <= all_frames and not events:
            sys.exit(f"loops: {name} finds no event in {frames} frames")


def table(loops: dict[str, list[str]], frames: int) -> list[str]:
    """Measures under each condition. Returns the table."""
    rows = ["| processors that are busy | " + " | ".join(loops) + " |", "| --- |" + " ---: |" * len(loops)]
    for condition, nice, is_loaded in CONDITIONS:
        with load(is_loaded):
            begun, used = time.monotonic(), busy()
            found = run(loops, nice)
            used = (busy() - used) / (time.monotonic() - begun)
        check(found, frames)
        cells = [f"{float(match[5]):.2f}, {float(match[6]):.2f}, {match[3]}+{match[2]}" for match in found.values()]
        rows.append(f"| {condition}, {used:.1f} | " + " | ".join(cells) + " |")
        print(rows[-1], flush=True)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("wstac", "rust", "prefix", "python"):
        parser.add_argument(name, type=Path)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--keep", action="store_true")
    given = parser.parse_args()
    # Better now than after two conditions.
    nice = min(nice for _, nice, _ in CONDITIONS)
    tried = "import os, sys; os.setpriority(os.PRIO_PROCESS, 0, int(sys.argv[1]))"
    if subprocess.run([sys.executable, "-c", tried, str(nice)], stderr=subprocess.DEVNULL, check=False).returncode:
        sys.exit(f"loops: priority {nice} is refused, expected the rights of root")
    with tempfile.TemporaryDirectory() as folder:
        tools = (given.wstac, given.rust, given.prefix, given.python)
        rows = table(*commands(Path(folder), *tools, given.seconds))
    if given.keep:
        before, _, rest = PAGE.read_text().partition(BEGIN)
        _, end, after = rest.partition(END)
        if not end:
            sys.exit(f"{PAGE}: has no marks for the table")
        PAGE.write_text(before + BEGIN + "\n".join(rows) + "\n" + end + after)


if __name__ == "__main__":
    main()
