"""Tests that the runner of tutorials finds what is wrong with a page, and nothing else."""

import tempfile
import unittest
from pathlib import Path

import tutorial


class Runner(unittest.TestCase):
    """Small pages with one fault each. `wstac` is a program that refuses `--wrong`."""

    def run_page(self, text, **files):
        """Returns what is wrong with a page, or the number of blocks that were run."""
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name).resolve()
            wstac = folder / "command"
            wstac.write_text('#!/bin/sh\ncase "$*" in *--wrong*) echo "no option --wrong" >&2; exit 2;; esac\necho "$@"\n')
            wstac.chmod(0o755)
            for file, content in files.items():
                (folder / file.replace("_", ".")).write_text(content)
            page = folder / "page.md"
            page.write_text(text)
            (folder / "run").mkdir()
            shell = tutorial.Shell(wstac, folder / "run")
            try:
                return tutorial.check(page, shell, wstac)
            except tutorial.Wrong as error:
                return str(error).removeprefix("page.md:")
            finally:
                shell.close()

    def test_sound_pages(self):
        page = "```sh\nword=one\ncat > a <<'END'\nx\nEND\n```\nText.\n\n```sh\nwstac run $word\ncat a\n```\n\n```text\nrun …\nx\n```\n"
        self.assertEqual(self.run_page(page), 2)
        self.assertEqual(self.run_page("[a](a.py):\n\n```python\nx = 1\n```\n\n```sh\ntrue\n```\n", a_py="x = 1\n"), 1)
        self.assertEqual(self.run_page("```sh\ntrue\n```\n```sh hardware\nwstac run a && cargo run --bin h743 --features learn\n```\n"), 1)

    def test_other_output(self):
        self.assertIn("4: there is no line 'two'", self.run_page("```sh\necho one\n```\n```text\ntwo\n```\n"))
        self.assertIn("there are more lines", self.run_page("```sh\necho one; echo two\n```\n```text\none\n```\n"))
        self.assertIn("there is no line 'two'", self.run_page("```sh\necho one\n```\n```text\none\ntwo\n```\n"))

    def test_commands_that_fail(self):
        self.assertIn("1: a command failed with exit code 3", self.run_page("```sh\n(exit 3)\ntrue\n```\n"))
        self.assertIn("exit code 2", self.run_page("```sh\nwstac --wrong\n```\n"))
        self.assertIn("the shell ended", self.run_page("```sh\nexit 0\n```\n"))
        self.assertEqual(self.run_page("```sh\nread -r line || true\necho $line\n```\n```text\n\n```\n"), 1)

    def test_hardware(self):
        def page(command):
            return f"```sh hardware\n{command}\n```\n```sh\ntrue\n```\n"

        self.assertIn("no option --wrong", self.run_page(page("wstac monitor a --wrong")))
        self.assertIn("no program h744", self.run_page(page("A=b cargo run --bin h744")))
        self.assertIn("no feature more", self.run_page(page("cargo build --bin h743 --features learn,more")))

    def test_other_blocks(self):
        self.assertIn("differs from a.py", self.run_page("[a](a.py)\n```python\nx = 2\n```\n", a_py="x = 1\n"))
        self.assertIn("expected sh", self.run_page("```console\nx\n```\n"))
        self.assertIn("no commands come before", self.run_page("```text\nx\n```\n"))
        self.assertIn("no block was run", self.run_page("text\n"))
        self.assertIn("does not end", self.run_page("```sh\ntrue\n"))

    def test_lines_in_between(self):
        self.assertIsNone(tutorial.difference("a\n…\nd\n", "a\nb\nc\nd\n"))
        self.assertIsNone(tutorial.difference("…\nd\n…\n", "d\n"))
        self.assertEqual(tutorial.difference("…\nd … f\n", "d\n"), "there is no line 'd … f'")


if __name__ == "__main__":
    unittest.main()
