"""Checks that crates depend on each other as rooms.toml says, and that no file reaches around that.

    check.py    every manifest, every file, and how many crates cargo compiles; needs no network once crates are there

Arrows point down and never in a circle. The crates with a budget stay within it and compile no C. Files contain no
module of another package, nothing public that is hidden from the documentation, and no memory that is never freed. No library has
two public types of one name, and no name belongs to types of more than three files. Only tests compare sentences: kinds and reasons are
enumerations, and their words are for people.
Each room stays below its limit of lines, and each function below 100 (lines.py). Files of different folders use each other in no circle
(circles.py). Comments have at most 120 columns.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import circles
import lines as code_lines
from common import reach, sentences_apart

ROOT = Path(__file__).resolve().parents[2]
# Crates whose build scripts compile or look for C.
C_TOOLS = {"bindgen", "cc", "clang-sys", "cmake", "pkg-config", "vcpkg"}
LIBCLANG = {"bindgen", "clang-sys"}
KINDS = {None: "arrows", "build": "build", "dev": "tests"}


@dataclass
class Package:
    """A package of the repository, and the packages of the repository that it depends on, by kind."""

    name: str
    folder: Path
    needs: dict[str, set[str]] = field(default_factory=lambda: {kind: set() for kind in KINDS.values()})

    @property
    def is_room(self) -> bool:
        """Returns whether it is no part of `tests`."""
        return "tests" not in self.folder.parts


def run(*command: str | Path, folder: Path = ROOT) -> str:
    """Returns what a command prints; if it fails, so does the check."""
    return subprocess.run(command, cwd=folder, check=True, stdout=subprocess.PIPE, text=True).stdout


def packages(root: Path, manifests: Iterable[str]) -> dict[str, Package]:
    """Returns the packages of these manifests, by name."""
    found: dict[str, Package] = {}
    for manifest in manifests:
        content = tomllib.loads((root / manifest).read_text(encoding="utf-8"))
        if "package" not in content:
            continue
        package = Package(content["package"]["name"], Path(manifest).parent)
        tables = [content, *content.get("target", {}).values()]
        for table in tables:
            for key, kind in (("dependencies", None), ("build-dependencies", "build"), ("dev-dependencies", "dev")):
                for name, value in table.get(key, {}).items():
                    if isinstance(value, dict) and "path" in value:
                        package.needs[KINDS[kind]].add(value.get("package", name))
        found[package.name] = package
    return found


def wrong_arrows(found: dict[str, Package], rules: dict) -> list[str]:
    """Returns what is wrong with the arrows between packages."""
    wrong = []
    every = {name: set().union(*package.needs.values()) for name, package in found.items()}
    for name, package in sorted(found.items()):
        where = f"{package.folder / 'Cargo.toml'}"
        if name in reach(every, name):
            wrong.append(f"{where}: {name} depends on itself through {', '.join(sorted(every[name]))}")
        if not package.is_room:
            continue
        if name not in rules["arrows"]:
            wrong.append(f"{where}: {name} has no line in tests/graph/rooms.toml, expected what it may depend on")
            continue
        allowed = reach(rules["arrows"], name)
        for kind, needs in package.needs.items():
            extra = set(rules[kind].get(name, ())) if kind != "arrows" else set()
            extra |= {below for direct in extra for below in reach(rules["arrows"], direct)}
            for need in sorted(needs - allowed - extra):
                wrong.append(f"{where}: {name} depends on {need} ({kind}), expected one of {sorted(allowed | extra)}")
    return wrong


MODULE_PATH = re.compile(r'^\s*#\[path = "([^"]+)"\]', re.MULTILINE)
INCLUDED = re.compile(r'\binclude(?:_str|_bytes)?!\(\s*"([^"]+)"')
HIDDEN = re.compile(r"#\[doc\(hidden\)\]\s*(?:(?:#\[[^\]]*\]|//[^\n]*)\s*)*pub (?:const |unsafe |async )*(?:fn|mod|struct|enum|const|static|type|trait|use) (\w+)")
FORGOTTEN = re.compile(r"\b(?:Box|Vec|String)::leak\b|\.leak\(\)")
# A lifetime that is made longer, or a field that points to its own structure.
OWN_POINTER = re.compile(r"\btransmute::<[^;]*&'|^[ \t]*(?:pub\S*\s+)?\w+:\s*(?:\*(?:const|mut) Self|NonNull<Self>)|&'static [^;=\n]*=\s*unsafe\s*\{\s*&(?:mut )?\*|\bPhantomPinned\b", re.MULTILINE)
COMMENT = re.compile(r"//[^\n]*")


def package_of(file: Path, folders: set[Path]) -> Path | None:
    """Returns the folder of the package that a file is part of."""
    return next((parent for parent in file.parents if parent in folders), None)


def without_dots(path: Path) -> Path:
    """Returns a relative path without its `..`."""
    parts: list[str] = []
    for part in path.parts:
        if part == ".." and parts and parts[-1] != "..":
            parts.pop()
        elif part != ".":
            parts.append(part)
    return Path(*parts)


def wrong_in_files(texts: dict[str, str], folders: set[Path], rooms: set[Path]) -> list[str]:
    """Returns what is wrong in source files; `texts` are theirs, by path."""
    wrong = []
    macros = "\n".join(text for text in texts.values() if "#[macro_export]" in text)
    for name, text in sorted(texts.items()):
        file = Path(name)
        own = package_of(file, folders)
        code = COMMENT.sub("", text)

        def report(at: int, message: str, name: str = name, text: str = code) -> None:
            wrong.append(f"{name}:{text.count(chr(10), 0, at) + 1}: {message}")

        reaches = [(found, "#[path]") for found in MODULE_PATH.finditer(code)]
        # Files that a test reads are not published.
        if own in rooms and file.relative_to(own).parts[0] != "tests":
            reaches += [(found, "include!") for found in INCLUDED.finditer(code)]
        for found, what in reaches:
            target = without_dots(file.parent / found[1])
            if package_of(target, folders) != own:
                report(found.start(), f"{what} of {target}, which is no file of this package")
        for found in HIDDEN.finditer(code):
            if not re.search(rf"\$crate::[\w:]*\b{found[1]}\b", macros):
                report(found.start(), f"{found[1]} is public and hidden, expected documented or private")
        if own not in rooms:
            continue
        # A test may lend something for ever: it ends soon.
        for found in FORGOTTEN.finditer("" if file.name == "tests.rs" else code):
            report(found.start(), f"{found[0]}: memory that is never freed, expected an owner")
        for found in OWN_POINTER.finditer(code):
            report(found.start(), f"{found[0].strip()}: a value that points to itself, expected indices or an owner")
    return wrong


# Sentences of other software that have to be recognized by their words, by file, with the reason.
LOG = "rpicam-vid states the sensor and errors in its log alone"
OF_FFMPEG = "ffmpeg says in its log alone which frames it could not decode"
FOREIGN: dict[tuple[str, str], str] = {
    ("wstac-host/src/source/video/ffmpeg.rs", "[info] concealing "): OF_FFMPEG,
    ("wstac-host/src/source/video/ffmpeg.rs", "corrupt decoded frame"): OF_FFMPEG,
    ("wstac-linux/src/rpicam/program.rs", " - Selected sensor format: "): LOG,
    ("wstac-linux/src/rpicam/program.rs", "ERROR: *** "): LOG,
}
TESTS = re.compile(r"^#\[cfg\(test\)\]\s*mod \w+ \{.*?^\}", re.MULTILINE | re.DOTALL)
# Applies to code whose sentences are numbers between @ and whose other literals are empty.
ALONE = r"@(\d+)@"
COMPARED = [
    re.compile(pattern)
    for pattern in (
        rf"[=!]=\s*[&*]*{ALONE}",
        rf"{ALONE}\s*[=!]=",
        rf"\.(?:contains|starts_with|ends_with|r?find|r?split|r?split_once|splitn|strip_prefix|strip_suffix|r?matches|eq|eq_ignore_ascii_case|trim_start_matches|trim_end_matches)\((?:\d+,)?\s*&?{ALONE}",
        rf"{ALONE}[^\[\]()]*\]\s*\.(?:contains|iter\(\)\s*\.(?:any|find|position))\b",
        # A pattern of `match`, `if let` and `let … else`.
        rf'{ALONE}(?:\s*[)\]]|\s*\|\s*(?:@\d+@|""))*\s*(?:if\b[^{{}};=]*)?=>',
        rf"\(\s*{ALONE}\s*,[^()]*\)\s*=>",
        rf"\blet\b[^=;@]*{ALONE}[^=;]*=[^=]",
    )
]
PATTERNS = re.compile(r"\b(?:assert_)?matches!\(")


def is_test(file: Path, package: Path) -> bool:
    """Returns whether a whole file is a test or an example."""
    parts = file.relative_to(package).parts
    return bool({"tests", "examples", "benches"} & set(parts)) or file.stem == "tests" or file.stem.endswith("_tests")


def compared(code: str) -> list[tuple[int, int]]:
    """Returns the places where code compares sentences: the place in the code, and the number of the sentence."""
    found = {(match.start(1), int(match[1])) for pattern in COMPARED for match in pattern.finditer(code)}
    for start in PATTERNS.finditer(code):
        depth, end = 1, start.end()
        while depth and end < len(code):
            depth += {"(": 1, ")": -1}.get(code[end], 0)
            end += 1
        found |= {(match.start(1), int(match[1])) for match in re.compile(ALONE).finditer(code, start.end(), end)}
    return sorted(found)


def wrong_sentences(texts: dict[str, str], rooms: set[Path], foreign: dict[tuple[str, str], str]) -> list[str]:
    """Returns the places where code outside tests compares sentences. Those in `foreign` may be compared, and have to
    be.
    """
    wrong, left = [], set(foreign)
    for name, text in sorted(texts.items()):
        own = package_of(Path(name), rooms)
        if own is None or is_test(Path(name), own):
            continue
        code, sentences = sentences_apart(TESTS.sub(lambda found: "\n" * found[0].count("\n"), text))
        for at, number in compared(code):
            place = (name, sentences[number])
            left.discard(place)
            if place not in foreign:
                line = code.count("\n", 0, at) + 1
                wrong.append(f'{name}:{line}: compares the sentence "{sentences[number]}", expected an enumeration')
    return wrong + [f'{name}: compares no sentence "{text}"; help: delete its line in FOREIGN' for name, text in sorted(left)]


PUBLIC_TYPE = re.compile(r"^[ \t]*pub (?:unsafe )?(?:struct|enum|union|trait|type) (\w+)", re.MULTILINE)


def wrong_names(texts: dict[str, str], found: dict[str, Package], exceptions: dict[str, dict[str, str]]) -> list[str]:
    """Returns the names that two public types of a library have; those in `exceptions` may, and have to."""
    wrong = []
    for name, package in sorted(found.items()):
        source = package.folder / "src"
        if not package.is_room or str(source / "lib.rs") not in texts:
            continue
        places: dict[str, list[str]] = {}
        for file, text in sorted(texts.items()):
            # Each file of `bin` is a crate of its own.
            if source not in Path(file).parents or source / "bin" in Path(file).parents or is_test(Path(file), package.folder):
                continue
            code = sentences_apart(TESTS.sub(lambda found: "\n" * found[0].count("\n"), text))[0]
            for match in PUBLIC_TYPE.finditer(code):
                places.setdefault(match[1], []).append(f"{file}:{code.count(chr(10), 0, match.start(1)) + 1}")
        twice = {called: where for called, where in places.items() if len(where) > 1}
        allowed = exceptions.get(name, {})
        for called in sorted(twice.keys() - allowed.keys()):
            wrong.append(f"{', '.join(twice[called])}: {len(twice[called])} public types {called}, expected another name for each")
        for called in sorted(allowed.keys() - twice.keys()):
            wrong.append(f"tests/graph/rooms.toml: {name} has no two types {called}; help: delete the line in [twice]")
    return wrong


TYPE = re.compile(r"^[ \t]*(?:pub(?:\([^)]*\))? )?(?:unsafe )?(?:struct|enum|union|trait) (\w+)", re.MULTILINE)
# In more files than that, a name no longer says which type it is.
MOST_OF_A_NAME = 3


def wrong_shared_names(texts: dict[str, str], rooms: set[Path], exceptions: dict[str, str]) -> list[str]:
    """Returns the names that types of too many files have, in all rooms together; those in `exceptions` may, and have
    to.
    """
    places: dict[str, list[str]] = {}
    for file, text in sorted(texts.items()):
        own = package_of(Path(file), rooms)
        if own is not None and not is_test(Path(file), own):
            code = sentences_apart(TESTS.sub("", text))[0]
            for called in sorted({match[1] for match in TYPE.finditer(code)}):
                places.setdefault(called, []).append(file)
    shared = {called: where for called, where in places.items() if len(where) > MOST_OF_A_NAME}
    wrong = [
        f"{', '.join(shared[called])}: types {called} in {len(shared[called])} files, expected at most {MOST_OF_A_NAME}"
        for called in sorted(shared.keys() - exceptions.keys())
    ]
    left = sorted(exceptions.keys() - shared.keys())
    return wrong + [f"tests/graph/rooms.toml: {called} is the name of at most {MOST_OF_A_NAME} types; help: delete the line in [shared]" for called in left]


def tree(name: str, *options: str) -> set[str]:
    """Returns the crates that cargo compiles for a package, itself included: names and versions."""
    lines = run("cargo", "tree", "--locked", "--package", name, "--prefix", "none", "--format", "{p}", *options)
    return {" ".join(line.split()[:2]) for line in lines.splitlines() if line}


def wrong_counts(rules: dict, links: dict[str, str | None], trees=tree) -> tuple[list[str], dict[str, int]]:
    """Returns what is wrong with the crates that have a budget, and how many crates each of them takes."""
    wrong, counts = [], {}
    for name, rule in rules["crates"].items():
        off = ["--no-default-features"] if rule["features"] == "none" else []
        compiled = trees(name, "--edges", "normal", *off)
        counts[name] = len(compiled)
        if len(compiled) >= rule["fewer_than"]:
            wrong.append(f"{name}: {len(compiled)} crates, expected fewer than {rule['fewer_than']}")
        for crate in sorted(compiled | trees(name, "--edges", "normal,build", *off)):
            called = crate.split()[0]
            if called in C_TOOLS or called.endswith("-sys"):
                wrong.append(f"{name}: needs {called}, expected Rust alone")
            elif links.get(crate):
                wrong.append(f"{name}: needs {called}, which links the library {links[crate]}, expected Rust alone")
    return wrong, counts


def wrong_libclang(found: dict[str, Package], members: set[str], trees=tree) -> list[str]:
    """Returns the crates whose build needs libclang."""
    wrong = []
    for name in sorted(members):
        if found[name].is_room:
            needed = {crate.split()[0] for crate in trees(name, "--edges", "normal,build")} & LIBCLANG
            wrong += [f"{name}: needs {', '.join(sorted(needed))}, expected no libclang"] if needed else []
    return wrong


def long_comments(texts: dict[str, str]) -> list[str]:
    """Returns comments of more than 120 columns, which rustfmt does not wrap. Tables and what a program made may be wider."""
    numbered = ((file, number, line) for file, text in texts.items() for number, line in enumerate(text.splitlines(), 1))
    long = ((file, number) for file, number, line in numbered if len(line) > 120 and re.match(r"\s*//[/!]? +[^|]", line) and not line.endswith("\\"))
    return [f"{file}:{number}: a comment has more than 120 columns" for file, number in long if "bindings" not in file]


def long_python(sources: dict[str, str]) -> list[str]:
    """Returns lines of the rooms' Python with more than 120 columns. An import whose comment types need stays on its line."""
    of_rooms = ((file, text) for file, text in sources.items() if file.startswith("wstac-") and file.endswith((".py", ".pyi")))
    numbered = ((file, number, line) for file, text in of_rooms for number, line in enumerate(text.splitlines(), 1))
    long = ((file, number) for file, number, line in numbered if len(line) > 120 and "# type: ignore[" not in line)
    return [f"{file}:{number}: has more than 120 columns" for file, number in long]


