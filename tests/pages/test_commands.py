"""Tests that the commands of pages are found, run, and named, and that nothing is passed over."""

import re
import tempfile
import unittest
from pathlib import Path

import commands
import rules
import run_commands
import tutorial


def rule(match, page=None, **given):
    return rules.Rule(re.compile(match), page, given)


class Found(unittest.TestCase):
    def words(self, text):
        return [[(command.line, command.words()) for command in block.commands] for block in commands.blocks(text)]

    def test_blocks(self):
        page = "Text.\n\n    wstac run a    # why\n    ci/x\n\n```sh\nA=b wstac run \\\n    b\n\n# alone\nfor x in y; do\n    echo $x\ndone\n```\n"
        self.assertEqual(self.words(page), [[(3, "wstac run a"), (4, "ci/x")], [(7, "A=b wstac run b"), (11, "for x in y; do; echo $x; done")]])

    def test_what_is_no_command(self):
        self.assertEqual(self.words("Text.\n\n    the board: up for 41 s\n\n```toml\nwstac = 1\n```\n"), [])
        self.assertEqual(self.words("- item\n    wstac run a\n"), [])
        self.assertEqual(self.words("```text\n\n    wstac run a\n```\n"), [])

    def test_here_documents_are_one_command(self):
        self.assertEqual(len(self.words("```sh\ncat > a <<'END'\nx = 'y\nEND\nwstac run a\n```\n")[0]), 2)
        self.assertRaisesRegex(tutorial.Wrong, "does not end", commands.blocks, "```sh\ncat <<'END'\nx\n```\n")


class Run(unittest.TestCase):
    def check(self, text, known=None):
        """Returns what is wrong with a page, and how many commands were run and named. `wstac` refuses `--wrong`."""
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name).resolve()
            program = folder / "program"
            program.write_text('#!/bin/sh\ncase "$*" in *--wrong*) echo "no option --wrong" >&2; exit 2;; esac\necho "$@"\n')
            program.chmod(0o755)
            (folder / "run").mkdir()
            page = run_commands.Page("page.md", folder / "run", {"wstac": program, "wstac-node": program}, known or rules.Rules())
            try:
                return page.check(commands.blocks(text)), page.counts["run"], page.counts["named"]
            finally:
                page.close()

    def test_run(self):
        self.assertEqual(self.check("```sh\nword=one\nwstac run $word\n```\n```text\nrun …\n```\n"), ([], 2, 0))
        problems, *_ = self.check("```sh\nwstac run one\n```\n```text\ntwo\n```\n")
        self.assertIn("page.md:2: there is no line 'two'", problems[0])

    def test_a_command_that_fails(self):
        problems, run, _ = self.check("```sh\ntrue\nwstac --wrong\n```\n")
        self.assertIn("page.md:3: wstac --wrong: a command failed with exit code 2", problems[0])
        self.assertEqual(run, 1)

    def test_named(self):
        known = rules.Rules(named=[rule("/dev/x", why="needs x")])
        self.assertEqual(self.check("```sh\nwstac run /dev/x\n```\n", known), ([], 0, 1))
        for command in ("wstac run /dev/x --wrong", "wstac-node /dev/x --wrong"):
            problems, *_ = self.check(f"```sh\n{command}\n```\n", known)
            self.assertIn("no option --wrong (it is not run: needs x)", problems[0])
        self.assertEqual(known.unused(set()), [])


class List(unittest.TestCase):
    def test_every_entry_has_a_reason(self):
        known = rules.load(run_commands.LIST)
        self.assertTrue(all(one.given["why"] for one in [*known.named, *known.instead]))

    def test_every_tutorial_is_run(self):
        self.assertEqual(run_commands.tutorials(), [])


if __name__ == "__main__":
    unittest.main()
