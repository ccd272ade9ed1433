"""Tests that generated pages begin with the part that is written by hand."""

import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HEADS = {"docs/TEXTURE.md": "tests/reference/texture_head.txt", "docs/MODELS.md": "tests/peers/head.txt"}


class Heads(unittest.TestCase):
    def test_pages_begin_with_their_heads(self):
        for page, head in HEADS.items():
            head = (ROOT / head).read_text(encoding="utf-8")
            self.assertTrue((ROOT / page).read_text(encoding="utf-8").startswith(head), page)


if __name__ == "__main__":
    unittest.main()
