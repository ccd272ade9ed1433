"""Writes README.md about the models that `wstac trade` compares with the shipped ones. Needs no scikit-learn."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from report import paragraph, table

Line = tuple[str, str, dict[str, Any]]
"""A model: the name of its file, how it is trained and imported, and what `wstac model inspect --json` prints."""


def said_words(said: dict[str, Any]) -> str:
    """The content of a model file."""
    if said["rows"] is not None:
        return f"{said['kind']}, {said['numbers']}, {said['rows']} sums"
    trees = said["trees"]
    return f"{said['kind']}, {trees['count']} trees of depth at most {trees['depth']}, {trees['splits']} splits"


def made_by(page: Path) -> str | None:
    """Returns the sources that a page names for its models; `None` if there is no page, or it names none."""
    found = re.search(r"^Made by sources `([0-9a-f]+)`", page.read_text(), re.MULTILINE) if page.exists() else None
    return found and found[1]


def page(lines: Sequence[Line], slides: str, sources: str) -> str:
    """Returns the page's text. `slides` is in words."""
    intro = paragraph(
        "`wstac trade` compares these models with the shipped ones: they are smaller, have 8-bit weights, or need fewer frames.",
        "All of them name the ten specimens of the simulated sensor.",
        f"They were trained on {slides}, the same as the shipped ones.",
        "An early model reads only the first frames of a sample.",
        "`tests/reference/trade_models.py` makes them.",
    )
    stale = paragraph(
        f"Made by sources `{sources}`, a checksum of the simulator and of the training scripts.",
        "If these change, the models are stale, and `ci/train trade` removes and trains all of them again.",
        "Models of the same sources are kept, so an interrupted training continues.",
        "To train one model again, remove its file; to train all, remove this page.",
    )
    rows = [
        [f"`{name}.wsm`", f"`{words}`", str(said["frames"]), str(said["bytes"]), said_words(said)]
        for name, words, said in lines
    ]
    head = ["file", "trained as", "frames", "bytes", "what `wstac model inspect` says"]
    return f"""# Models of the trade-off study

`ci/train trade` writes these files and this page.
Do not edit them.

{intro}

{stale}

{table(head, rows, (2, 3))}
"""
