"""Tests the links of pages as they are in the book."""

import unittest
from pathlib import Path

from outside import ROOT, Book, chapters


class Rewritten(unittest.TestCase):
    """Returns a book of two pages, one of which is outside of docs/."""

    def setUp(self):
        places = ["SPEC.md", "root/architecture.md", "decisions/README.md"]
        self.book = Book([{"source_path": place, "path": place.replace("README", "index")} for place in places])

    def check(self, text, expected, base="", chapter="root/architecture.md"):
        self.assertEqual(self.book.rewrite(text, ROOT / base, Path(chapter)), expected)

    def test_pages_of_the_book(self):
        self.check("[a](docs/SPEC.md#x)", "[a](../SPEC.md#x)")
        self.check("[a](#x) [b](https://example.com)", "[a](#x) [b](https://example.com)")
        self.check("[a](../ARCHITECTURE.md)", "[a](root/architecture.md)", "docs", "SPEC.md")
        self.check("[a](decisions/README.md)", "[a](decisions/index.md)", "docs", "SPEC.md")

    def test_files_outside_of_the_book(self):
        self.check("[`links`](ci/links)", "`ci/links`")
        self.check("[this](ci/links)", "this (`ci/links`)")
        self.check("[tests/pages](tests/pages)", "tests/pages")

    def test_code_that_has_a_reference(self):
        self.check("[wstac.h](wstac-c/include/wstac.h)", "[wstac.h](../api/c/wstac_8h.html)")
        self.check("[`wstac-core`](../wstac-core/src/lib.rs)", "[`wstac-core`](api/rust/wstac_core/index.html)", "docs", "SPEC.md")
        self.check("[this](wstac-core/src/lib/rs)", "this (`wstac-core/src/lib/rs`)")

    def test_pictures(self):
        self.check("![p](docs/plots/trade.svg)", "![p](../plots/trade.svg)")

    def test_code(self):
        for code in ("`[a](docs/SPEC.md)`", "```\n[a](docs/SPEC.md)\n```", "\n    [a](docs/SPEC.md)"):
            self.check(code, code)
        self.check("`[a](docs/SPEC.md)` [a](docs/SPEC.md)", "`[a](docs/SPEC.md)` [a](../SPEC.md)")

    def test_chapters_inside_others(self):
        inner = {"Chapter": {"name": "b", "sub_items": []}}
        outer = {"Chapter": {"name": "a", "sub_items": [inner]}}
        self.assertEqual([chapter["name"] for chapter in chapters(["Separator", outer])], ["a", "b"])


if __name__ == "__main__":
    unittest.main()
