"""Finds circles of uses between files of different folders of a crate.

A file uses the file that defines what a `use` or a path of its code names; `pub use` is followed to there. A file that has
modules below it is of their folder, like `mod.rs`. No uses are `mod x;`, a `pub use` of something below, tests, comments, and
whatever an ancestor defines: modules may rely on what is common to their folder.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import PurePath

import lines
from common import reach, sentences_apart

Module = tuple[str, ...]
# An item or a statement for tests alone.
TEST = re.compile(r"^( *)#\[cfg\((?:all\()?test\b[^\n]*\]\n(?:[^\n;{]*(?:\{[^\n{}]*\})?;|.*?^\1\})", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"^( *)(?:pub(?:\([^)]*\))? )?mod \w+ \{\n.*?^\1\}", re.MULTILINE | re.DOTALL)
USE = re.compile(r"^ *(pub(?:\([^)]*\))? )?use ([^;]+);", re.MULTILINE)
GROUP = re.compile(r"([\w:]*)\{([^{}]*)\}")
PATH = re.compile(r"(?<![\w:])(?:\w+::)+\w+")
DEFINED = re.compile(r"\b(?:fn|struct|enum|union|trait|type|const|static|mod|macro_rules!) (\w+)")


def imported(tree: str) -> Iterator[tuple[list[str], str]]:
    """Returns the paths of a `use`, each with the name that it gives."""
    while "{" in tree:
        tree = GROUP.sub(lambda group: ",".join(group[1] + part.strip() for part in group[2].split(",") if part.strip()), tree)
    for part in tree.split(","):
        path, _, name = part.strip().removesuffix("::self").partition(" as ")
        names = path.removesuffix("::self").split("::")
        yield names, name or names[-1]


class Crate:
    """The files of a crate, by module."""

    def __init__(self, texts: dict[PurePath, str]) -> None:
        """Takes the files by their paths below `src`."""
        self.files, self.paths, self.uses, self.defined = {}, {}, {}, {}
        for file, text in texts.items():
            module = file.parent.parts if file.stem in {"lib", "main", "mod"} else file.with_suffix("").parts
            code = TEST.sub("", sentences_apart(text)[0])
            code = INLINE.sub(lambda found: re.sub(r"(?<!::)\bsuper::", "self::", found[0]), code)
            self.files[module], self.paths[module], self.defined[module] = file, PATH.findall(USE.sub("", code)), set(DEFINED.findall(code))
            self.uses[module] = [(bool(public), *leaf) for public, tree in USE.findall(code) for leaf in imported(tree)]
        self.arrows = {module: self.used(module) for module in self.files}

    def folder(self, module: Module) -> str:
        """Returns the folder of a module's file."""
        return "/".join(module if any(len(other) > len(module) and other[: len(module)] == module for other in self.files) else module[:-1])

    def resolve(self, at: Module, path: list[str], depth: int = 0) -> Module:
        """Returns the module that defines what a path names within another one: that one itself if another crate does."""
        for place, part in enumerate(path if depth < 9 else []):
            if part in {"crate", "super"}:
                at = at[:-1] if part == "super" else ()
            elif (*at, part) in self.files:
                at = (*at, part)
            elif part not in {"self", "*"}:
                for _, target, name in self.uses[at]:
                    if name == part:
                        return self.resolve(at, target + path[place + 1 :], depth + 1)
                globs = [self.resolve(at, [*target[:-1], part], depth + 1) for _, target, name in self.uses[at] if name == "*"]
                return next((module for module in [at, *globs] if part in self.defined[module]), at)
        return at

    def used(self, module: Module) -> dict[Module, str]:
        """Returns the modules that one uses, each with a path that leads there."""
        found: dict[Module, str] = {}
        paths = [(public, path) for public, path, _ in self.uses[module]]
        for public, path in paths + [(False, path.split("::")) for path in self.paths[module]]:
            to = self.resolve(module, path)
            if to != module[: len(to)] and not (public and to[: len(module)] == module):
                found.setdefault(to, "::".join(path))
        return found

    def circles(self) -> Iterator[tuple[str, str]]:
        """Returns the circles between folders: those folders, and the shortest circle of each."""
        reached = {module: reach(self.arrows, module) for module in self.arrows}
        parts = {frozenset(to for to in reached[module] if module in reached[to]) for module in self.arrows}
        for part in parts:
            folders = sorted({self.folder(module) for module in part})
            if len(folders) > 1:
                ways = [way for start in part for way in self.ways(start, part) if len({self.folder(module) for module in way}) > 1]
                way = min(ways, key=lambda way: (len(way), way))
                steps = (f" uses {self.arrows[a][b]} of {self.files[b]}" for a, b in zip(way, way[1:]))
                yield ", ".join(folder or "src" for folder in folders), f"{self.files[way[0]]}" + ", which".join(steps)

    def ways(self, start: Module, part: frozenset[Module]) -> Iterator[list[Module]]:
        """Returns the shortest ways from a module over each of those that it uses and back."""
        for first in self.arrows[start].keys() & part:
            ahead, seen = [[start, first]], {first}
            for way in ahead:
                if way[-1] == start:
                    yield way
                    break
                ahead += [[*way, to] for to in sorted(self.arrows[way[-1]].keys() & part - seen)]
                seen |= self.arrows[way[-1]].keys()


def wrong_circles(texts: dict[str, str], crates: Iterable[PurePath], forgiven: dict[str, str]) -> tuple[list[str], list[str]]:
    """Returns the circles that are not forgiven and what is forgiven for nothing, and the forgiven ones with their reasons."""
    product = {PurePath(file): text for file, text in lines.product(texts).items() if file.endswith(".rs")}
    found = {}
    for crate in crates:
        source = crate / "src"
        files = {file.relative_to(source): text for file, text in product.items() if source in file.parents and source / "bin" not in file.parents}
        found |= {f"{crate}: {folders}": f"{source}: {circle}" for folders, circle in Crate(files).circles()}
    wrong = [f'{circle}: a circle, expected none; one that stays has a line "{place}" with its reason in [circles]' for place, circle in sorted(found.items()) if place not in forgiven]
    wrong += [f'tests/graph/rooms.toml: no circle "{place}" any more; help: delete its line in [circles]' for place in sorted(forgiven.keys() - found.keys())]
    return wrong, [f"{circle}: a circle, forgiven: {forgiven[place]}" for place, circle in sorted(found.items()) if place in forgiven]
