"""Tests that docs/TESTING.md says where every script of ci/ runs."""

import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CI = ROOT / "ci"
# Scripts that other scripts call, or that set up, build, or only print.
HELPERS = {"test", "long", "check", "setup", "tool", "build", "demo"}
# Scripts that do several things: the word behind their name says which.
GROUPS = {"long", "boards", "book", "crates", "generated", "measure", "node", "pages", "release"}


def rows():
    """Returns the table's rows as lists of cells: check, scripts, and what ci/test and ci/long run of it. The list behind it has
    what only ci/long runs."""
    text = (ROOT / "docs/TESTING.md").read_text().split("## Every check")[1].split("##")[0]
    table, alone = text.split("Only `ci/long` checks these:")
    lines = [line for line in table.splitlines() if line.startswith("| ") and "`ci/" in line]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[1:]]
    return cells + [[check, scripts, "", "yes"] for check, scripts in re.findall(r"^- (.*): (`ci/.*)$", alone, re.MULTILINE)]


def scripts(cell):
    """Returns the scripts that a cell names."""
    return set(re.findall(r"`ci/([\w-]+)", cell))


def checks(text):
    """Returns what a text calls: a script, or the word that says what a script does."""
    found = re.findall(r"\bci/([\w-]+)(?: ([a-z]\w*))?", text)
    return {word if word and script in GROUPS else script for script, word in found}


def stages(name):
    """Returns the names in a script's lists: name=(stage …)."""
    found = re.findall(r"^(?:host|boards|any|alone|parts)=\((.*)\)$", (CI / name).read_text(), re.MULTILINE)
    return {stage for line in found for stage in line.split()}


def called(stage):
    """Returns what the script of a stage calls, or the function of a part of ci/long."""
    function = re.search(rf"^{stage}\(\) (.*?[)}}])$", (CI / "long").read_text(), re.MULTILINE | re.DOTALL)
    script = CI / stage
    lines = script.read_text().splitlines() if script.exists() else function[1].splitlines()
    return {name for line in lines if not line.startswith("#") for name in checks(line)}


class Testing(unittest.TestCase):
    def test_every_script_is_named(self):
        named = scripts((ROOT / "docs/TESTING.md").read_text())
        self.assertEqual({path.name for path in CI.iterdir()} - HELPERS - named, set())

    def test_there_are_few_scripts_and_none_is_long(self):
        self.assertLessEqual(len(list(CI.iterdir())), 32)
        for path in CI.iterdir():
            self.assertLessEqual(len(path.read_text().splitlines()), 120, path)

    def test_every_stage_of_ci_test_is_in_its_column(self):
        column = {check for row in rows() if row[2] for check in checks(row[1])}
        self.assertGreater(len(stages("test")), 8)
        self.assertLessEqual(len(stages("test")), 12)
        self.assertEqual(stages("test") - column, set())

    def test_every_part_of_ci_long_is_in_its_column(self):
        column = {check for row in rows() if row[3] for check in checks(row[1])}
        self.assertGreater(len(stages("long")), 10)
        self.assertEqual(stages("long") - column, set())

    def test_what_is_in_a_column_is_run_there(self):
        for row in rows():
            # Includes the scripts that a stage calls, as ci/lint calls ci/words.
            run = [stages(name).union(*(called(stage) for stage in stages(name))) for name in ("test", "long")]
            for command, cell in zip(run, row[2:4], strict=True):
                if cell:
                    self.assertTrue(checks(row[1]) & command, row)


if __name__ == "__main__":
    unittest.main()
