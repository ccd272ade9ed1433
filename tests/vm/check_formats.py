"""Checks the results of guest/formats.sh: check_formats.py RESULTS."""

from __future__ import annotations

import re
import sys
from pathlib import Path

from results import Run, compare_features, reference_features, verdict

WIDTH, HEIGHT, FRAMES = 640, 360, 5


class Stated:
    """Returns the driver's format after a run, as v4l2-ctl prints it."""

    def __init__(self, path: Path) -> None:
        self.text = path.read_text()
        self.size = tuple(map(int, re.search(r"Width/Height\s*: (\d+)/(\d+)", self.text).groups()))
        self.fourcc = re.search(r"Pixel Format\s*: '(.{4})'", self.text)[1]
        self.line = int(re.search(r"Bytes per Line\s*: (\d+)", self.text)[1])
        self.image = int(re.search(r"Size Image\s*: (\d+)", self.text)[1])
        self.matrix = {"ITU-R 601": "bt601", "Rec. 709": "bt709"}[self._color("YCbCr/HSV Encoding")]
        self.range = {"Limited Range": "limited", "Full Range": "full"}[self._color("Quantization")]

    def _color(self, name: str) -> str:
        """Returns the value, or what the default maps to."""
        value = re.search(rf"{name}\s*: (.*)", self.text)[1]
        return re.sub(r"^Default \(maps to (.*)\)$", r"\1", value)


def check_moving(directory: Path, name: str, fourcc: str) -> None:
    """Features of both moving pictures equal the reference's for the same raw buffers."""
    problems, notes = [], []
    stated = Stated(directory / f"{name}.format")
    if stated.fourcc != fourcc or stated.size != (WIDTH, HEIGHT):
        problems.append(f"asked for {fourcc!r} {WIDTH}x{HEIGHT}, the driver is left with {stated.fourcc!r} {stated.size}")
    ycbcr = fourcc in ("YUYV", "UYVY", "NV12", "YU12")
    colors = [stated.matrix, stated.range] if ycbcr else []
    for picture in ("squares", "checkers"):
        run = Run(directory, f"{name}-{picture}")
        found = run.trouble()
        if not found:
            frames = run.saved(stated.image)
            # A slow machine may lose some of the five. Two are needed to see that the picture moves.
            if not 2 <= frames <= FRAMES:
                found.append(f"{frames} frames saved, {FRAMES} asked for")
            expected = reference_features(run.raw, fourcc, (WIDTH, HEIGHT), stated.line, colors)
            if picture == "squares" and (len(set(map(tuple, expected))) < 2 or len(set(expected[0])) < 5):
                found.append("the picture neither moves nor has structure, so it proves nothing")
            off, summary = compare_features(run, run.arrived(frames), expected)
            found += off
            notes.append(f"{picture} {summary}")
        problems += [f"{picture}: {problem}" for problem in found]
    verdict(f"formats {name} {' '.join([fourcc, *colors])}", problems, ", ".join(notes))


def check_still(directory: Path, name: str) -> None:
    """A still picture's buffers equal those of v4l2-ctl, byte for byte."""
    run = Run(directory, f"{name}-still")
    problems = run.trouble()
    if not problems:
        other = (directory / f"{name}-v4l2.raw").read_bytes()
        if not other or run.raw.read_bytes() != other * run.saved(len(other)):
            problems.append("saved buffers differ from those of v4l2-ctl")
    verdict(f"still {name}", problems)


def main(directory: Path) -> None:
    """Prints one line for each format of guest/formats.list and each of the two checks."""
    rows = [line.split() for line in (Path(__file__).parent / "guest" / "formats.list").read_text().splitlines() if line[0] != "#"]
    offered = set(re.findall(r"\[\d+\]: '(.{4})'", (directory / "offered").read_text()))
    for name, fourcc, *_ in rows:
        fourcc = fourcc.ljust(4)
        if fourcc not in offered:
            verdict(f"formats {name}", [f"vivid does not offer {fourcc!r}"])
            continue
        for check in (lambda: check_moving(directory, name, fourcc), lambda: check_still(directory, name)):
            try:
                check()
            except Exception as error:  # a broken record must fail one check, and not the rest
                verdict(f"formats {name}", [f"{type(error).__name__}: {error}"])


main(Path(sys.argv[1]))
