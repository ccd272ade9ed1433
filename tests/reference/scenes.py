"""Scenes for `wstac run`: writes slides as a scene's TOML file, and reads the events that the command prints.

The environment variable WSTAC names the command. Scenes run at `fidelity = "taxel"`: taxel sums are drawn from their
distribution, and no pixel is rendered.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SPECIMENS = ("Fla0", "Sin2", "Sin3", "Sin4", "Saw2", "Saw3", "Saw4", "Tri2", "Tri3", "Tri4")
"""The ten of the paper, in its order."""

DIRECTIONS = (0, 90, 180, 270)
"""In degrees, counterclockwise from the right along the sensor's rows."""

WORKERS = 2
"""Commands that run at the same time."""

SOURCES = Path(__file__).parents[2] / "wstac-scene" / "src"


@dataclass(frozen=True)
class Slide:
    """One slide: a specimen's name, speed in mm/s, direction in degrees."""

    specimen: str
    speed_mm_s: float
    direction_deg: int


@dataclass(frozen=True)
class Changes:
    """Settings of a scene that replace the simulator's defaults. None keeps a default."""

    length_mm: float | None = None
    afterglow_ms: float | None = None
    noise: float | None = None


DEFAULTS = Changes()


@dataclass(frozen=True)
class Event:
    """The event that `wstac run` prints for one slide.

    `duration_frames` and `speed_mm_s` are None if there is no answer, and `direction_deg` is None if it is unclear.
    `sample` is 10 features × 70 frames of natural logarithms, or None if it was not requested.
    """

    duration_frames: int | None
    speed_mm_s: float | None
    direction_deg: int | None
    sample: list[list[float]] | None


def scene_text(slides: Sequence[Slide], seed: int, changes: Changes = DEFAULTS) -> str:
    """Returns the TOML text of a scene with these slides one after another."""
    lines = ['fidelity = "taxel"', f"seed = {seed}"]
    if changes.noise is not None:
        lines.append(f"noise = {changes.noise}")
    if changes.afterglow_ms is not None:
        lines += ["[light]", f"afterglow_ms = {changes.afterglow_ms}"]
    for slide in slides:
        lines += ["[[slide]]", f'specimen = "{slide.specimen}"', f"speed = {slide.speed_mm_s}"]
        lines.append(f"direction = {slide.direction_deg}")
        if changes.length_mm is not None:
            lines.append(f"length = {changes.length_mm}")
    return "\n".join(lines) + "\n"


def constant(file: str, pattern: str) -> float:
    """Returns a number in the simulator's sources."""
    found = re.search(pattern + r"([0-9.]+)", (SOURCES / file).read_text())
    if found is None:
        raise SystemExit(f"{file} has no {pattern!r}")
    return float(found[1])


def command() -> str:
    """Returns the path of the wstac command."""
    path = os.environ.get("WSTAC")
    if not path:
        raise SystemExit("WSTAC is not set, expected the path of the wstac command (ci/build wstac prints it)")
    return path


def run_wstac(arguments: Sequence[str]) -> str:
    """Returns the output of the command."""
    done = subprocess.run([command(), *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"wstac {' '.join(arguments)} ended with {done.returncode}: {done.stderr}")
    return done.stdout


def event_of(line: dict[str, Any]) -> Event:
    """Returns an event from its JSON object."""
    speed = line["speed"]
    return Event(
        line["duration_frames"], speed and speed["mm_s"], line["direction"]["deg"], line.get("sample")
    )


def events(slides: Sequence[Slide], seed: int, changes: Changes = DEFAULTS, samples: bool = False) -> list[Event]:
    """Returns the events of one stream with these slides, one per slide.

    Raises an error if the stream does not have as many events as slides, because then nobody knows which is which.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "scene.toml")
        file.write_text(scene_text(slides, seed, changes))
        published = Path(folder, "published.toml")
        published.write_text('[speed]\nlaw = "published"\n')
        arguments = ["run", f"scene:{file}", "--config", str(published), "--json"]
        printed = run_wstac([*arguments, *(["--samples"] if samples else [])])
    lines = [json.loads(line) for line in printed.splitlines()]
    found = [event_of(line) for line in lines if line["kind"] == "event"]
    if len(found) != len(slides):
        raise SystemExit(f"{len(found)} events of {len(slides)} slides, seed {seed}, {slides[0]} and so on")
    return found


def events_of_streams(
    streams: Iterable[tuple[Sequence[Slide], int]], changes: Changes = DEFAULTS, samples: bool = False
) -> list[list[Event]]:
    """Returns the events of several streams, each of some slides and a seed, in their order."""
    with ThreadPoolExecutor(WORKERS) as pool:
        jobs = [pool.submit(events, slides, seed, changes, samples) for slides, seed in streams]
        return [job.result() for job in jobs]
