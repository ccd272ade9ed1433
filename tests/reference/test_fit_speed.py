"""Compares `wstac fit-speed` with NumPy and with the fit of docs/REPRODUCE.md, on slides of the simulated sensor."""

from __future__ import annotations

import json
import math
import os
import subprocess
import tempfile
import unittest
from pathlib import Path
from typing import Any

import numpy as np

import speed_law

WSTAC = os.environ.get("WSTAC", "wstac")
SWEEP = """specimens = ["Saw3", "Fla0"]
speeds = [100, 110, 120, 130, 140, 150, 160, 170, 180, 190, 200]
slides = 55
"""


def command(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([WSTAC, *map(str, arguments)], capture_output=True, text=True, check=False)


@unittest.skipUnless("WSTAC" in os.environ, "WSTAC is not set, expected the path of the wstac command")
class FitSpeedTest(unittest.TestCase):
    folder: tempfile.TemporaryDirectory[str]

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = tempfile.TemporaryDirectory()
        sweep, cls.data = Path(cls.folder.name, "sweep.toml"), Path(cls.folder.name, "slides.npz")
        sweep.write_text(SWEEP)
        done = command("dataset", sweep, "-o", cls.data)
        assert done.returncode == 0, done.stderr
        with np.load(cls.data) as arrays:
            kept = (arrays["duration"] >= 0) & arrays["reliable"]
            cls.speed, cls.duration = arrays["speed"][kept], arrays["duration"][kept].astype(float)
            cls.left_out = int(len(kept) - kept.sum())

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    def fit(self) -> dict[str, Any]:
        done = command("fit-speed", self.data, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def alike(self, found: float, expected: float) -> None:
        self.assertTrue(math.isclose(found, expected, rel_tol=1e-9), f"{found} for {expected}")

    def test_as_numpy(self) -> None:
        fit, x = self.fit(), np.log10(self.speed)
        (slope, intercept), covariance = np.polyfit(x, self.duration, 1, cov=True)
        errors = np.sqrt(np.diag(covariance))
        self.alike(fit["slope"], -slope)
        self.alike(fit["intercept"], intercept)
        self.alike(fit["slope_error"], errors[0])
        self.alike(fit["intercept_error"], errors[1])
        self.alike(fit["r2"], np.corrcoef(x, self.duration)[0, 1] ** 2)
        residuals = self.duration - intercept - slope * x
        self.alike(fit["deviation_frames"], math.sqrt(residuals @ residuals / (len(x) - 2)))
        self.assertEqual(fit["slides"] + self.left_out, 110)
        self.assertEqual(fit["range_mm_s"], [100, 200])

    def test_as_the_published_protocol_is_fitted(self) -> None:
        fit, line = self.fit(), speed_law.fit_line(list(self.speed), list(self.duration))
        self.assertEqual(fit["law"], "published")
        for found, expected in (("intercept", line.intercept), ("slope", -line.slope), ("r2", line.r2)):
            self.assertTrue(math.isclose(fit[found], expected, rel_tol=1e-13), (found, fit, line))
        # The simulated sensor is fitted to the paper's law: 151.06 − 56.29 log10 v, R² 0.99.
        self.assertLess(abs(fit["slope"] - 56.29), 5)
        self.assertGreater(fit["r2"], 0.97)

    def test_its_table_is_what_run_takes(self) -> None:
        table, plot = Path(self.folder.name, "speed.toml"), Path(self.folder.name, "plot.svg")
        done = command("fit-speed", self.data, "-o", table, "--plot", plot)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(plot.read_text().startswith("<svg "))
        done = command("run", "scene:Saw3@150,seed=5", "--config", table, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        event = json.loads(done.stdout.splitlines()[0])
        self.assertLess(abs(event["speed"]["mm_s"] - 150), 15)
        self.assertFalse(event["speed"]["extrapolated"])
        again = command("fit-speed", self.data, "-o", table)
        self.assertEqual((again.returncode, "exists already" in again.stderr), (1, True))

    def test_what_is_wrong_is_named(self) -> None:
        slow = np.array([100.0, 100, 110, 110])
        for arrays, part in (
            ({"speed": slow}, "array duration"),
            ({"duration": slow}, "array speed"),
            ({"speed": slow, "duration": np.arange(4)}, "4 slides at 2 different speeds"),
            ({"speed": slow[:2], "duration": np.arange(2)}, "at 1 different speed "),
            ({"speed": slow, "duration": np.full(4, -1)}, "0 slides at 0 different speeds (4 left out)"),
            ({"speed": np.full(4, np.nan), "duration": np.arange(4)}, "0 slides at 0 different speeds (4 left out)"),
            ({"speed": np.array([1, 2, np.inf]), "duration": np.arange(3)}, "element 2 is inf"),
            ({"speed": slow, "duration": np.array([1, 2, 3, np.nan])}, "element 3 is NaN"),
        ):
            path = Path(self.folder.name, "wrong.npz")
            np.savez(path, **arrays)
            done = command("fit-speed", path)
            self.assertEqual(done.returncode, 1, done.stdout)
            self.assertIn(part, done.stderr)
        self.assertEqual(command("fit-speed").returncode, 2)


if __name__ == "__main__":
    unittest.main()
