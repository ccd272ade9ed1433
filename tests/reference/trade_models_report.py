"""README.md about the models that `wstac trade` compares beside the shipped ones. No scikit-learn."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from report import paragraph, table

Line = tuple[str, str, dict[str, Any]]
"""A model: the name of its file, how it is trained and imported, and what `wstac model inspect --json` prints."""


def said_words(said: dict[str, Any]) -> str:
    """What a model file holds."""
    if said["rows"] is not None:
        return f"{said['kind']}, {said['numbers']}, {said['rows']} sums"
    trees = said["trees"]
    return f"{said['kind']}, {trees['count']} trees of depth {trees['depth']} at most, {trees['splits']} splits"


def made_by(page: Path) -> str | None:
    """The sources that made the models beside a page, as it says; nothing where there is no page, or it does not say."""
    found = re.search(r"^Made by sources `([0-9a-f]+)`", page.read_text(), re.MULTILINE) if page.exists() else None
    return found and found[1]


def page(lines: Sequence[Line], slides: str, sources: str) -> str:
    """The page's text: `slides` in words, and which sources made the models."""
    intro = paragraph(
        "What `wstac trade` compares beside the models that are shipped: smaller, narrower, and earlier ones. All name",
        f"the ten specimens of the simulated sensor, and are trained on {slides}, the same that train the shipped ones.",
        "An early model sees the first frames of a sample alone. `tests/reference/trade_models.py` makes them.",
    )
    stale = paragraph(
        f"Made by sources `{sources}`: a checksum of the simulator and of the scripts that train. Models are stale when",
        "these change, and `ci/train trade` then removes them all and trains anew. Models of the same sources are kept:",
        "what was stopped goes on. To train one anew, remove it; to train all, remove this page.",
    )
    rows = [
        [f"`{name}.wsm`", f"`{words}`", str(said["frames"]), str(said["bytes"]), said_words(said)]
        for name, words, said in lines
    ]
    head = ["file", "trained as", "frames", "bytes", "what `wstac model inspect` says"]
    return f"""# Models of the trade

`ci/train trade` writes these files and this page. Do not edit.

{intro}

{stale}

{table(head, rows, (2, 3))}
"""
