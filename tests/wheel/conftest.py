"""Fixtures of the Python package's tests: the command, and recordings that it makes."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

WSTAC = os.environ["WSTAC"]
REPOSITORY = Path(__file__).parents[2]


def command(*arguments: str) -> list[Any]:
    """Returns the objects that the command prints."""
    done = subprocess.run([WSTAC, *arguments], check=True, capture_output=True, text=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def refusal(*arguments: str) -> str:
    """Returns the message of the command if it cannot use something."""
    done = subprocess.run([WSTAC, *arguments], capture_output=True, text=True)
    assert done.returncode in (1, 2), done
    return done.stderr.removeprefix("wstac: ").rstrip("\n")


SCENE = """
seed = 5
[[touch]]
kind = "slide"
specimen = "Saw3"
speed = 150
direction = 90
[[touch]]
kind = "slide"
specimen = "Fla0"
speed = 110
direction = 33
[[touch]]
kind = "slide"
specimen = "Tri4"
speed = 40
direction = 180
[[touch]]
kind = "press"
"""
"""Three slides and a press; the last slide is longer than an event, so that it has no speed by the published law."""

GLOBAL = "[sensor]\nreadout_ms = 0\n"
LAWS = {"arrival": GLOBAL, "published": GLOBAL + '[speed]\nlaw = "published"\n'}
"""Configurations of both kinds of laws, of a global shutter: arrival times are the default."""


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Makes a recording with labels and lost frames."""
    folder = tmp_path_factory.mktemp("recording")
    scene, file = folder / "scene.toml", folder / "a.mcap"
    scene.write_text(SCENE + "[sensor]\nsize = [200, 200]\ndropped = 0.02\n")
    command("record", f"scene:{scene}", "-o", str(file), "--json", "--label", "specimen=Saw3", "--label", "who=me")
    return file
