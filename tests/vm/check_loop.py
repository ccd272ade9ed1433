"""Checks the results of guest/loop.sh: check_loop.py RESULTS PLAYED.gray WSTAC [--last-try].

Exit code 3, before any verdict, means that the run was unlucky: the slow machine lost frames, or the program started
too late for a baseline. Another boot may do better. --last-try judges the run anyway.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
from make_sequence import FIRST_LIT, HEIGHT, WIDTH, number
from results import Run, compare_features, reference_features, verdict

FRAMES = 150
BASELINE, WINDOW, BACKTRACK = 25, 5, 10


def without_fills(event: dict) -> dict:
    """Returns an event without the fields that depend on gaps in the stream."""
    return {key: value for key, value in event.items() if key not in ("frames_filled", "reliable")}


def events_from_file(captured: np.ndarray, times: list[int], wstac: str, path: Path) -> list[dict]:
    """Returns the events of the captured frames as a Y4M file, in which a lost frame repeats its predecessor."""
    with path.open("wb") as out:
        out.write(f"YUV4MPEG2 W{WIDTH} H{HEIGHT} F30:1 Ip A1:1 Cmono\n".encode())
        # A gap is filled by repeating the last features, and a repeated frame has exactly those.
        for frame, shown in zip(captured, np.diff([*times, times[-1] + 1]), strict=True):
            out.write((b"FRAME\n" + frame.tobytes()) * int(shown))
    text = subprocess.run([wstac, "run", path, "--json"], check=True, capture_output=True, text=True).stdout
    path.unlink()
    return [record for record in map(json.loads, text.splitlines()) if record["kind"] == "event"]


def main(directory: Path, played_file: Path, wstac: str, last_try: bool) -> None:
    """Judges one loop run."""
    run = Run(directory, "loop")
    problems = run.trouble()
    if problems:
        verdict("loop run", problems)
        return
    played = np.memmap(played_file, np.uint8, "r").reshape(-1, HEIGHT, WIDTH)
    captured = np.memmap(run.raw, np.uint8, "r").reshape(-1, HEIGHT, WIDTH)
    times = run.arrived(len(captured))
    lost = run.lost(len(captured))
    numbers = [number(frame) for frame in captured]
    late = numbers[0] > FIRST_LIT - BASELINE - WINDOW
    clean = len(captured) == FRAMES and lost == range(1)
    if (late or not clean) and not last_try:
        print(f"loop: {lost.start} frames lost, first number {numbers[0]}; trying again", file=sys.stderr)
        sys.exit(3)
    verdict("loop run", [f"first frame {numbers[0]} is too late for a baseline"] if late else [], f"from frame {numbers[0]}")

    wrong = [t for t, frame, n in zip(times, captured, numbers, strict=True) if n >= len(played) or (frame != played[n]).any()]
    backwards = [b for a, b in zip(numbers, numbers[1:]) if b < a]
    problems = [f"frames {wrong[:5]} are not the played ones"] if wrong else []
    problems += [f"numbers go back at {backwards[:5]}"] if backwards else []
    verdict("loop pixels", problems, f"{len(captured)} buffers are the played frames {numbers[0]} to {numbers[-1]}, byte for byte")

    expected = reference_features(run.raw, "GREY", WIDTH, HEIGHT, WIDTH, [])
    verdict("loop features", *compare_features(run, times, expected))

    said = run.end["dropped"]
    verdict("loop gaps", [] if said in lost else [f"dropped {said}, but the sequence has gaps of {lost}"], f"{said} lost")

    live = run.of_kind("event")
    again = events_from_file(captured, times, wstac, directory / "loop.y4m")
    same = live == again if clean else list(map(without_fills, live)) == list(map(without_fills, again))
    verdict("loop events equal the file's", [] if same else [f"live {live}, from the file {again}"], f"{len(live)} events")

    # The window with the first light fires, and the sample starts before it by the backtrack.
    problems = []
    if len(live) != 1:
        problems.append(f"{len(live)} events for one slide")
    else:
        shown = {time: n for time, n in zip(times, numbers, strict=True)}.get(live[0]["frame"])
        if shown is not None and not FIRST_LIT - WINDOW - BACKTRACK < shown <= FIRST_LIT - BACKTRACK + 1:
            problems.append(f"the event starts at played frame {shown}, the light at {FIRST_LIT}")
        # An output that stalls shows a frame twice, so the light does not move evenly.
        repeated = len(set(numbers)) < len(numbers)
        speed, direction = live[0]["speed"], live[0]["direction"]
        if speed is None or direction is None:
            if not repeated:
                problems.append(f"no speed or direction: {live[0]}")
        elif min(direction["deg"], 360 - direction["deg"]) > 5:
            problems.append(f"columns lit from left to right are 0 degrees, not {direction}")
    verdict("loop event is the slide", problems, "" if problems else f"speed {live[0]['speed']}")


main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], "--last-try" in sys.argv)
