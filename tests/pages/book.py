"""Checks that every link and every picture of a built book leads to something in it, also in the reference of the libraries.

    book.py FOLDER
"""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """Collects the links and the anchors of one page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.anchors: set[str] = set()
        self.moved: str | None = None
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        """Collects the target and the name of an element, and where a page sends its reader."""
        given = dict(attributes)
        if tag == "meta" and (given.get("http-equiv") or "").lower() == "refresh":
            self.moved = (given.get("content") or "").partition("=")[2]
            self.targets.append(self.moved)
        for name, value in attributes:
            if name in ("href", "src") and value:
                self.targets.append(value)
            elif name in ("id", "name") and value:
                self.anchors.add(value)


def leads(fragment: str, page: Page, path: Path) -> bool:
    """Returns whether a page has what a fragment names, as it is or decoded. A page of code has lines, also from one to another."""
    names = fragment.split("-") if re.fullmatch(r"\d+-\d+", fragment) and path.name.endswith(".rs.html") else [fragment]
    return all(name in page.anchors or unquote(name) in page.anchors for name in names)


def main() -> None:
    """Prints what is wrong with a book."""
    folder = Path(sys.argv[1]).resolve()
    # These are made for other sites, and not for readers.
    found = {path: Page(path.read_text(encoding="utf-8")) for path in folder.rglob("*.html") if path.name not in ("404.html", "toc.html")}
    problems, count = [], 0
    for path, page in sorted(found.items()):
        for target in page.targets:
            url = urlsplit(target)
            if url.scheme or url.netloc:
                continue
            count += 1
            to = (path.parent / unquote(url.path)).resolve() if url.path else path
            if to.is_dir():
                to /= "index.html"
            if not to.is_file():
                problems.append(f"{path.relative_to(folder)}: there is no {target}")
                continue
            # A page that only sends its reader to another one takes the fragment along.
            while to in found and (moved := found[to].moved):
                to = (to.parent / unquote(moved)).resolve()
            if url.fragment and to in found and not leads(url.fragment, found[to], to):
                problems.append(f"{path.relative_to(folder)}: there is no heading for {target}")
    print("\n".join(problems), file=sys.stderr, end="\n" if problems else "")
    print(f"book: {len(found)} pages, {count} links, {len(problems)} wrong")
    sys.exit(bool(problems) or len(found) < 10)


if __name__ == "__main__":
    main()
