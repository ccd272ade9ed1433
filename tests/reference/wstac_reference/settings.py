"""Settings of the command-line tools: options, and the product's TOML configuration."""

from __future__ import annotations

import argparse
import tomllib
from dataclasses import dataclass, field, fields
from fractions import Fraction
from pathlib import Path
from typing import Any

from .layout import Layout, paper_layout
from .speed import SpeedConfig
from .trigger import TriggerConfig

OPTIONS: dict[str, tuple[str, str, type]] = {
    "yuv": ("green", "yuv", str),
    "stride": ("green", "stride", int),
    "floor_levels": ("features", "floor_levels", float),
    "window": ("trigger", "window", int),
    "multiplier": ("trigger", "multiplier", float),
    "backtrack": ("trigger", "backtrack", int),
    "rule": ("trigger", "rule", str),
    "margin": ("trigger", "margin", float),
    "follow": ("trigger", "follow", int),
    "law": ("speed", "law", str),
    "threshold": ("speed", "threshold", float),
    "threshold_on": ("speed", "threshold_on", str),
}
"""Command-line options that stand for one key of the configuration."""

KNOWN: dict[str, set[str]] = {
    "layout": {"preset", "taxel", "corners"},
    "green": {"yuv", "stride"},
    "features": {"ln", "floor_levels"},
    "trigger": {f.name for f in fields(TriggerConfig)},
    "speed": {f.name for f in fields(SpeedConfig)},
    "direction": {"method"},
}


@dataclass
class Settings:
    """Returns the configuration, section by section. An option on the command line takes precedence."""

    sections: dict[str, dict[str, Any]] = field(default_factory=dict)

    def get(self, section: str, key: str, default: Any) -> Any:
        """Returns one value."""
        return self.sections.get(section, {}).get(key, default)

    @property
    def trigger(self) -> TriggerConfig:
        """Returns the section trigger."""
        return TriggerConfig(**self.sections.get("trigger", {}))

    @property
    def speed(self) -> SpeedConfig:
        """Returns the section speed."""
        return SpeedConfig(**self.sections.get("speed", {}))

    def layout(self, width: int, height: int) -> Layout:
        """Returns the section layout: the paper layout unless corners are given."""
        section = self.sections.get("layout", {})
        if "corners" not in section and "taxel" not in section:
            return paper_layout(width, height)
        w, h = section["taxel"]
        return Layout(w, h, tuple((x, y) for x, y in section["corners"]))


def load(path: Path | None) -> Settings:
    """Reads a TOML file. Unknown sections and keys are errors."""
    settings = Settings()
    if path is not None:
        settings.sections = tomllib.loads(path.read_text())
    for section, values in settings.sections.items():
        unknown = [section] if section not in KNOWN else sorted(set(values) - KNOWN[section])
        if unknown:
            raise ValueError(f"{path}: unknown {', '.join(unknown)}")
    return settings


def add_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options that `from_arguments` reads."""
    parser.add_argument("--config", type=Path, help="TOML configuration, as the product reads it")
    parser.add_argument("--matrix", choices=("bt601", "bt709"))
    parser.add_argument("--range", choices=("limited", "full"))
    for name, (_, _, kind) in OPTIONS.items():
        parser.add_argument("--" + name.replace("_", "-"), type=kind)


def from_arguments(arguments: argparse.Namespace) -> Settings:
    """Returns the configuration file with the command line's options applied."""
    settings = load(arguments.config)
    for name, (section, key, _) in OPTIONS.items():
        value = getattr(arguments, name)
        if value is not None:
            settings.sections.setdefault(section, {})[key] = value
    return settings


def parse_fps(text: str) -> Fraction:
    """Parses a frame rate: 30, 29.97, 30000/1001 or 30000:1001."""
    fps = Fraction(text.replace(":", "/"))
    if fps <= 0:
        raise ValueError(f"frame rate {text}")
    return fps
