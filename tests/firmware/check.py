#!/usr/bin/env python3
"""Checks the firmware on emulated boards: its events are the host's, and its costs are within their budgets (budgets.toml).

    check.py WSTAC            checks; published numbers that are more than 2 % off fail as well
    check.py WSTAC --base     checks one image of the M0 and one of the M4F, GREY without a model, and its numbers alone
    check.py WSTAC --write    checks, and writes the table of docs/FIRMWARE.md
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import boards
import budget
import golden
import images
import link
from boards import BOARDS, ROOT
from counter import Counter, Setting, formats, write_samples
from host import features, host, same

HERE = Path(__file__).resolve().parent
MODELS = (
    {None: None}
    | {name: ROOT / f"wstac-host/models/{name}.wsm" for name in ("svm", "forest", "boosted")}
    | {name: ROOT / f"wstac-host/models/path/{name}.wsm" for name in ("path-svm", "taxel-path-svm")}
)
# The numbers of an image without a model.
BASE = ("whole", "stripes", "logs", "trigger", "speed", "direction", "edges", "motion", "live", "flash", "ram")
# The boards of --base.
FEW = ("M0", "M4F")
# Keys of [speed].
LAWS = ('estimator = "edges"', 'law = "published"', 'law = "arrival"')
FRAME = 400 * 400
STRIPE = 8 * 400


def clip(wstac, folder):
    """Returns two slides: as a file for the host, and as plain frames for the boards."""
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


def without_frames(board, elf):
    """Checks that a program names the file that it lacks."""
    with tempfile.TemporaryDirectory() as empty:
        code, said = boards.attempt(board, elf, empty)
    if code == 0 or "frames: the board cannot open this file in the folder that the emulator was started in" not in said:
        sys.exit(f"{board.core}: expected {Path(elf).name} to name the file that it lacks, got {code}: {said!r}")


def measure(wstac, folder, models, chosen=BOARDS):
    """Builds and runs the firmware with each of these models on these boards. Returns numbers by core and program."""
    file = clip(wstac, folder)
    write_samples(wstac, folder / "samples")
    numbers = {board.core: {} for board in chosen}
    everything = host(wstac, "run", file, "--readout", "0", "--json", "--features", "--samples")
    on_host = [record["f"] for record in map(json.loads, everything) if record["kind"] == "features"]
    for name, model in models.items():
        asked = [] if model is None else ["--model", model]
        events = host(wstac, "run", file, "--readout", "0", "--json", *asked)
        # The golden vectors need no model.
        what = ("--bins",) if model is None else ("--bin", "emulated", "--bin", "cost")
        for target in sorted({board.target for board in chosen}):
            programs = boards.build(target, *what, model=model)
            for board in (board for board in chosen if board.target == target):
                boards.run(board, programs / "emulated", folder, serial="file:serial")
                stack = int.from_bytes((folder / "stack").read_bytes(), "little")
                same(board, f"events with model {name}", host(wstac, "monitor", folder / "serial", "--json"), events)
                cost = json.loads(boards.run(board, programs / "cost", folder))
                same(board, "features", features(folder), on_host)
                size = boards.sizes(programs / "emulated")
                found = numbers[board.core]
                if name is None:
                    without_frames(board, programs / "emulated")
                    print(f"{board.core}: {link.check(board, programs / 'emulated', folder, wstac, everything)}", flush=True)
                    print(f"{board.core}: {golden.check(board, programs, folder)}", flush=True)
                    found |= {key: cost[key] for key in ("whole", "stripes", "logs", "trigger", "speed", "direction", "edges", "motion", "live") if cost[key]}
                    found |= {"flash": size.flash, "ram": size.ram + stack}
                else:
                    found |= {name: cost["texture"], f"{name}, flash": size.flash - found["flash"], f"{name}, ram": size.ram + stack}
                slides = sum('"kind":"event"' in line for line in events)
                if (cost["events"], cost["frames"]) != (slides, len(on_host)):
                    sys.exit(f"{board.core}: {cost['events']} events in {cost['frames']} frames, expected {slides} in {len(on_host)}")
                print(f"{board.core}, model {name}: {cost['events']} events and {cost['frames']} frames as on the host", flush=True)
    return numbers


def formats_too(wstac, folder):
    """Checks every pixel format on one of the boards in turn, and with one of the laws. An unknown name must be refused."""
    counter = Counter(wstac, folder, debug=True)
    for k, name in enumerate(formats()):
        board = BOARDS[k % len(BOARDS)]
        law = LAWS[(k + k // len(BOARDS)) % len(LAWS)]
        counter.setting(Setting(name, law=law), cores=(board.core,))
        print(f"{board.core}: events and features of {name} with {law} as on the host", flush=True)
    refused = boards.refused(pixels="YUY2")
    if "WSTAC_PIXELS=YUY2: expected one of GREY, " not in refused:
        sys.exit(f"WSTAC_PIXELS=YUY2 must be refused, the build said {refused!r}")


def main():
    match sys.argv[1:]:
        case [wstac, *rest] if rest in ([], ["--base"], ["--write"]):
            base = rest == ["--base"]
        case _:
            sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        if base:
            numbers = measure(wstac, Path(folder), {None: None}, [board for board in BOARDS if board.core in FEW])
        else:
            numbers = measure(wstac, Path(folder), MODELS)
            formats_too(wstac, Path(folder))
    if not base:
        for target in boards.TARGETS:
            images.measure(target, numbers)
    print("\n".join(budget.table(numbers)))
    if rest == ["--write"]:
        budget.write(numbers)
    sys.exit(not budget.check(numbers, BASE if base else budget.ROWS))


if __name__ == "__main__":
    main()
