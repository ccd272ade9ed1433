#!/usr/bin/env python3
"""Tests that NumPy reads the files of `wstac dataset`. The variable WSTAC names the command."""

from __future__ import annotations

import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
from wstac_reference import y4m
from wstac_reference.features import taxel_features
from wstac_reference.green import GreenSums
from wstac_reference.layout import paper_layout
from wstac_reference.pipeline import Event, Pipeline

WSTAC = os.environ.get("WSTAC")
SWEEP = """
specimens = ["Saw3", "Tri3"]
speeds = [100, 150.5]
directions = [0, 90, 180, 270]
slides = 8
seed = 5
[scene]
depth = 3.5
"""


@unittest.skipUnless(WSTAC, "WSTAC is not set, expected the path of the wstac command")
class DatasetTest(unittest.TestCase):
    def arrays(self, sweep: str) -> dict[str, np.ndarray]:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "sweep.toml"
            path.write_text(sweep, encoding="utf-8")
            output = Path(folder) / "set.npz"
            done = subprocess.run([WSTAC, "dataset", path, "-o", output], capture_output=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            with np.load(output, allow_pickle=False) as arrays:
                return dict(arrays)

    def test_arrays(self) -> None:
        arrays = self.arrays(SWEEP)
        n = len(arrays["X"])
        self.assertEqual(n, 16)
        names = ["X", "scale", "y_specimen", "y_pattern", "y_depth", "speed", "direction", "seed"]
        names += ["reliable", "duration", "source"]
        self.assertEqual(list(arrays), [*names, "fps"])
        self.assertEqual((arrays["fps"].dtype.str, arrays["fps"].shape, float(arrays["fps"])), ("<f8", (), 30.0))
        dtypes = {name: arrays[name].dtype.str for name in ("X", "scale", "y_depth", "speed", "direction", "seed")}
        expected = {"X": "<i2", "scale": "<f8", "y_depth": "<f8", "speed": "<f8", "direction": "<i8", "seed": "<u8"}
        self.assertEqual(dtypes, expected)
        self.assertEqual((arrays["X"].shape, arrays["scale"].shape), ((n, 10, 70), ()))
        for name in names[2:]:
            self.assertEqual(arrays[name].shape, (n,), name)
        self.assertEqual(float(arrays["scale"]), 1 / 2048)
        self.assertEqual((arrays["reliable"].dtype.str, arrays["duration"].dtype.str), ("|b1", "<i8"))
        self.assertTrue(arrays["reliable"].all())
        self.assertTrue(((arrays["duration"] > 15) & (arrays["duration"] < 45)).all())
        labels = {"Saw3.5": ("Saw", 3.5), "Tri3.5": ("Tri", 3.5)}
        for specimen, pattern, depth in zip(arrays["y_specimen"], arrays["y_pattern"], arrays["y_depth"]):
            self.assertEqual((pattern, depth), labels[str(specimen)])
        for k, seed in enumerate(arrays["seed"]):
            slide = int(seed) - 5
            self.assertEqual(arrays["y_specimen"][k], list(labels)[slide // 8])
            self.assertEqual(arrays["speed"][k], [100, 150.5][slide % 2])
            self.assertEqual(arrays["direction"][k], 90 * (slide % 8 // 2))
        said = f"scene: Saw3.5 at 150.5 mm/s, 0 degrees, seed {arrays['seed'][1]}"
        self.assertEqual(arrays["source"][1], said)

    def test_light_of_taxels_is_that_of_the_reference(self) -> None:
        # Sums have 18 bits, so they lose two; two camera frames are one feature frame, and the first row stays dark.
        rng, full, side = np.random.default_rng(4), 255, 135
        y, x = np.mgrid[0:side, 0:side] / side
        at = np.arange(240)[:, None, None] / 30 - 3.7
        light = 2 + 150 * np.exp(-((at - x - y / 3) ** 2) / 0.1) * (1 + np.sin(40 * x)) * (at > 0)
        luma = np.clip(np.rint(light + rng.normal(0, 1, light.shape)), 0, full).astype(np.uint8)
        luma[:, : side // 4] = 0
        clip = b"YUV4MPEG2 W135 H135 F60:1 Ip A1:1 Cmono XCOLORRANGE=FULL\n"
        clip += b"".join(b"FRAME\n" + frame.tobytes() for frame in luma)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "clip.y4m").write_bytes(clip)
            for command in (
                ["record", folder / "clip.y4m", "-o", folder / "clip.mcap", "--label", "specimen=café"],
                ["dataset", folder / "clip.mcap", "--input", "taxels", "-o", folder / "set.npz"],
            ):
                done = subprocess.run([WSTAC, *command], capture_output=True, check=False)
                self.assertEqual(done.returncode, 0, done.stderr)
            with np.load(folder / "set.npz", allow_pickle=False) as arrays:
                found, names = arrays["X_taxels"], arrays["y_specimen"].tolist()
            with open(folder / "clip.y4m", "rb") as stream:
                header = y4m.read_header(stream)
                frames = list(y4m.read_frames(stream, header))
        bytes_per_line = header.format.min_bytes_per_line(side)
        green = GreenSums(header.format, side, side, bytes_per_line, paper_layout(side, side))
        line, sums = Pipeline.of(green, header.fps), [green.sums(frame) for frame in frames]
        events = [item.sample for one in sums for item in line.push(one) if isinstance(item, Event)]
        self.assertEqual((len(events), found.shape, names), (1, (1, 25, 70), ["café"]))
        first, of = events[0].frame, line.features
        pairs = [sums[2 * frame : 2 * frame + 2] for frame in range(first, first + 70)]
        expected = [taxel_features(pair, of.full, of.floor) for pair in pairs]
        np.testing.assert_array_equal(found[0].T, expected)
        self.assertEqual((found == of.floor - 3296).mean(), 0.2)


if __name__ == "__main__":
    unittest.main()
