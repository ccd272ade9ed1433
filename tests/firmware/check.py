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
import parts
from boards import BOARDS, ROOT
from counter import ROOMY, Counter, Setting, formats, write_samples
from host import features, host, on_board, same

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
LAWS = ('estimator = "edges"', 'law = "published"', 'estimator = "coherence"')
# The boards with memory for live motion by 25 taxels, and for all that is counted: a microbit has it for the events alone.
WITH_TAXELS = (ROOMY, *BOARDS[1:])
FRAME = 400 * 400
STRIPE = 8 * 400


def clip(wstac, folder, scene="clip.toml"):
    """Returns slides: as a file for the host, and as plain frames for the boards."""
    file = folder / "clip.y4m"
    subprocess.run([wstac, "scene", "render", HERE / scene, "-o", file, "--force"], check=True, capture_output=True)
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


def by_wave(folder):
    """Returns an empty configuration, whose estimator is that of 25 taxels."""
    file = folder / "wave.toml"
    file.touch()
    return file


def measure(wstac, folder, models, chosen=BOARDS, debug=True):
    """Builds and runs the firmware with each of these models on these boards. Returns numbers by core and program. Debug information
    is for who builds more with it afterwards.
    """
    file = clip(wstac, folder)
    write_samples(wstac, folder / "samples")
    numbers = {board.core: {} for board in chosen}
    how = ("--config", boards.CONFIG, "--readout", "0", "--json")
    everything = host(wstac, "run", file, *how, "--features", "--samples")
    on_host = [record["f"] for record in map(json.loads, everything) if record["kind"] == "features"]
    for name, model in models.items():
        asked = [] if model is None else ["--model", model]
        events = host(wstac, "run", file, *how, *asked)
        # The golden vectors need no model.
        what = ("--bins",) if model is None else ("--bin", "emulated", "--bin", "cost")
        for target in sorted({board.target for board in chosen}):
            programs = boards.build(target, *what, model=model, debug=debug)
            for board in (board for board in chosen if board.target == target):
                stack = on_board(board, programs / "emulated", folder, wstac, f"events with model {name}", events)
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


def wave(wstac, folder, numbers, count=len(BOARDS)):
    """Checks the law of 25 taxels on objects that are narrower than the sensor, on the first boards, and adds its costs to the numbers."""
    folder /= "wave"
    folder.mkdir()
    file, config = clip(wstac, folder, "balls.toml"), by_wave(folder)
    events = host(wstac, "run", file, "--readout", "0", "--json", "--config", config)
    live = host(wstac, "run", file, "--readout", "0", "--json", "--config", config, "--features", "--motion")
    found = [(line["basis"], line["reliable"]) for line in map(json.loads, events) if line["kind"] == "event"]
    if sorted(found) != [("edge", True), ("outline", True), ("outline", True)]:
        sys.exit(f"the host's answers about balls are {found}, which says little about a board")
    for small, board in tuple(zip(BOARDS, WITH_TAXELS, strict=True))[:count]:
        features = "emulated" if small == board else "mps2"
        programs = boards.build(board.target, "--bin", "emulated", "--bin", "golden", config=config, features=f"{features},motion")
        print(f"{board.core}, by a wave, {link.check(board, programs / 'emulated', folder, wstac, live, '--motion')}", flush=True)
        print(f"{board.core}: live motion of {golden.check_velocities(board, programs, folder)} touches to the bit", flush=True)
        if count == len(BOARDS):
            numbers[board.core] |= parts.measure(board, programs / "golden", folder)
        programs = boards.build(board.target, "--bin", "emulated", config=config)
        stack = on_board(small, programs / "emulated", folder, wstac, "events by a wave", events)
        size, of = boards.sizes(programs / "emulated"), numbers[board.core]
        of |= {"wave, flash": size.flash - of["flash"], "wave, ram": size.ram + stack}
        print(f"{board.core}, by a wave: {len(found)} events as on the host", flush=True)


