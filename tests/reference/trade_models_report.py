"""Writes README.md about the models that `wstac trade` compares with the shipped ones. Needs no scikit-learn."""

from __future__ import annotations

import re
from pathlib import Path

from report import paragraph


def made_by(page: Path) -> str | None:
    """Returns the sources that a page names for its models; `None` if there is no page, or it names none."""
    found = re.search(r"^Made by sources `([0-9a-f]+)`", page.read_text(), re.MULTILINE) if page.exists() else None
    return found and found[1]


def page(slides: str, sources: str) -> str:
    """Returns the page's text. `slides` is in words."""
    intro = paragraph(
        "`wstac trade` compares these models with the shipped ones: they are smaller, have 8-bit weights, need fewer frames,"
        " or are a network.",
        f"All of them name the ten specimens of the simulated sensor, and were trained on {slides}, the same as the shipped ones.",
        "`tests/reference/trade_models.py` makes them, and `wstac model inspect FILE` says how each was trained.",
    )
    stale = paragraph(
        f"Made by sources `{sources}`, a checksum of the simulator and of the training scripts.",
        "If these change, `ci/train trade` removes and trains all models again; models of the same sources are kept.",
        "To train one model again, remove its file; to train all, remove this page.",
    )
    return f"""# Models of the trade-off study

`ci/train trade` writes these files and this page.
Do not edit them.

{intro}

{stale}
"""
