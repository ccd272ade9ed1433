"""Markdown pages of the repository: their text without code, their links, and the anchors of their headings."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

FENCE = re.compile(r"^ {0,3}(```+|~~~+)")
CODE = re.compile(r"(`+)(.+?)(?<!`)\1(?!`)")
# The target of a link in brackets: [text](target "title"), also of an image inside a link.
LINK = re.compile(r"\]\(\s*<?([^()\s>]*(?:\([^()\s]*\)[^()\s>]*)*)>?(?:\s+\"[^\"]*\")?\s*\)")
REFERENCE = re.compile(r"^ {0,3}\[[^\]]+\]:\s+<?(\S+?)>?\s*$")
ATTRIBUTE = re.compile(r"<[a-zA-Z][^>]*\s(?:href|src)=[\"']([^\"']+)[\"']")
IDENTIFIER = re.compile(r"<[a-zA-Z][^>]*\s(?:id|name)=[\"']([^\"']+)[\"']")
HEADING = re.compile(r"^ {0,3}#{1,6}\s+(.*?)\s*#*\s*$")
# A page that is a link and nothing else, which a code host shows as one.
ONLY = re.compile(r"\[[^\]]+\]\((\.\./[^()#\s]+\.md)\)")


def prose(text: str) -> Iterator[tuple[int, str]]:
    """Yields the numbered lines that are not in a code block."""
    fence = None
    before_blank = True
    for number, line in enumerate(text.splitlines(), 1):
        mark = FENCE.match(line)
        if fence:
            if mark and mark[1].startswith(fence):
                fence = None
            continue
        if mark:
            fence = mark[1]
            continue
        # An indented block is code if it follows a blank line or more of itself.
        if before_blank and line.startswith("    "):
            continue
        before_blank = not line.strip()
        yield number, line


def links(text: str) -> Iterator[tuple[int, str]]:
    """Yields the line and the target of every link and image."""
    for number, line in prose(text):
        line = CODE.sub("", line)
        for pattern in (LINK, REFERENCE, ATTRIBUTE):
            yield from ((number, found[1]) for found in pattern.finditer(line))


def code(text: str) -> Iterator[tuple[int, str]]:
    """Yields the line and the text of every span of inline code."""
    for number, line in prose(text):
        yield from ((number, found[2].strip()) for found in CODE.finditer(line))


def slug(heading: str) -> str:
    """Returns the anchor that GitHub and mdBook give to a heading."""
    heading = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").replace("*", "")
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def anchors(text: str) -> set[str]:
    """Returns every anchor of a page."""
    found: set[str] = set()
    count: dict[str, int] = {}
    for _, line in prose(text):
        found.update(IDENTIFIER.findall(line))
        if heading := HEADING.match(line):
            name = slug(heading[1])
            again = count.get(name, 0)
            count[name] = again + 1
            found.add(f"{name}-{again}" if again else name)
    return found


def included(path: Path) -> Path | None:
    """Returns the page that a page stands for in the book, if it is nothing but a link to it."""
    only = ONLY.fullmatch(path.read_text(encoding="utf-8").strip())
    return (path.parent / only[1]).resolve() if only else None
