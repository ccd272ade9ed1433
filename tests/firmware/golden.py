"""Runs the golden vectors of the independent reference on emulated boards: every pixel format, layout, rate, gap and
rule by the published algorithm, and every motion by arrival times.
"""

import json
import struct
import sys
from pathlib import Path

import boards

GOLDEN = boards.ROOT / "tests/golden"
MOSAICS = [order + bits for bits in ("8", "10", "12") for order in ("RGGB", "GRBG", "GBRG", "BGGR")]
FORMATS = [*"GREY Y10 Y12 Y16 RGB24 BGR24 RGBX32 XRGB32 RGB565".split(), *MOSAICS, *"YUYV UYVY NV12 YU12 YUV422P YUV444P".split()]
ALIKE = {"BGRX32": "RGBX32", "XBGR32": "XRGB32"}  # formats whose green is in the same place
HEADER = 80  # words
FEATURES, EVENT, END, CONTACT_END = 1, 2, 3, 4
# Every bit of every motion, by coherence and by edges. tests/whole checks that this machine's are the same.
MOTIONS = Path(__file__).with_name("motions.txt")
# Every bit of every velocity of live motion by 25 taxels, likewise; and dark frames before each touch.
VELOCITIES = Path(__file__).with_name("velocities.txt")
DARK, BEFORE = [300] * 25, 70


def packed(case, every_frame):
    """Returns a case as the program `golden` of wstac-fw reads it, with its part of all frames."""
    layout, trigger, speed = case["layout"], case["trigger"], case["speed"]
    taxel = layout.get("taxel", [0, 0])
    corners = layout.get("corners", [[0, 0]] * 25)
    known = ALIKE.get(case["format"], case["format"])
    words = struct.pack(
        "<11I", FORMATS.index(known), case["width"], case["height"], case["bytes_per_line"], case["frame_bytes"], *case["fps"],
        case["matrix"] == "bt709", case["range"] == "full", case["yuv"] == "linear", case["stride"],
    )
    words += struct.pack("<52I", *taxel, *(number for corner in corners for number in corner))
    words += struct.pack("<d", case["floor_levels"])
    words += struct.pack("<IdIId", trigger["window"], trigger["multiplier"], trigger["backtrack"], trigger["rule"] == "signed", trigger["margin"])
    words += struct.pack("<dI", speed["threshold"], speed["threshold_on"] == "above_baseline")
    words += struct.pack("<II", trigger.get("per_touch", False), case["frames"])
    words = words.ljust(4 * HEADER, b"\0")
    frames = every_frame[case["at"] :]
    lost = dict.fromkeys(range(case["frames"] + 1), 0)
    for index, count in case["lost"]:
        lost[index] += count
    for index in range(case["frames"]):
        words += struct.pack("<I", lost[index]) + frames[index * case["frame_bytes"] :][: case["frame_bytes"]]
    return words + struct.pack("<I", lost[case["frames"]])


def results(numbers):
    """Returns the features, the events, the ends of contacts and the end of every case."""
    at, features, events, ends = 0, [], [], []
    while at < len(numbers):
        kind = numbers[at]
        if kind == FEATURES:
            features.append(numbers[at + 2 : at + 12])
            at += 12
        elif kind == EVENT:
            events.append(numbers[at + 1 : at + 9])
            at += 9
        elif kind == CONTACT_END:
            ends.append(numbers[at + 1 : at + 3])
            at += 3
        else:
            yield features, events, ends, numbers[at + 1 : at + 3]
            at, features, events, ends = at + 3, [], [], []


def cases(board):
    """Returns the cases that a board has room for."""
    every = json.loads((GOLDEN / "manifest.json").read_text())["cases"]
    planar = {"NV12", "YU12", "YUV422P", "YUV444P"}
    # A planar frame is in RAM as a whole, and a single loss is a number of 32 bits.
    room = 6 * 1024 if board.core == "M0" else 32 * 1024
    # A board's program is built for a fixed baseline, and does not read a fitted range.
    plain = [case for case in every if "follow" not in case["trigger"] and "range_mm_s" not in case["speed"]]
    fits = [case for case in plain if case["format"] not in planar or case["frame_bytes"] <= room]
    return [case for case in fits if all(count < 2**32 for _, count in case["lost"])], len(every)


def write_touches(file):
    """Writes the samples of the motions as the program `golden` reads them. Returns their names."""
    every = json.loads((GOLDEN / "motion.json").read_text())["cases"]
    packed = (struct.pack("<10iI700h", *case["totals"], case["frames"], *(f for frame in case["features"] for f in frame)) for case in every)
    file.write_bytes(b"".join(packed))
    return [case["name"] for case in every]


