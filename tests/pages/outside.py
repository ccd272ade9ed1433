"""A preprocessor of mdBook that adds pages from outside of docs/, and rewrites links that leave it.

A page of docs/ that is only a link to another page of the repository becomes that page. A link to a page of the book, by
whatever name, leads to it in the book. A link to any other file of the repository becomes its path, because the book is
used alone, and the place of the repository is unknown. Code that has a reference in the book (`ci/book api`) leads to that.
"""

from __future__ import annotations

import json
import os
import re
import sys
from pathlib import Path
from urllib.parse import unquote

import pages

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
# A whole link: the text, which may be an image or code, and the target.
WHOLE = re.compile(r"(?<!!)\[((?:!\[[^\]]*\]\([^)]*\)|`[^`]*`|[^\[\]])*)\]\(([^()\s]+)\)")
# The code that stands for a library, and where the library's reference is in the book.
REFERENCE = {
    "wstac-c/include/wstac.h": Path("api/c/wstac_8h.html"),
    "wstac-fw/capi/include/wstac_fw.h": Path("api/c/wstac__fw_8h.html"),
    "wstac-python/wstac/__init__.py": Path("api/python/wstac.html"),
    "wstac-python/wstac/mujoco.py": Path("api/python/wstac/mujoco.html"),
}
CRATE = re.compile(r"^(wstac(?:-[a-z]+)?)/src/lib\.rs$")
IMAGE = re.compile(r"(!\[[^\]]*\])\(([^()\s]+)\)")


def reference(file: str) -> Path | None:
    """Returns where the reference of a library is in the book, by the file that stands for it."""
    if crate := CRATE.match(file):
        return Path(f"api/rust/{crate[1].replace('-', '_')}/index.html")
    return REFERENCE.get(file)


def chapters(items: list) -> list[dict]:
    """Returns all chapters, also those inside others."""
    found = []
    for item in items:
        if isinstance(item, dict) and "Chapter" in item:
            chapter = item["Chapter"]
            found += [chapter, *chapters(chapter["sub_items"])]
    return found


class Book:
    """Finds the place of each page of the repository in the book."""

    def __init__(self, found: list[dict]) -> None:
        self.places: dict[Path, Path] = {}
        for chapter in found:
            page = DOCS / chapter["source_path"]
            # The page that a folder is opened with has another name in the book.
            self.places[page] = Path(chapter["path"])
            if outside := pages.included(page):
                self.places[outside] = Path(chapter["path"])

    def relative(self, to: Path, chapter: Path) -> str:
        """Returns a path as a chapter links to it."""
        return os.path.relpath(to, chapter.parent)

    def link(self, text: str, target: str, base: Path, chapter: Path) -> str:
        """Returns a link as it is in the book."""
        if re.match(r"^[a-z][a-z0-9+.-]*:", target) or target.startswith("#"):
            return f"[{text}]({target})"
        path, _, anchor = unquote(target).partition("#")
        to = (base / path).resolve()
        if place := self.places.get(to):
            return f"[{text}]({self.relative(place, chapter)}{'#' if anchor else ''}{anchor})"
        if to.is_relative_to(DOCS) and to.is_file():
            return f"[{text}]({self.relative(to.relative_to(DOCS), chapter)})"
        inside = str(to.relative_to(ROOT))
        if place := reference(inside):
            return f"[{text}]({self.relative(place, chapter)})"
        if inside in text:
            return text
        return f"`{inside}`" if text.strip("`") == to.name else f"{text} (`{inside}`)"

    def image(self, text: str, target: str, base: Path, chapter: Path) -> str:
        """Returns an image as it is in the book."""
        to = (base / unquote(target)).resolve()
        return f"{text}({self.relative(to.relative_to(DOCS), chapter) if to.is_relative_to(DOCS) else target})"

    def rewrite(self, text: str, base: Path, chapter: Path) -> str:
        """Returns a page's text with the links of the book. Code stays as it is."""
        lines = text.split("\n")
        for number, line in pages.prose(text):
            # Text that looks like a link in a span of code is put aside.
            aside = [found[0] for found in pages.CODE.finditer(line) if "](" in found[0]]
            for place, span in enumerate(aside):
                line = line.replace(span, f"\0{place}\0", 1)
            line = IMAGE.sub(lambda found: self.image(found[1], found[2], base, chapter), line)
            line = WHOLE.sub(lambda found: self.link(found[1], found[2], base, chapter), line)
            for place, span in enumerate(aside):
                line = line.replace(f"\0{place}\0", span, 1)
            lines[number - 1] = line
        return "\n".join(lines)


def main() -> None:
    """Answers mdBook: whether a renderer is supported, or the book."""
    if sys.argv[1:2] == ["supports"]:
        sys.exit(sys.argv[2] != "html")
    context, whole = json.load(sys.stdin)
    found = [chapter for chapter in chapters(whole.get("items", whole.get("sections"))) if chapter.get("source_path")]
    book = Book(found)
    for chapter in found:
        page = DOCS / chapter["source_path"]
        outside = pages.included(page)
        text = outside.read_text(encoding="utf-8") if outside else chapter["content"]
        chapter["content"] = book.rewrite(text, (outside or page).parent, Path(chapter["path"]))
    json.dump(whole, sys.stdout)


if __name__ == "__main__":
    main()
