"""Tests the live link: an emulated board's UART on a socket, and `wstac monitor` at its other end, which requests its
outputs.
"""

import json
import socket
import subprocess
import sys

import boards

# The frames of a sample behind which the requests are too late for it, with some for the later ones of them.
LATE = 40
# Fields that are times.
TIMES = ("time_ns", "completed_ns", "time_s", "completed_s", "stamp", "stamp_within_ms", "clock")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def monitored(board, elf, folder, wstac, what):
    """Runs the board with `wstac monitor` at the other end of its UART. Returns the finished command."""
    port = free_port()
    # The board starts when the host is there.
    command = boards.command(board, elf, f"tcp:127.0.0.1:{port},server=on,wait=on")
    qemu = subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        for _ in range(100):
            asked = [wstac, "monitor", f"tcp:127.0.0.1:{port}", "--json", "--features", what]
            done = subprocess.run(asked, capture_output=True, text=True, timeout=300, check=False)
            if done.stdout or qemu.poll() is not None:
                break
    finally:
        qemu.kill()
        qemu.wait()
    return done


def is_late(got, expected):
    """Returns whether the first frame with features is too far into the sample of the first event, the request for motion came
    after the first motion, or the board's first frames came before the host was there, so that it counts fewer.
    """
    first = lambda lines, kind, key="frame": next((line[key] for line in map(json.loads, lines) if line["kind"] == kind), None)
    begins, event = first(got, "features"), first(expected, "event")
    if first(got, "motion") != first(expected, "motion"):
        return True
    is_short = first(got, "end", "frames") != first(expected, "end", "frames")
    return is_short or begins is None or event is not None and begins >= event + LATE


def timeless(line):
    """Returns a record without its times. Over a live link they are those of the board's clock, which runs by itself."""
    return {name: value for name, value in json.loads(line).items() if name not in TIMES}


def check(board, elf, folder, wstac, expected, what="--samples"):
    """Compares the output with the lines of `wstac run --json --features` on the same frames, with samples or with motion."""
    # The emulated board is faster than a real one. On a busy machine the requests may reach it behind the first event.
    for _ in range(5):
        done = monitored(board, elf, folder, wstac, what)
        if done.returncode:
            sys.exit(f"{board.core}: wstac monitor failed ({done.returncode}): {done.stderr.strip()}")
        got = done.stdout.splitlines()
        if not is_late(got, expected):
            break
        print(f"{board.core}: the requests came too late; again")
    got, expected = [timeless(line) for line in got], [timeless(line) for line in expected]
    got_features = [record for record in got if record["kind"] == "features"]
    got_others = [record for record in got if record["kind"] != "features"]
    want_others = [record for record in expected if record["kind"] != "features"]
    if got_others != want_others:
        apart = next((pair for pair in zip(got_others, want_others) if pair[0] != pair[1]), (len(got_others), len(want_others)))
        apart = " for ".join(str(one)[:300] for one in apart)
        sys.exit(f"{board.core}: events over the live link are not the host's: {apart}: {done.stderr.strip()}")
    # The request takes some time to arrive. After that, the features of every frame are there.
    want_features = [record for record in expected if record["kind"] == "features"]
    if not got_features or got_features != want_features[-len(got_features) :]:
        sys.exit(f"{board.core}: features over the live link are not the host's: {len(got_features)} of them")
    return f"over its UART live: {len(got) - len(got_features)} records with {what[2:]}, features of {len(got_features)} frames"
