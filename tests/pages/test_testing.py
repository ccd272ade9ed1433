"""Tests that docs/TESTING.md says where every script of ci/ runs."""

import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CI = ROOT / "ci"
# Scripts that other scripts call, or that set up, build, or only print.
HELPERS = {"test", "long", "check", "setup", "oldest", "python", "packages.sh", "semver-baseline", "thumb", "tool", "wstac", "deb", "demo", "notices", "libwstac", "libwstac-fw", "signal"}


def rows():
    """Returns the table's rows as lists of cells: check, scripts, and where each command runs it."""
    text = (ROOT / "docs/TESTING.md").read_text().split("## Every check")[1].split("##")[0]
    lines = [line for line in text.splitlines() if line.startswith("| ") and "`ci/" in line]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[1:]]


def scripts(cell):
    """Returns the scripts that a cell names."""
    return set(re.findall(r"`ci/([\w-]+)", cell))


def stages(name):
    """Returns the names in a script's lists: name=(stage …)."""
    found = re.findall(r"^(?:host|boards|any|alone|parts)=\((.*)\)$", (CI / name).read_text(), re.MULTILINE)
    return {stage for line in found for stage in line.split()}


def called(stage):
    """Returns the scripts that a stage's script calls, or none for a part of ci/long that is not a script of its own."""
    script = CI / stage
    lines = script.read_text().splitlines() if script.exists() else []
    return {name for line in lines if not line.startswith("#") for name in re.findall(r"\bci/([\w-]+)", line)}


class Testing(unittest.TestCase):
    def test_every_script_is_named(self):
        named = scripts((ROOT / "docs/TESTING.md").read_text())
        self.assertEqual({path.name for path in CI.iterdir()} - HELPERS - named, set())

    def test_every_stage_of_ci_test_is_in_its_column(self):
        column = {script for row in rows() if row[3] for script in scripts(row[1])}
        self.assertGreater(len(stages("test")), 8)
        self.assertLessEqual(len(stages("test")), 12)
        self.assertEqual(stages("test") - column, set())

    def test_every_part_of_ci_long_is_in_its_column(self):
        column = {script for row in rows() if row[4] for script in scripts(row[1])}
        column |= {part for row in rows() if row[4] for part in re.findall(r"`ci/long (\w+)`", row[1])}
        self.assertGreater(len(stages("long")), 10)
        self.assertEqual(stages("long") - column, set())

    def test_what_is_in_a_column_is_run_there(self):
        for row in rows():
            # Includes the scripts that a stage calls, as ci/lint calls ci/words.
            run = [stages(name).union(*(called(stage) for stage in stages(name))) for name in ("test", "long")]
            for command, cell in zip(run, row[3:5], strict=True):
                of_row = scripts(row[1]) | set(re.findall(r"`ci/long (\w+)`", row[1]))
                if cell:
                    self.assertTrue(of_row & command, row)


if __name__ == "__main__":
    unittest.main()