def by_matrix(wstac, folder, board=BOARDS[-1]):
    """Checks that a board with a matrix of cross-talk has the host's events, which are not those without it."""
    folder /= "matrix"
    folder.mkdir()
    file, config = clip(wstac, folder, "balls.toml"), by_wave(folder)
    how = ("run", file, "--readout", "0", "--json", "--config")
    without = host(wstac, *how, config)
    rows = [[1 if a == b else 0.05 * (abs(a // 5 - b // 5) + abs(a % 5 - b % 5) == 1) for b in range(25)] for a in range(25)]
    config.write_text(f"[layout]\ncrosstalk = {rows}\n")
    events = host(wstac, *how, config)
    on_board(board, boards.build(board.target, "--bin", "emulated", config=config) / "emulated", folder, wstac, "events with a matrix of cross-talk", events)
    if events == without:
        sys.exit("a matrix of cross-talk changes no event")
    print(f"{board.core}: {len(events)} records with a matrix of cross-talk as on the host", flush=True)


def slip(wstac, folder, board=BOARDS[2]):
    """Checks that a board sends the host's slip of a held part, and that its press is unclear then."""
    folder /= "slip"
    folder.mkdir()
    file, config = clip(wstac, folder, "held.toml"), by_wave(folder)
    # Without a model, a host says so about a touch that is no slide, too.
    events = host(wstac, "run", file, "--readout", "0", "--json", "--config", config, "--model", MODELS["taxel-path-svm"])
    lines = [json.loads(line) for line in events]
    found = [(line.get("onset_frame"), line.get("contact"), line.get("reliable")) for line in lines if line["kind"] in ("slip", "event")]
    on_board(board, boards.build(board.target, "--bin", "emulated", config=config) / "emulated", folder, wstac, "a slip", events)
    if found[:2] != [(75, None, None), (None, "unclear", False)]:
        sys.exit(f"the host's slip and event are {found}, expected one from frame 75 on, and an unclear touch")
    print(f"{board.core}: a slip as on the host", flush=True)


def refusals(folder):
    """Checks that a build names a pixel format that it does not know, and live motion that a small board has no memory for."""
    for named, expected in (
        ({"pixels": "YUY2"}, "WSTAC_PIXELS=YUY2: expected one of GREY, "),
        ({"config": by_wave(folder), "features": "emulated,motion"}, '[speed] estimator is "wave", which takes more with the feature motion'),
    ):
        refused = boards.refused(**named)
        if expected not in refused:
            sys.exit(f"{named} must be refused with {expected!r}, the build said {refused!r}")


def formats_too(wstac, folder):
    """Checks every pixel format on one of the boards in turn, and with one of the laws."""
    counter = Counter(wstac, folder, debug=True)
    for k, name in enumerate(formats()):
        board = BOARDS[k % len(BOARDS)]
        law = LAWS[(k + k // len(BOARDS)) % len(LAWS)]
        counter.setting(Setting(name, law=law), cores=(board.core,))
        print(f"{board.core}: events and features of {name} with {law} as on the host", flush=True)


def main():
    match sys.argv[1:]:
        case [wstac, *rest] if rest in ([], ["--base"], ["--write"]):
            base = rest == ["--base"]
        case _:
            sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        if base:
            numbers = measure(wstac, Path(folder), {None: None}, [board for board in BOARDS if board.core in FEW], debug=False)
            # The board with the least memory: it has to run the wave at all.
            wave(wstac, Path(folder), {"M0": dict(numbers["M0"])}, 1)
        else:
            numbers = measure(wstac, Path(folder), MODELS)
            wave(wstac, Path(folder), numbers)
            by_matrix(wstac, Path(folder))
            slip(wstac, Path(folder))
            refusals(Path(folder))
            formats_too(wstac, Path(folder))
    if not base:
        for target in boards.TARGETS:
            images.measure(target, numbers)
    print("\n".join(budget.table(numbers)))
    if rest == ["--write"]:
        boards.keep(budget.PAGE, budget.BEGIN, budget.table(numbers))
    sys.exit(not budget.check(numbers, BASE if base else budget.ROWS))


if __name__ == "__main__":
    main()
