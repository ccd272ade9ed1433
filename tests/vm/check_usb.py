"""Checks the results of guest/usb.sh: check_usb.py RESULTS CAMERA WSTAC."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
from results import Run, compare_features, reference_features, verdict
from slide_frames import FIRST_LIT, HEIGHT, WIDTH
from slide_frames import frames as slide_frames
from usb_camera import ODD, RATE, TRUNCATED

FRAMES, WINDOW, BACKTRACK = 140, 5, 10


def records_of(wstac: str, *arguments: str | Path) -> list[dict]:
    """Returns the records of `wstac run` for a file or a folder."""
    text = subprocess.run([wstac, "run", *arguments, "--json"], check=True, capture_output=True, text=True).stdout
    return [json.loads(line) for line in text.splitlines()]


def check_gray(run: Run, wstac: str) -> None:
    """The frames are the played ones, and so are features and events."""
    played = np.stack(list(slide_frames()))[:FRAMES]
    same = run.raw.read_bytes() == played.tobytes()
    verdict("usb gray pixels", [] if same else ["the buffers are not the played frames"], f"{FRAMES} frames, byte for byte")
    expected = reference_features(run.raw, "GREY", (WIDTH, HEIGHT), WIDTH)
    verdict("usb gray features", *compare_features(run, list(range(FRAMES)), expected))
    lost = run.end["dropped"]
    verdict("usb gray gaps", [f"{lost} dropped"] if lost else [], "no frame lost")

    path = run.directory / "played.y4m"
    header = f"YUV4MPEG2 W{WIDTH} H{HEIGHT} F{RATE}:1 Ip A1:1 Cmono\n".encode()
    path.write_bytes(header + b"".join(b"FRAME\n" + frame.tobytes() for frame in played))
    live, again = run.of_kind("event"), [record for record in records_of(wstac, path) if record["kind"] == "event"]
    problems = [] if len(live) == len(again) == 1 else [f"live {live}, from the file {again}"]
    # The window with the first light fires, and the sample starts before it by the backtrack.
    for event in live[:1]:
        if event["frame"] != again[0]["frame"] or not FIRST_LIT - WINDOW - BACKTRACK < event["frame"] <= FIRST_LIT - BACKTRACK + 1:
            problems.append(f"the event starts at frame {event['frame']}, of the file at {again[0]['frame']}, the light at {FIRST_LIT}")
        direction = event["direction"]
        if direction is None or min(direction["deg"], 360 - direction["deg"]) > 5:
            problems.append(f"columns lit from left to right are 0 degrees, not {direction}")
    verdict("usb gray event is the slide", problems)


def check_mjpeg(run: Run, camera: Path, wstac: str) -> None:
    """Pictures with faults are measured like those without."""
    expected = [record["f"] for record in records_of(wstac, camera / "clean", "--features") if record["kind"] == "features"]
    got = {record["frame"]: record["f"] for record in run.of_kind("features")}
    missing = sorted(set(range(FRAMES)) - {TRUNCATED} - set(got))
    wrong = [number for number, features in got.items() if features != expected[number]]
    problems = [f"{len(missing)} pictures missing, such as {missing[:9]}"] if missing else []
    problems += [f"wrong at {wrong[:9]}"] if wrong else []
    verdict("usb mjpeg features", problems, f"{len(got)} pictures, {len(ODD) - 1} kinds of faults")
    lost = run.end["dropped"]
    problems = [] if lost == 1 and TRUNCATED not in got else [f"{lost} dropped, expected only picture {TRUNCATED}"]
    verdict("usb mjpeg truncated", problems, "1 dropped")


def main(directory: Path, camera: Path, wstac: str) -> None:
    """Prints a line for each check."""
    set_to = [line for line in (camera / "log").read_text().splitlines() if line.startswith("control 1 2 ")]
    verdict("usb exposure", [] if set_to[:1] == ["control 1 2 1"] else [f"the camera was asked for {set_to}"], "manual")
    for name, check in (("GREY", lambda run: check_gray(run, wstac)), ("MJPG", lambda run: check_mjpeg(run, camera, wstac))):
        run = Run(directory, name)
        if problems := run.trouble():
            verdict(f"usb {name}", problems)
        else:
            check(run)


main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
