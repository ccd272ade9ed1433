"""Tests that all pages together stay short enough to be read."""

import subprocess
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Words as `wc -w` counts them, without the changelog. What --help, headers and comments of public items say is not said again.
MOST = 50_000

class Length(unittest.TestCase):
    def test_pages_have_few_words(self):
        listed = subprocess.run(["git", "-C", ROOT, "ls-files", "-z", "*.md"], check=True, capture_output=True, text=True).stdout
        words = {name: len((ROOT / name).read_bytes().split()) for name in listed.split("\0") if name and "CHANGELOG" not in name}
        self.assertGreater(len(words), 50)
        self.assertLessEqual(sum(words.values()), MOST, "say once what is said twice")

if __name__ == "__main__":
    unittest.main()
