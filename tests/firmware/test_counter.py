"""Tests that a count says what it builds: a build takes minutes, and prints nothing itself."""

import contextlib
import io
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import counter


class Progress(unittest.TestCase):
    def test_a_build_says_what_it_builds_before_it_begins(self):
        said = io.StringIO()

        def build(*_arguments, **_named):
            self.assertEqual(said.getvalue(), "builds cost and emulated for thumbv6m-none-eabi: GREY, svm.wsm\n")

        with tempfile.TemporaryDirectory() as folder, mock.patch.object(counter, "write_samples"):
            counts = counter.Counter("wstac", folder)
            with mock.patch.object(counter.boards, "build", side_effect=build) as built, contextlib.redirect_stderr(said):
                counts.build("thumbv6m-none-eabi", "GREY", "", Path("svm.wsm"))
        built.assert_called_once()


if __name__ == "__main__":
    unittest.main()
