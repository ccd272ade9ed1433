"""Counts the code of each room and that of all checks, and holds it below rooms.toml's limits. Blank lines, comments, docstrings and what
a tool writes do not count."""

from __future__ import annotations

import ast
import re
from collections import Counter
from pathlib import PurePath

# A module of unit tests within a file: up to the brace in the column of its first word.
INLINE_TESTS = re.compile(r"^( *)#\[cfg\((?:all\()?test\b[^\n]*\]\n(?: *#\[[^\n]*\]\n)*\1(?:pub )?mod \w+ \{\n.*?^\1\}\n", re.MULTILINE | re.DOTALL)
# A module of unit tests in a file of its own.
TEST_FILE = re.compile(r"^ *#\[cfg\((?:all\()?test\b[^\n]*\]\n *(?:pub(?:\([^)]*\))? )?mod (\w+);", re.MULTILINE)
# A function with a body. A semicolon in its head is one of an array's type.
FUNCTION = re.compile(
    r"^( *)(?:pub(?:\([^)]*\))? )?(?:default |const |async |unsafe |extern \"C\" )*fn (\w+)((?:[^{;]|;(?=[^\n\]]*\]))*\{\n.*?^\1\}\n)",
    re.MULTILINE | re.DOTALL,
)
# The most lines of a function.
LONGEST = 100
WRITTEN_BY_TOOLS = (
    "wstac-linux/v4l2-sys/",
    "wstac-python/python/wstac/_wstac.pyi",
    "wstac-train/src/model/onnx/messages.rs",
    "wstac-host/src/record/foxglove/messages.rs",
)
COMMENTS = {".rs": ("//",), ".py": ("#",), ".js": ("//",), ".mjs": ("//",), ".css": ("/*", "*"), ".h": ("//", "/*", "*"), ".pyi": ("#",)}
# Those of checks; a script has no ending.
OF_CHECKS = {**COMMENTS, ".c": COMMENTS[".h"], ".sh": ("#",), "": ("#",)}


def is_test(file: str) -> bool:
    """Returns whether a file has tests alone, by its name."""
    path = PurePath(file)
    return bool({"tests", "benches", "test"} & set(path.parts[:-1])) or path.name == "tests.rs" or path.stem.endswith("_tests")


def product(texts: dict[str, str]) -> dict[str, str]:
    """Returns the files of the rooms that are neither tests nor written by a tool; those in Rust without their inline tests."""
    tests: set[str] = set()
    for file, text in texts.items():
        path = PurePath(file)
        folder = path.parent if path.stem in {"lib", "main", "mod"} else path.with_suffix("")
        tests |= {f"{folder / name}{end}" for name in TEST_FILE.findall(text) for end in (".rs", "/mod.rs")}
    of_rooms = {
        file: text
        for file, text in texts.items()
        if file.startswith(("wstac-", "wstac/")) and not is_test(file) and file not in tests and not file.startswith(WRITTEN_BY_TOOLS)
    }
    return {file: INLINE_TESTS.sub("", text) if file.endswith(".rs") else text for file, text in of_rooms.items()}


def room_of(file: str) -> str:
    """Returns the room of a file: its first folder, and the one of both interfaces for C."""
    return "wstac-c" if file.startswith("wstac-fw/capi/") else PurePath(file).parts[0]


def code(text: str, comments: tuple[str, ...]) -> int:
    """Returns the lines that are neither blank nor comments."""
    lines = (line.strip() for line in text.splitlines())
    return sum(1 for line in lines if line and not line.startswith(comments))


def without_docstrings(text: str) -> str:
    """Returns Python without its docstrings, and without other texts that stand alone."""
    lines = text.splitlines()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            lines[node.lineno - 1 : node.end_lineno] = [""] * (node.end_lineno - node.lineno + 1)
    return "\n".join(lines)


def counted(texts: dict[str, str]) -> tuple[Counter[str], Counter[str]]:
    """Returns the lines of Rust by room, and those of other languages and of all checks."""
    rust: Counter[str] = Counter()
    other: Counter[str] = Counter()
    texts = {file: without_docstrings(text) if file.endswith((".py", ".pyi")) else text for file, text in texts.items()}
    rooms = product(texts)
    for file, text in texts.items():
        suffix = PurePath(file).suffix
        is_check = file.startswith(("tests/", "ci/")) and (suffix or text.startswith("#!"))
        comments = (OF_CHECKS if is_check else COMMENTS).get(suffix)
        if comments is None or file.startswith(WRITTEN_BY_TOOLS):
            continue
        lines = code(rooms.get(file, ""), comments)
        if suffix == ".rs":
            rust[room_of(file)] += lines
        else:
            other["other languages"] += lines
        other["tests and ci"] += code(text, comments) - lines
    return +rust, +other


def wrong_lengths(texts: dict[str, str], allowed: dict[str, str]) -> list[str]:
    """Returns functions of more than 100 lines that rooms.toml does not allow, and what it allows for nothing."""
    long = {}
    for file, text in product(texts).items():
        for _, name, rest in FUNCTION.findall(text) if file.endswith(".rs") else []:
            if rest.count("\n") > LONGEST:
                long[f"{file}:{name}"] = rest.count("\n")
    wrong = [f"{place}: a function of {lines} lines, expected at most {LONGEST}" for place, lines in sorted(long.items()) if place not in allowed]
    return wrong + [f"tests/graph/rooms.toml: {place} has no more than {LONGEST} lines; help: delete the line in [long]" for place in sorted(allowed.keys() - long.keys())]


def wrong_rooms(rust: Counter[str], other: Counter[str], budgets: dict[str, dict[str, int]]) -> tuple[list[str], str]:
    """Returns the rooms above their limits, and the table of all."""
    wrong, rows = [], []
    found = {**rust, **other}
    for room, lines in sorted(found.items()):
        budget = budgets.get(room)
        if budget is None:
            wrong.append(f"tests/graph/rooms.toml: {room} has no budget of lines")
            continue
        if lines > budget["most"]:
            wrong.append(f"{room}: {lines} lines of code, expected at most {budget['most']}")
        rows.append(f"{room:<16} {lines:>7} {budget['most']:>7} {budget['goal']:>7}")
    wrong += [f"tests/graph/rooms.toml: {room} has a budget of lines and no code" for room in sorted(budgets.keys() - found.keys())]
    all_rust, goal = rust.total(), sum(budget["goal"] for room, budget in budgets.items() if room in rust)
    most = sum(budget["most"] for room, budget in budgets.items() if room in rust)
    head = f"{'lines of code':<16} {'now':>7} {'most':>7} {'goal':>7}"
    return wrong, "\n".join([head, *rows, f"{'all Rust':<16} {all_rust:>7} {most:>7} {goal:>7}"])
