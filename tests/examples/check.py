"""Checks the examples: what they print, and that programs in Rust, C and Python of at most 30 lines print the events of
a recording that `wstac run` does.

    check.py WSTAC EXAMPLES PREFIX WHEEL    the command; where cargo has put the examples; where the library for C is
                                            installed; and the wheel of the Python package
"""

from __future__ import annotations

import difflib
import json
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import loops

ROOT = Path(__file__).resolve().parents[2]
# Three slides and a press in one recording: a press has no speed.
SLIDES = """
seed = 3
[sensor]
size = [640, 480]
[[touch]]
kind = "slide"
specimen = "Saw3"
speed = 150
direction = 90
[[touch]]
kind = "slide"
specimen = "Tri4"
speed = 110
direction = 180
[[touch]]
kind = "slide"
specimen = "Sin2"
speed = 40
direction = 215
[[touch]]
kind = "press"
"""
PRINTED = {
    "frames": ["event from frame 30, slide from frame 42, 27.4 ± 0.4 mm/s, towards 90.0°, 2 frames filled"],
    "own_kernel": ["Parabola  ["],
    "two_cameras": ["Saw3@150,90deg: frame 35: 150.2 mm/s, 90.1°, Saw3", "Tri4@110,180deg: frame 35: 110.4 mm/s, 180°, Tri4"],
}
failures: list[str] = []


def prints(name: str, program: Path) -> None:
    """Checks that a program succeeds, and prints lines with its texts."""
    done = subprocess.run([program], check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    for text in PRINTED[name]:
        lines = [line for line in done.stdout.splitlines() if text in line]
        if done.returncode == 0 and lines:
            print(f"{name}: {lines[0]}")
        else:
            failures.append(f'{name} printed, expected "{text}":\n{done.stdout}')


def line_of(event: dict) -> str:
    """Returns an event as the examples print it."""
    speed, direction = (event[name] if event["reliable"] else None for name in ("speed", "direction"))
    texture = event["texture"]
    said_speed = f"{speed['mm_s']:.2f}±{speed['sd']:.2f}" if speed else "-"
    said_direction = f"{direction['deg']:.1f}±{direction['sd']:.2f}" if direction else "-"
    return f"frame={event['frame']} speed={said_speed} direction={said_direction} texture={(texture and texture['specimen']) or '-'}"


def same(name: str, source: str, expected: list[str], command: list[str | Path]) -> None:
    """Checks that a program of at most 30 lines prints the events that `wstac run` does."""
    lines = len((ROOT / source).read_text(encoding="utf-8").splitlines())
    if lines > 30:
        failures.append(f"{source} has {lines} lines, expected at most 30")
    done = subprocess.run(command, check=False, stdout=subprocess.PIPE, text=True)
    found = done.stdout.splitlines()
    if done.returncode == 0 and found == expected:
        print(f"{name}: the {len(expected)} events of wstac run")
    else:
        failures.append("\n".join([f"{name} printed other events than wstac run:", *difflib.unified_diff(expected, found, lineterm="")]))


def main() -> None:
    wstac, examples, prefix, wheel = (Path(argument) for argument in sys.argv[1:])
    for name in PRINTED:
        prints(name, examples / name)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        recording = folder / "slides.mcap"
        (folder / "slides.toml").write_text(SLIDES)
        subprocess.run([wstac, "record", f"scene:{folder / 'slides.toml'}", "-o", recording], check=True, capture_output=True)
        command = [wstac, "run", recording, "--json", "--model", "builtin"]
        at_once, expected = [
            [line_of(record) for record in map(json.loads, said.splitlines()) if record["kind"] == "event"]
            for more in ([], ["--samples"])
            for said in [subprocess.run([*command, *more], check=True, capture_output=True, text=True).stdout]
        ]
        moving = sum("speed=-" not in line for line in expected)
        if len(expected) != 4 or moving in (0, 4):
            sys.exit("\n".join(["examples: the recording has other events:", *expected]))
        same("events, Rust", "wstac-host/examples/events.rs", at_once, [examples / "events", recording])
        # pkg-config quotes for a shell: a path may hold spaces.
        variables = {**os.environ, "PKG_CONFIG_PATH": str(prefix / "lib/pkgconfig")}
        flags = subprocess.run(["pkg-config", "--cflags", "--libs", "wstac"], check=True, capture_output=True, text=True, env=variables).stdout
        source = "wstac-c/examples/events.c"
        strict = ["-std=c11", "-Wall", "-Wextra", "-Werror"]
        subprocess.run(["cc", *strict, ROOT / source, "-o", folder / "events", *shlex.split(flags)], check=True)
        same("events, C", source, expected, [folder / "events", recording])
        source, python = "wstac-python/examples/events.py", folder / "venv/bin/python"
        subprocess.run([sys.executable, "-m", "venv", folder / "venv"], check=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel], check=True)
        same("events, Python", source, expected, [python, ROOT / source, recording])
        loops_of_all, frames = loops.commands(folder, wstac, examples / "bounded_loop", prefix, python, 0)
        loops.check(loops.run(loops_of_all, 0), frames)
        print(f"loops with a deadline in {', '.join(loops_of_all)}: {frames} frames are answered or counted as lost")
    sys.exit("\n".join(f"examples: {failure}" for failure in failures) or None)


if __name__ == "__main__":
    main()
