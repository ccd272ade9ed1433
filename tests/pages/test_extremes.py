"""Tests that every test on docs/EXTREMES.md exists and runs, and that the page names every test of extremes."""

import re
import tomllib
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Files all of whose tests are on the page.
FILES = [
    *("tests/whole/extremes*.rs", "tests/whole/error_bounds/[!m]*.rs", "tests/long/[!m]*.rs"),
    *("tests/command/hostile.rs", "tests/untouched.rs", "wstac-core/src/model/tests/extremes.rs"),
]


def text(path):
    return (ROOT / path).read_text(encoding="utf-8")


def tests_of(source):
    """Returns the functions with `#[test]` that are neither ignored nor left out by a `#[cfg]`, whatever the order of
    the attributes."""
    found = set()
    for before, name in re.findall(r"((?:^[ \t]*(?:#\[|//)[^\n]*\n)+)[ \t]*fn (\w+)", source, re.MULTILINE):
        attributes = [line.strip() for line in before.splitlines() if line.strip().startswith("#[")]
        if "#[test]" in attributes and not any("ignore" in line or line.startswith("#[cfg") for line in attributes):
            found.add(name)
    return found


def is_run(path):
    """Returns whether `cargo test --workspace` compiles a file: a test or a root of a member, or a module of such a
    file."""
    path = Path(path)
    package = next(folder for folder in path.parents if (ROOT / folder / "Cargo.toml").is_file())
    if not (ROOT / path).is_file() or str(package) not in tomllib.loads(text("Cargo.toml"))["workspace"]["members"]:
        return False
    manifest, inside = tomllib.loads(text(package / "Cargo.toml")), path.relative_to(package)
    finds_tests = manifest["package"].get("autotests", True)
    named = {test["path"] for test in manifest.get("test", []) if "path" in test}
    if str(inside) in {"src/lib.rs", "src/main.rs", *named}:
        return True
    if inside.parent == Path("tests") and finds_tests:
        return True
    folder, name = (path.parent.parent, path.parent.name) if path.stem == "mod" else (path.parent, path.stem)
    parents = [folder / "lib.rs", folder / "main.rs", folder / "mod.rs", folder.with_suffix(".rs")]
    declared = re.compile(rf"^ *(?:pub(?:\(crate\))? )?mod {name};", re.MULTILINE)
    others = [parent for parent in parents if parent != path and (ROOT / parent).is_file()]
    return any(declared.search(text(parent)) and is_run(parent) for parent in others)


def items():
    """Returns the tests that the items of the page's lists end with, in parentheses."""
    found = [line for line in text("docs/EXTREMES.md").splitlines() if line.startswith("- ")]
    return [re.fullmatch(r"- \*\*.+?\*\*: .+ \((`[^()]*`|the same)\)", line)[1] for line in found]


class Extremes(unittest.TestCase):
    def test_every_item_names_a_test_that_runs_and_no_extreme_is_left_out(self):
        lists = re.findall(r"=\((.*)\)$", text("ci/test") + text("ci/long"), re.MULTILINE)
        stages, named = {stage for found in lists for stage in found.split()} | {"long"}, set()
        self.assertLessEqual({"unit", "vm", "fuzz"}, stages)
        self.assertIn("cargo test --locked --workspace", text("ci/unit"))
        self.assertGreater(len(items()), 50)
        for tests in items():
            for name in tests.split(", ") if tests != "the same" else []:
                name = name.strip("`")
                path, _, test = name.partition("::")
                if name.startswith("ci/"):
                    # A script, or what a script does with a word behind it.
                    self.assertIn(name.removeprefix("ci/").split()[-1], stages)
                else:
                    self.assertTrue(is_run(path), path)
                    self.assertIn(test, tests_of(text(path)), path)
                    named.add(name)
        files = [str(path.relative_to(ROOT)) for pattern in FILES for path in ROOT.glob(pattern)]
        self.assertGreater(len(files), 9)
        self.assertEqual({f"{path}::{test}" for path in files for test in tests_of(text(path))} - named, set())


if __name__ == "__main__":
    unittest.main()
