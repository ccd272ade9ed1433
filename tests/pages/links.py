"""Checks that the targets of links in pages and source files exist. Needs no network: for other sites, only the form is
checked.

    links.py        every link of every markdown page and of every notebook, with its anchor; every path and source file in inline code; every
                    page and stage (docs/….md, ci/…) that a source file names; and that docs/SUMMARY.md has every page of the book
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

import pages

ROOT = Path(__file__).resolve().parents[2]
ELSEWHERE = re.compile(r"^[a-z][a-z0-9+.-]*:")
# A path from the root of the repository. One with a placeholder (`ci/NAME`, `a/…`) names no file.
NAMED = re.compile(r"^(?:\.github|ci|docs|tests|wstac-[a-z]+)/[\w./-]+$")
# A source file by its name, or by the end of its path.
SOURCE_NAMED = re.compile(r"(?:^|\s)([\w./-]+\.(?:rs|py|mjs))(?=::|\s|$)")
PLACEHOLDER = re.compile(r"\bNAME\b|\b[A-Z]{3,}$|…|\*")
IN_SOURCE = re.compile(r"(?<![\w/.-])((?:docs/[\w/-]+\.md)(#[\w-]+)?|ci/[a-z][\w-]*)(?![\w/*])")
SOURCES = {".rs", ".py", ".toml", ".c", ".h", ".sh", ".yml", ".ipynb", ""}
# Files that name files that are gone.
HISTORY = {"CHANGELOG.md"}


class Tree:
    """The files of a repository, and what points to them."""

    def __init__(self, root: Path, files: list[str]) -> None:
        self.root = root
        self.files = set(files)
        self.folders = {str(parent) for file in files for parent in Path(file).parents}
        self.found: dict[str, set[str]] = {}

    def text(self, file: str) -> str:
        """Returns a file's text, or an empty one if it is not text."""
        try:
            return (self.root / file).read_text(encoding="utf-8")
        except UnicodeDecodeError:
            return ""

    def anchors(self, file: str) -> set[str]:
        """Returns the anchors of a page."""
        if file not in self.found:
            self.found[file] = pages.anchors(self.text(file))
        return self.found[file]

    def target(self, file: str, target: str) -> str | None:
        """Returns what is wrong with a link's target, or `None`."""
        if ELSEWHERE.match(target):
            return None if target.startswith(("https://", "mailto:")) else "expected https"
        path, _, anchor = unquote(target).partition("#")
        if path.startswith("/"):
            return "expected a relative path"
        try:
            to = str((self.root / file).parent.joinpath(path).resolve().relative_to(self.root)) if path else file
        except ValueError:
            return "it is outside of the repository"
        if to not in self.files and to not in self.folders:
            return f"there is no {to}"
        if anchor and to.endswith(".md") and anchor not in self.anchors(to):
            return f"{to} has no heading for #{anchor}"
        return None

    def page(self, file: str) -> Iterator[str]:
        """Yields what is wrong with a page, or with the text of a notebook."""
        text = self.text(file)
        if file.endswith(".ipynb"):
            cells = json.loads(text)["cells"]
            text = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
        for line, target in pages.links(text):
            if why := self.target(file, target):
                yield f"{file}:{line}: link to {target}: {why}"
        if Path(file).name in HISTORY:
            return
        for line, span in pages.code(text):
            path = span.split()[0].rstrip("/.,:") if span else ""
            if NAMED.match(path) and not PLACEHOLDER.search(path) and not self.there(file, path):
                yield f"{file}:{line}: `{path}` is named: there is no such file"
            elif not NAMED.match(path):
                for name in SOURCE_NAMED.findall(span):
                    if not PLACEHOLDER.search(name) and not self.ends(name):
                        yield f"{file}:{line}: `{name}` is named: there is no such file"

    def ends(self, name: str) -> bool:
        """Tells whether the path of a file ends like that."""
        return any(f"/{file}".endswith(f"/{name}") for file in self.files)

    def there(self, file: str, path: str) -> bool:
        """Tells whether a path is there: from the root, or from the page that names it."""
        own = str((Path(file).parent / path))
        return any(one in self.files or one in self.folders for one in (path, own))

    def source(self, file: str) -> Iterator[str]:
        """Yields what is wrong with the pages and stages that a source file names."""
        for number, line in enumerate(self.text(file).splitlines(), 1):
            for name, anchor in IN_SOURCE.findall(line):
                path = name.removesuffix(anchor)
                if path not in self.files and path not in self.folders:
                    yield f"{file}:{number}: {path} is named: there is no such file"
                elif anchor and anchor[1:] not in self.anchors(path):
                    yield f"{file}:{number}: {path} has no heading for {anchor}"

    def book(self) -> Iterator[str]:
        """Yields the pages of the book that are missing in its summary."""
        if "docs/SUMMARY.md" in self.files:
            listed = {unquote(target) for _, target in pages.links(self.text("docs/SUMMARY.md"))}
            for file in sorted(self.files):
                page = file.removeprefix("docs/")
                if file.startswith("docs/") and file.endswith(".md") and page != "SUMMARY.md" and page not in listed:
                    yield f"docs/SUMMARY.md: {page} is missing"

    def problems(self) -> Iterator[str]:
        """Yields everything that is wrong."""
        for file in sorted(self.files):
            if file.endswith((".md", ".ipynb")):
                yield from self.page(file)
            if not file.endswith(".md") and Path(file).suffix in SOURCES and not file.startswith(("LICENSE", "tests/pages/")):
                yield from self.source(file)
        yield from self.book()


def main() -> None:
    """Checks the repository, and prints what is wrong."""
    listed = ["git", "-C", ROOT, "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, check=True, capture_output=True, text=True).stdout.split("\0")
    tree = Tree(ROOT, [name for name in names if name and (ROOT / name).is_file()])
    problems = list(tree.problems())
    print("\n".join(problems), file=sys.stderr, end="\n" if problems else "")
    count = sum(1 for file in tree.files if file.endswith(".md") for _ in pages.links(tree.text(file)))
    print(f"links: {count} links, {len(problems)} wrong")
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
