#!/usr/bin/env python3
"""The firmware on emulated boards: its events are the host's, and what it costs is no more than was kept.

    check.py WSTAC            checks; what is worse than the kept numbers fails, what is better asks for an update
    check.py WSTAC --keep     keeps the numbers (kept.json) and writes the table of docs/FIRMWARE.md
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import boards
import golden
import images
import kept
import link
from boards import BOARDS, ROOT

HERE = Path(__file__).resolve().parent
MODELS = {None: None} | {name: ROOT / f"wstac-linux/models/{name}.wsm" for name in ("svm", "forest", "boosted")}
FRAME = 400 * 400
STRIPE = 8 * 400


def host(wstac, *arguments):
    """What the command prints."""
    return subprocess.check_output([wstac, *arguments], text=True, stderr=subprocess.DEVNULL).splitlines()


def clip(wstac, folder):
    """Two slides: as a file for the host, and as frames alone for the boards."""
    file = folder / "clip.y4m"
    subprocess.run([wstac, "scene", "render", HERE / "clip.toml", "-o", file, "--force"], check=True, capture_output=True)
    data = file.read_bytes()
    frames = bytearray()
    at = data.index(b"\n") + 1
    while at < len(data):
        at = data.index(b"\n", at) + 1
        frames += data[at : at + FRAME]
        at += FRAME
    (folder / "frames").write_bytes(frames)
    return file


def same(board, what, got, want):
    if got != want:
        pairs = [pair for pair in zip(got + [""] * len(want), want + [""] * len(got)) if pair[0] != pair[1]]
        sys.exit(f"{board.core}, {what}: {len(pairs)} lines differ, the first: {pairs[0][0]!r}, expected {pairs[0][1]!r}")


def features(folder):
    """The features that a board has written, as the host prints them."""
    numbers = memoryview((folder / "features").read_bytes()).cast("h").tolist()
    return [[number / 2048 for number in numbers[at : at + 10]] for at in range(0, len(numbers), 10)]


def measure(wstac, folder):
    """Builds and runs everything; numbers by core and program."""
    file = clip(wstac, folder)
    numbers = {board.core: {} for board in BOARDS}
    everything = host(wstac, "run", file, "--json", "--features", "--samples")
    on_host = [record["f"] for record in map(json.loads, everything) if record["kind"] == "features"]
    for name, model in MODELS.items():
        asked = [] if model is None else ["--model", model]
        events = host(wstac, "run", file, "--json", *asked)
        for target in boards.TARGETS:
            programs = boards.build(target, "--bins", model=model)
            for board in (board for board in BOARDS if board.target == target):
                boards.run(board, programs / "emulated", folder, "file:serial")
                stack = int.from_bytes((folder / "stack").read_bytes(), "little")
                same(board, f"events with model {name}", host(wstac, "monitor", folder / "serial", "--json"), events)
                cost = json.loads(boards.run(board, programs / "cost", folder))
                same(board, "features", features(folder), on_host)
                size = boards.sizes(programs / "emulated")
                found = numbers[board.core]
                if name is None:
                    print(f"{board.core}: {link.check(board, programs / 'emulated', folder, wstac, everything)}", flush=True)
                    print(f"{board.core}: {golden.check(board, programs, folder)}", flush=True)
                    found |= {key: cost[key] for key in ("whole", "stripes", "trigger", "speed", "direction") if cost[key]}
                    found |= {"flash": size.flash, "ram": size.ram + stack}
                else:
                    found |= {name: cost["texture"], f"{name}, flash": size.flash - found["flash"], f"{name}, ram": size.ram + stack}
                slides = sum('"kind":"event"' in line for line in events)
                if (cost["events"], cost["frames"]) != (slides, len(on_host)):
                    sys.exit(f"{board.core}: {cost['events']} events in {cost['frames']} frames, expected {slides} in {len(on_host)}")
                print(f"{board.core}, model {name}: {cost['events']} events and {cost['frames']} frames as on the host", flush=True)
    return numbers


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[2:] not in ([], ["--keep"]):
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        numbers = measure(sys.argv[1], Path(folder))
    for target in boards.TARGETS:
        images.measure(target, numbers)
    print("\n".join(kept.table(numbers)))
    if sys.argv[2:]:
        kept.keep(numbers)
    elif not kept.compare(numbers):
        sys.exit(1)


if __name__ == "__main__":
    main()
