"""The product's TOML configuration."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from .layout import Layout, paper_layout
from .speed import SpeedConfig
from .trigger import TriggerConfig

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
    """The configuration, section by section."""

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


def load(path: Path) -> Settings:
    """Reads a TOML file. Unknown sections and keys are errors."""
    settings = Settings(tomllib.loads(path.read_text()))
    for section, values in settings.sections.items():
        unknown = [section] if section not in KNOWN else sorted(set(values) - KNOWN[section])
        if unknown:
            raise ValueError(f"{path}: unknown {', '.join(unknown)}")
    return settings
