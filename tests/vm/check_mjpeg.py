"""Checks the results of guest/mjpeg.sh: check_mjpeg.py RESULTS CAMERA WSTAC."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from results import Run, verdict
from usb_camera import ODD, TRUNCATED


def main(directory: Path, camera: Path, wstac: str) -> None:
    """Compares what the guest measured with what the same pictures are without their faults."""
    run = Run(directory, "mjpeg")
    problems = run.trouble()
    if problems:
        verdict("mjpeg run", problems)
        return
    log = (camera / "log").read_text().splitlines()
    exposure = [line for line in log if line.startswith("control 1 2 ")]
    verdict("mjpeg exposure", [] if exposure[:1] == ["control 1 2 1"] else [f"the camera was asked for {exposure}"], "manual")

    text = subprocess.run([wstac, "run", camera / "clean", "--features", "--json"], check=True, capture_output=True, text=True).stdout
    clean = [record["f"] for record in map(json.loads, text.splitlines()) if record["kind"] == "features"]
    # The stream's first picture is number 0 of the kernel, and it loses none as long as the program gives buffers back.
    shift = run.buffers[0].sequence
    got = {record["frame"] + shift: record["f"] for record in run.of_kind("features")}
    wrong = [number for number, features in got.items() if features != clean[number]]
    few = [f"{len(got)} of 200 pictures"] if len(got) < 190 else []
    verdict("mjpeg features", few + ([f"wrong at {wrong[:9]}"] if wrong else []), f"{len(got)} pictures with {len(ODD) - 1} kinds of faults")
    reasons = run.end["dropped"]
    verdict("mjpeg truncated", [f"picture {TRUNCATED} was measured"] if TRUNCATED in got else [], f"{reasons} dropped")


main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
