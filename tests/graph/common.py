"""What several checks of the graph do: reaching along arrows, and taking comments and literals out of code."""

from __future__ import annotations

import re
from collections.abc import Iterable

TOKEN = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)|b?r(?P<marks>#*)"(?P<raw>.*?)"(?P=marks)|b?"(?P<text>(?:[^"\\]|\\.)*)"|b?'(?:[^'\\\n]|\\.[^'\n]*)'""",
    re.DOTALL,
)
SENTENCE = re.compile(r"(?=.*[^\W\d_])\S.* \S|\S \S.*[^\W\d_]", re.DOTALL)


def reach(arrows: dict[str, Iterable[str]], name: str) -> set[str]:
    """Returns everything that can be reached from a crate. The crate itself is included only if it is in a circle."""
    seen: set[str] = set()
    ahead = list(arrows.get(name, ()))
    while ahead:
        at = ahead.pop()
        if at not in seen:
            seen.add(at)
            ahead.extend(arrows.get(at, ()))
    return seen


def sentences_apart(code: str) -> tuple[str, list[str]]:
    """Returns code without comments and literals, and its literals that are sentences. Lines stay where they are."""
    sentences: list[str] = []

    def replace(found: re.Match[str]) -> str:
        lines = "\n" * found[0].count("\n")
        if found["comment"] is not None:
            return lines
        text = found["raw"] if found["raw"] is not None else found["text"]
        if text is None or not SENTENCE.search(text):
            return '""' + lines
        sentences.append(text)
        return f"@{len(sentences) - 1}@{lines}"

    return TOKEN.sub(replace, code), sentences
