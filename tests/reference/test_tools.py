#!/usr/bin/env python3
"""Tests the generator, the file reader, the tools, and the whole pipeline."""

from __future__ import annotations

import io
import json
import subprocess
import sys
import tempfile
import unittest
from fractions import Fraction
from pathlib import Path

from golden import first_difference
from vectors.event_cases import event_cases
from vectors.format_cases import format_cases
from wstac_reference.formats import FORMATS
from wstac_reference.pipeline import Event, FeatureFrame, Pipeline
from wstac_reference.rng import SplitMix64, mix
from wstac_reference.y4m import read_frames, read_header

HERE = Path(__file__).parent


class RngTest(unittest.TestCase):
    def test_known_values(self) -> None:
        # splitmix64 from 1234567, as published with the algorithm
        rng = SplitMix64(1234567)
        self.assertEqual(rng.next(), 6457827717110365317)
        self.assertEqual(int(rng.words(1)[0]), 3203168211198807973)
        self.assertEqual(mix(0), 0)


def y4m_of(tag: str, frames: list[bytes], size: int = 5, rate: str = "30:1") -> bytes:
    head = f"YUV4MPEG2 W{size} H{size} F{rate} Ip A1:1 {tag}\n".encode()
    return head + b"".join(b"FRAME\n" + frame for frame in frames)


class ToolTest(unittest.TestCase):
    def test_y4m(self) -> None:
        stream = io.BytesIO(y4m_of("C420jpeg XCOLORRANGE=FULL", [bytes(43), bytes(43)]))
        header = read_header(stream)
        self.assertEqual((header.format.name, header.full_range, header.frame_bytes), ("YU12", True, 43))
        self.assertEqual(len(list(read_frames(stream, header))), 2)
        self.assertIsNone(read_header(io.BytesIO(y4m_of("Cmono", [], rate="0:0"))).fps)
        self.assertRaises(ValueError, read_header, io.BytesIO(y4m_of("C420p10", [])))

    def run_tool(self, *arguments: str, data: bytes = b"") -> subprocess.CompletedProcess:
        command = [sys.executable, *arguments]
        return subprocess.run(command, input=data, capture_output=True, cwd=HERE, check=False)

    def test_oracle(self) -> None:
        frames = [bytes([2] * 25)] * 37
        frames += [bytes([2 + 50 * (t // 4 == i % 5) for i in range(25)]) for t in range(20)]
        frames += [bytes([2] * 25)] * 50
        done = self.run_tool("oracle.py", "-", data=y4m_of("Cmono", frames))
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertEqual([line["kind"] for line in lines].count("features"), 107)
        event = next(line for line in lines if line["kind"] == "event")
        self.assertEqual(lines.index(event), 95)  # right after the features of frame 94
        self.assertEqual((event["frame"], event["duration_frames"], event["direction"]["deg"]), (25, 19, 0))
        self.assertEqual((len(event["sample"]), len(event["sample"][0])), (10, 70))
        self.assertEqual(lines[-1]["frames"], 107)
        self.assertEqual(self.run_tool("oracle.py", "-", data=y4m_of("Cmono", frames, rate="0:0")).returncode, 1)

    def test_raw_features(self) -> None:
        with tempfile.NamedTemporaryFile() as file:
            file.write(bytes([255] * 25 + [0] * 7) * 2)
            file.flush()
            size = ("--width", "5", "--height", "5", "--frame-bytes", "32")
            done = self.run_tool("raw_features.py", "--format", "GREY", *size, file.name)
        lines = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertEqual(lines[1], {"frame": 1, "sums": [255] * 25, "q": [3296] * 10})


class GoldenTest(unittest.TestCase):
    def test_first_difference(self) -> None:
        with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as two:
            made, stored = Path(one), Path(two)
            for directory in (made, stored):
                (directory / "a.json").write_text("{}\n")
            self.assertIsNone(first_difference(made, stored))
            (stored / "b.raw").write_bytes(b"1")
            self.assertEqual(first_difference(made, stored), "b.raw: belongs to no case")
            (stored / "a.json").write_text("{]\n")
            self.assertIn("a.json: byte 1 (line 1)", first_difference(made, stored) or "")

    def test_case_names(self) -> None:
        cases = format_cases() + event_cases()
        self.assertEqual(len({case.name for case in cases}), len(cases))
        self.assertEqual({case.format for case in cases}, set(FORMATS))


class PipelineTest(unittest.TestCase):
    def test_halves_do_not_shift_time(self) -> None:
        line = Pipeline(255, 1, Fraction(60))
        items: list[FeatureFrame | Event] = []
        for t in range(200):
            if t == 101:  # the second half of feature frame 50
                items += line.lose(1)
                continue
            items += line.push([60 if 74 <= t < 100 else 2] * 25)
        events = [event for event in items if isinstance(event, Event)]
        self.assertEqual([(e.sample.frame, e.sample.frames_filled) for e in events], [(25, 1)])
        self.assertEqual((events[0].speed.first_valid, events[0].speed.duration), (12, 12))


if __name__ == "__main__":
    unittest.main()