def main() -> None:
    rules = tomllib.loads((Path(__file__).parent / "rooms.toml").read_text(encoding="utf-8"))
    files = run("git", "ls-files", "--cached", "--others", "--exclude-standard").splitlines()
    files = [file for file in files if (ROOT / file).is_file()]
    found = packages(ROOT, (file for file in files if Path(file).name == "Cargo.toml"))
    folders = {package.folder for package in found.values()}
    rooms = {package.folder for package in found.values() if package.is_room}
    sources = {file: (ROOT / file).read_text(encoding="utf-8", errors="replace") for file in files if Path(file).suffix in code_lines.OF_CHECKS}
    texts = {file: text for file, text in sources.items() if file.endswith(".rs")}
    wrong = wrong_arrows(found, rules) + wrong_in_files(texts, folders, rooms) + wrong_sentences(texts, rooms, FOREIGN)
    wrong += long_comments(texts) + long_python(sources)
    wrong += wrong_shared_names(texts, rooms, rules["shared"])
    wrong += wrong_names(texts, found, rules["twice"]) + code_lines.wrong_lengths(texts, rules["long"])
    too_large, table = code_lines.wrong_rooms(*code_lines.counted(sources), rules["lines"])
    in_circles, forgiven = circles.wrong_circles(texts, rooms, rules["circles"])
    wrong += too_large + in_circles

    metadata = json.loads(run("cargo", "metadata", "--locked", "--format-version", "1"))
    links = {f"{package['name']} v{package['version']}": package["links"] for package in metadata["packages"]}
    members = {package["name"] for package in metadata["packages"] if package["id"] in metadata["workspace_members"]}
    over, counts = wrong_counts(rules, links)
    wrong += over + wrong_libclang(found, members)
    if wrong:
        sys.exit("\n".join(wrong))
    print("\n".join([table, *forgiven]))
    said = ", ".join(f"{name} {count} of fewer than {rules['crates'][name]['fewer_than']}" for name, count in counts.items())
    print(f"graph: {len(found)} packages without a circle or a wrong arrow; crates without features: {said}")


if __name__ == "__main__":
    main()
