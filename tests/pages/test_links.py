"""Tests that the link checker finds what is wrong, and nothing else."""

import tempfile
import unittest
from pathlib import Path

import pages
from links import Tree


class Checker(unittest.TestCase):
    """Small repositories with one fault each."""

    def problems(self, **files):
        """Returns what is wrong with a repository: `docs__A_md` is docs/A.md."""
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder).resolve()
            named = {name.replace("__", "/").replace("_", "."): text for name, text in files.items()}
            for name, text in named.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            return list(Tree(root, list(named)).problems())

    def assert_one(self, expected, **files):
        found = self.problems(**files)
        self.assertEqual(len(found), 1, found)
        self.assertIn(expected, found[0])

    def test_sound_pages(self):
        found = self.problems(
            README_md='# One\n[a](docs/A.md#two-and-three) ![p](p.svg "t") [b](#one) [c](https://example.com) `docs/A.md`\n',
            docs__A_md="## Two, and `three`\n\n    [code](gone.md)\n\n```\n[code](gone.md)\n```\n`[code](gone.md)` [up](../README.md) [here](.)\n",
            p_svg="",
            a_rs="// docs/A.md#two-and-three, docs/….md, ci/…\n",
        )
        self.assertEqual(found, [])

    def test_a_missing_file(self):
        self.assert_one("README.md:2: link to gone.md: there is no gone.md", README_md="\n[a](gone.md)\n")
        self.assert_one("there is no docs/README.md", docs__A_md="[a](README.md)", README_md="")
        self.assert_one("gone.svg", README_md="[![picture](gone.svg)](README.md)")
        self.assert_one("gone.md", README_md="text\n\n[a]: gone.md\n")
        self.assert_one("gone.md", README_md='<a href="gone.md">a</a>')

    def test_a_missing_heading(self):
        self.assert_one("README.md has no heading for #two", README_md="# One\n[a](#two)\n")
        self.assert_one("docs/A.md has no heading for #two-1", README_md="[a](docs/A.md#two-1)", docs__A_md="# Two\n")

    def test_named_paths(self):
        self.assert_one("`ci/gone` is named", README_md="Run `ci/gone FOLDER`.")
        self.assert_one("a.rs:1: docs/GONE.md is named", a_rs="// See docs/GONE.md.")
        self.assert_one("a.rs:1: ci/gone is named", a_rs="// `ci/gone` writes it")
        self.assert_one("docs/A.md has no heading for #two", a_rs="// docs/A.md#two", docs__A_md="# One")

    def test_named_source_files(self):
        self.assert_one("`gone.rs` is named", README_md="See `gone.rs`.")
        self.assert_one("`camera/a.rs` is named", README_md="See `camera/a.rs`.", host__a_rs="")
        self.assert_one("`tests/gone.rs` is named", README_md="See `tests/gone.rs::a_test`.")
        self.assert_one("`gone.py` is named", README_md="Run `python gone.py FILE`.")
        sound = "`a.rs`, `host/a.rs::a_test`, `python host/a.py`, `src/bin/NAME.rs`, `*.rs`, `my.toml`"
        self.assertEqual(self.problems(README_md=sound, host__a_rs="", host__a_py=""), [])

    def test_repeated_headings(self):
        self.assertEqual(pages.anchors("# A b\n## A b\n### C, d: `e`\n"), {"a-b", "a-b-1", "c-d-e"})


if __name__ == "__main__":
    unittest.main()