def check_motions(board, names, found):
    """Compares the bits of a board's motions with those of a host. Returns how many there were."""
    expected = MOTIONS.read_text().splitlines()
    each = len(found) // len(names) // 2
    lines = [" ".join([name, *(found[at : at + each].hex() for at in (2 * k * each, (2 * k + 1) * each))]) for k, name in enumerate(names)]
    for line, want in zip(lines, expected, strict=True):
        if line != want:
            sys.exit(f"{board.core}: motion {line}, expected {want}")
    return len(lines)


def check_velocities(board, programs, folder):
    """Runs live motion by 25 taxels on a board alone, and compares its bits with those of a host. Returns how many touches."""
    write_waves(folder / "waves")
    for name in ("cases", "touches"):
        (folder / name).write_bytes(b"")
    boards.run(board, programs / "golden", folder)
    return same_velocities(board, (folder / "velocities").read_bytes())


def write_waves(file):
    """Writes the touches of waves as the program `golden` reads them."""
    packed = b""
    for case in json.loads((GOLDEN / "wave.json").read_text())["cases"]:
        ms = float("nan") if case["readout_ms"] is None else case["readout_ms"]
        frames = [DARK] * BEFORE + [[2**32 - 1] * 25 if sums is None else sums for sums in case["sums"]]
        packed += struct.pack("<IfI", int(case["fps"]), ms, len(frames)) + b"".join(struct.pack("<25I", *sums) for sums in frames)
    file.write_bytes(packed)


def same_velocities(board, found):
    expected = VELOCITIES.read_text().split()
    if found.hex() != "".join(expected):
        sys.exit(f"{board.core}: live velocities {found.hex()}, expected those of {VELOCITIES.name}")
    return len(expected)


def check(board, programs, folder):
    """Runs the cases on a board and compares. Returns how many there were."""
    chosen, every = cases(board)
    frames = memoryview((GOLDEN / "frames.raw").read_bytes())
    (folder / "cases").write_bytes(b"".join(packed(case, frames) for case in chosen))
    names = write_touches(folder / "touches")
    write_waves(folder / "waves")
    boards.run(board, programs / "golden", folder)
    # A microbit has no memory for taxels.
    waves = same_velocities(board, (folder / "velocities").read_bytes()) if board.core != "M0" else 0
    motions = check_motions(board, names, (folder / "motions").read_bytes())
    found = list(results(memoryview((folder / "results").read_bytes()).cast("h").tolist()))
    if len(found) != len(chosen):
        sys.exit(f"{board.core}: results of {len(found)} golden cases, expected {len(chosen)}")
    of_reference = json.loads((GOLDEN / "expected.json").read_text())
    equal = numbers = events_seen = ends_seen = 0
    for case, (features, events, contact_ends, end) in zip(chosen, found, strict=True):
        at = f"{board.core}, golden case {case['name']}"
        expected = of_reference[case["name"]]
        if len(features) != len(expected["features"]):
            sys.exit(f"{at}: {len(features)} feature frames, expected {len(expected['features'])}")
        for got, want in zip(features, expected["features"], strict=True):
            equal += sum(a == b for a, b in zip(got, want, strict=True))
            numbers += len(want)
            if any(abs(a - b) > 1 for a, b in zip(got, want, strict=True)):
                sys.exit(f"{at}: features {got}, expected {want} to within 1")
        if not expected["robust"]:
            continue
        of_end = [expected["end"]["frames"] % 2**16, expected["end"]["baseline"] == "complete"]
        if [end[0] % 2**16, end[1]] != of_end:
            sys.exit(f"{at}: end {end}, expected {of_end}")
        wanted = []
        for event in expected["events"]:
            duration, degrees = event["duration_frames"], event["direction"]["deg"]
            wanted.append([
                event["frame"], event["frames_filled"], event["reliable"],
                -1 if duration is None else duration, -1 if degrees is None else degrees,
                *(-1 if frame is None else frame % 2**15 for frame in event.get("touch", [None, None])),
            ])
        low = lambda event: [event[0] % 2**16, *event[1:]]
        if [low([*event[:5], *event[6:]]) for event in events] != [low(event) for event in wanted]:
            sys.exit(f"{at}: events {events}, expected {wanted}")
        wanted_ends = [[end["frame"] % 2**16, end["event_frame"] % 2**16] for end in expected.get("contact_ends", [])]
        if [[number % 2**16 for number in end] for end in contact_ends] != wanted_ends:
            sys.exit(f"{at}: ends of contacts {contact_ends}, expected {wanted_ends}")
        ends_seen += len(contact_ends)
        for event, want in zip(events, expected["events"], strict=True):
            mm_s = want["speed"]["mm_s"]
            most = 2**15 - 1
            if abs(event[5] - (-1 if mm_s is None else min(16 * mm_s, most))) > 1:
                sys.exit(f"{at}: speed {event[5] / 16} mm/s, expected {mm_s}")
        events_seen += len(events)
    return f"{len(chosen)} of {every} golden cases, {events_seen} events, {ends_seen} ends of contacts; {motions} motions and {waves} live touches to the bit; {equal} of {numbers} features equal, the others off by 1"
