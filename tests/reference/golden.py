#!/usr/bin/env python3
"""Writes or checks golden vectors: `golden.py write DIR` makes them, and `golden.py check DIR` makes them again and
compares.

`DIR/manifest.json` lists the cases. `expected.json` has the reference's results by name of the case, and `frames.raw`
has all frames: those of a case begin at its byte `at`. README.md describes the fields.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from vectors import SEED
from vectors.at_once_cases import at_once_cases
from vectors.case import Case
from vectors.crosstalk_cases import crosstalk_cases
from vectors.event_cases import event_cases
from vectors.extent_cases import extent_cases
from vectors.follow_cases import follow_cases
from vectors.format_cases import format_cases
from vectors.known_cases import known_cases
from vectors.live_cases import live_cases
from vectors.motion_cases import motion_cases, readout_cases
from vectors.path_cases import path_cases
from vectors.shutters import SHUTTERS, named
from vectors.slip_cases import slip_cases
from vectors.touch_cases import touch_cases
from vectors.wave_cases import wave_cases
from wstac_reference.formats import FORMATS

VERSION = 2
SUFFIXES = (".json", ".raw")


def lines_of(value: dict[str, Any]) -> str:
    """Returns JSON with one top-level key per line, and one list element per line in long lists."""
    parts = []
    for key, item in value.items():
        text = json.dumps(item, separators=(",", ":"))
        if isinstance(item, list) and len(text) > 100:
            text = "[\n" + ",\n".join(json.dumps(one, separators=(",", ":")) for one in item) + "]"
        parts.append(f"{json.dumps(key)}:{text}")
    return "{" + ",\n".join(parts) + "}\n"


def made_files() -> dict[str, bytes]:
    """Returns the name and content of every file of the vectors."""
    cases: list[Case] = format_cases() + event_cases() + follow_cases() + touch_cases()
    assert {case.format for case in cases} == set(FORMATS), "a format has no case"
    expected: dict[str, str] = {}
    listed, frames = [], bytearray()
    for case in cases:
        assert case.name not in expected, f"two cases are called {case.name}"
        expected[case.name] = lines_of(case.expected()).rstrip("\n")
        listed.append(case.manifest() | {"at": len(frames)})
        frames += b"".join(case.data)
    results = ",\n".join(f"{json.dumps(name)}:{text}" for name, text in expected.items())
    return {
        "manifest.json": lines_of({"version": VERSION, "seed": SEED, "cases": listed}).encode(),
        "expected.json": f"{{{results}}}\n".encode(),
        "frames.raw": bytes(frames),
        "at_once.json": lines_of({"cases": at_once_cases()}).encode(),
        "slip.json": lines_of({"cases": slip_cases()}).encode(),
        "crosstalk.json": lines_of({"cases": crosstalk_cases()}).encode(),
        "extent.json": lines_of({"cases": extent_cases()}).encode(),
        "known.json": lines_of({"cases": known_cases()}).encode(),
        "live.json": lines_of({"cases": live_cases()}).encode(),
        "motion.json": lines_of({"cases": motion_cases()}).encode(),
        "readout.json": lines_of({"shutters": [named(shutter) for shutter in SHUTTERS], "cases": readout_cases()}).encode(),
        "path.json": lines_of({"cases": path_cases()}).encode(),
        "wave.json": lines_of({"cases": wave_cases()}).encode(),
    }


def write(directory: Path) -> int:
    """Writes all vectors after all are made, removes other vectors, and returns how many files were written."""
    files = made_files()
    directory.mkdir(parents=True, exist_ok=True)
    for old in directory.iterdir():
        if old.suffix in SUFFIXES and old.name not in files:
            old.unlink()
    for name, content in files.items():
        (directory / name).write_bytes(content)
    return len(files)


def first_difference(made: Path, stored: Path) -> str | None:
    """Returns the first difference between two directories of vectors, in words."""
    for name in sorted({path.name for path in (*made.iterdir(), *stored.iterdir()) if path.suffix in SUFFIXES}):
        ours, theirs = made / name, stored / name
        if not theirs.exists():
            return f"{name}: missing"
        if not ours.exists():
            return f"{name}: belongs to no case"
        a, b = ours.read_bytes(), theirs.read_bytes()
        if a != b:
            shared = min(len(a), len(b))
            at = next((index for index in range(shared) if a[index] != b[index]), shared)
            line = a[:at].count(b"\n") + 1
            near = slice(max(at - 20, 0), at + 20)
            return f"{name}: byte {at} (line {line}): made {a[near]!r}, stored {b[near]!r}"
    return None


def check(directory: Path) -> str | None:
    """Makes the vectors again and compares them with the stored ones byte for byte."""
    with tempfile.TemporaryDirectory() as made:
        write(Path(made))
        return first_difference(Path(made), directory)


def main() -> int:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description="write or check the golden vectors")
    parser.add_argument("command", choices=("write", "check"))
    parser.add_argument("directory", type=Path)
    arguments = parser.parse_args()
    if arguments.command == "write":
        print(f"{write(arguments.directory)} files written to {arguments.directory}")
        return 0
    if not arguments.directory.is_dir():
        print(f"{arguments.directory} is not a directory", file=sys.stderr)
        return 1
    difference = check(arguments.directory)
    if difference is not None:
        print(difference, file=sys.stderr)
        return 1
    print("the golden vectors are what the reference makes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
