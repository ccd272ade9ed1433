"""Checks the results of guest/faults.sh, and writes the table of faults: check_faults.py RESULTS."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from results import Run, verdict

FRAME, RATE = 320 * 180, 30


@dataclass
class Seen:
    """The result of one run."""

    problems: list[str]
    note: str = ""
    # Lost frames as wstac counts them, and as the kernel's trace has them.
    counted: int | None = None
    kernel: range | None = None
    # Frames that arrived.
    came: int | None = None


def faults(run: Run) -> list[str]:
    """Returns the reported faults in order."""
    return [record["fault"] for record in run.of_kind("fault")]


def by_sequence(run: Run, at_least: int = 0) -> Seen:
    """Lost frames are counted one by one, and the other frames keep their time."""
    frames = run.saved(FRAME)
    times, gaps, counted = run.arrived(frames), run.lost(frames), run.end["dropped"]
    problems = []
    if gaps.start < at_least:
        problems.append(f"only {gaps.start} frames were lost, so this proves little")
    if counted not in gaps:
        problems.append(f"dropped {counted}, but the sequence has gaps of {gaps}")
    said = {record["frame"] for record in run.of_kind("features")}
    # A busy machine stamps buffers late. That looks like an extra frame until the next buffer.
    off = [time for time in times if not any(near in said for near in range(time - 2, time + 3))]
    if off:
        problems.append(f"no features near frames {off[:8]}")
    if faults(run):
        problems.append(f"faults were reported: {faults(run)}")
    return Seen(problems, f"{frames} frames", counted, gaps, frames)


def by_time(run: Run, *expected: str) -> Seen:
    """Each fault is reported once, and the frames after it keep their time."""
    frames = run.saved(FRAME)
    refused = re.search(r"(\d+) frames? lost: no signal", run.stderr)
    kernel = run.lost_by_time(frames, RATE, int(refused[1]) if refused else 0)
    counted, told = run.end["dropped"], faults(run)
    problems = [] if told == list(expected) else [f"reported {told}, expected {list(expected)}"]
    if counted not in kernel:
        problems.append(f"dropped {counted}, but the kernel's times say {kernel}")
    # The last frame that arrived has its place in time. One may wait for what comes after it.
    last, place = run.of_kind("features")[-1]["frame"], frames - 1 + kernel.start
    if not place - 1 <= last <= frames - 1 + kernel.stop:
        problems.append(f"the last features are of frame {last}, in the kernel's times it is {place}")
    kinds = [record["kind"] for record in run.records]
    if told and "features" not in kinds[len(kinds) - kinds[::-1].index("fault") :]:
        problems.append("no frames after the last fault")
    return Seen(problems, f"{frames} frames", counted, kernel, frames)


def wrapped(run: Run) -> Seen:
    """The sequence number passes 2^32 while three buffers in ten are lost."""
    sequences = [buffer.sequence for buffer in run.buffers]
    seen = by_sequence(run, 20)
    if max(sequences) < 0xFFFF_FF80 or min(sequences) > 1000:
        seen.problems.append("the sequence number did not wrap")
    return seen


def time_wrapped(run: Run) -> Seen:
    """The timestamp passes 2^63 ns and is below 0 from then on."""
    seen = by_sequence(run)
    times = [buffer.time for buffer in run.buffers]
    if not min(times) < 2**63 / 1e9 < max(times):
        seen.problems.append("the timestamp did not wrap")
    return seen


def flagged(run: Run) -> Seen:
    """Buffers that the driver marks as damaged are lost frames."""
    bad = sum(buffer.flagged for buffer in run.buffers)
    seen = by_sequence(run, 2)
    seen.note += f", {bad} flagged"
    seen.problems += [] if bad else ["no buffer was flagged"]
    return seen


def restarted(run: Run) -> Seen:
    """The stream is started again until it starts."""
    told = faults(run)
    refusals = told.count("refused")
    seen = by_time(run, "disconnected", *["refused"] * refusals, "reconnected")
    seen.problems += [] if refusals else ["starting again was never refused"]
    return seen


def found(run: Run, there: str) -> Seen:
    """The same camera is found at its new path."""
    seen = by_time(run, "disconnected", "reconnected")
    said = [record["message"] for record in run.of_kind("fault")][-1]
    number = re.match(r"/dev/video(\d+)", said)
    if number is None or number[1] == "0":
        seen.problems.append(f"came back as {said!r}, not as {there}")
    return seen


def newest(run: Run) -> Seen:
    """A program that was stopped skips what waited, and time does not shift."""
    times = [buffer.time for buffer in run.buffers]
    all_frames, said = round((times[-1] - times[0]) * RATE) + 1, run.end["frames"]
    skipped = re.search(r"(\d+) frames? lost: skipped for newer ones", run.stderr)
    problems = [] if skipped else ["nothing was skipped"]
    # Buffers that were taken from the driver, but not used because the run was stopped. The driver has eight.
    least = round((times[-9] - times[0]) * RATE)
    problems += [] if least <= said <= all_frames + 1 else [f"{said} frames, by the kernel's times {least} to {all_frames}"]
    problems += [] if re.search(r"up to \d+ frames? behind the camera", run.stderr) else ["not said how far behind"]
    printed = len(run.of_kind("features"))
    return Seen(problems, f"{skipped[1] if skipped else 0} skipped", run.end["dropped"], range(least - printed, all_frames - printed + 2), printed)


def slow(run: Run) -> Seen:
    """A camera slower than requested is used as it is, and this is reported."""
    rate = re.search(r"([\d.]+) fps|Frames per second: ([\d.]+)", (run.directory / "slow.format").read_text())
    rate = float(rate[1] or rate[2])
    problems = [] if rate < 30 else [f"the driver grants {rate} fps, so this proves nothing"]
    problems += [] if "fps" in run.stderr else ["nothing on standard error about the frame rate"]
    # A button pressed for the run before may mark one of these as damaged.
    frames = len(run.of_kind("features")) + run.end["dropped"]
    return Seen(problems + ([] if frames >= 8 else [f"{frames} frames, not 8"]), f"{rate:g} fps")


def stopped(run: Run) -> Seen:
    """SIGINT and SIGTERM finish everything that was begun."""
    size = run.raw.stat().st_size
    saved, said = size // FRAME, run.end["frames"]
    problems = [] if size % FRAME == 0 else ["the raw file ends inside a frame"]
    problems += [] if saved > 20 else [f"only {saved} frames"]
    problems += [] if saved == said or run.end["dropped"] else [f"{saved} frames saved, {said} counted"]
    # A busy machine may lose a frame here, too. Frames lost at the very end have no place in time.
    printed, lost = len(run.of_kind("features")), run.end["dropped"]
    if not printed <= said <= printed + lost:
        problems.append(f"the end record counts {said} frames, {printed} were printed and {lost} lost")
    return Seen(problems, f"{said} frames")


def devices(run: Run) -> Seen:
    """Cameras are listed, other video nodes are not."""
    problems = [] if "/dev/video0" in run.stdout else ["/dev/video0 is not listed"]
    return Seen(problems + (["the output node /dev/video1 is listed"] if "/dev/video1" in run.stdout else []))


def refused(run: Run) -> Seen:
    """A camera does not start at first. The result is an error message, or another try that succeeds."""
    started = run.exit == 0 and len(run.of_kind("features")) == 5
    sound = started or run.exit == 1 and run.stderr.strip()
    problems = [] if sound else [f"exit code {run.exit}, {run.stderr!r}: not an error in words"]
    return Seen(problems, f"exit code {run.exit}: {run.stderr.strip().splitlines()[-1]}")


# Name, description, and function that judges.
FAULTS: list[tuple[str, str, Callable[[Run], Seen]]] = [
    ("dropped-1", "1 % of the buffers dropped", by_sequence),
    ("dropped-30", "30 % of the buffers dropped", lambda run: by_sequence(run, 30)),
    ("dropped-90", "90 % of the buffers dropped", lambda run: by_sequence(run, 150)),
    ("flagged", "the driver marks buffers as damaged", flagged),
    ("wrapped", "30 % dropped while the sequence number wraps", wrapped),
    ("timewrap", "the timestamp wraps", time_wrapped),
    ("qbuf", "the driver refuses to take a buffer back (QBUF)", by_time),
    ("streamon", "the stream does not start (STREAMON) when the program starts", refused),
    ("reqbufs", "the driver gives no buffers (REQBUFS) when the program starts", refused),
    ("fatal", "fatal streaming error", lambda run: by_time(run, "disconnected", "reconnected")),
    ("restart", "fatal streaming error, then STREAMON, REQBUFS and QBUF fail", restarted),
    ("disconnected", "disconnected", lambda run: by_time(run, "disconnected", "reconnected")),
    ("unplugged", "unplugged, and plugged in again after 2 s", lambda run: by_time(run, "disconnected", "reconnected")),
    ("replaced", "unplugged, and another camera takes its number", lambda run: found(run, "another node")),
    ("moved", "unplugged, and returns under another number, opened by a link with its serial number", lambda run: found(run, "another node")),
    ("signal", "no signal for 2 s", lambda run: by_time(run, "no-signal", "signal")),
    ("slow", "the driver offers fewer frames per second than requested", slow),
    ("slower", "10 frames per second instead of 30 for a while", lambda run: by_time(run, "slow", "in-time")),
    ("reduced", "29.97 frames per second instead of 30", by_time),
    ("newest", "the program stops for one second", newest),
]  # fmt: skip
OTHERS: list[tuple[str, Callable[[Run], Seen]]] = [("devices", devices), ("interrupted", stopped), ("terminated", stopped)]


def judge(directory: Path, name: str, check: Callable[[Run], Seen]) -> tuple[Run | None, Seen]:
    """Reads the result of one run. A broken record must fail one check, and not the rest."""
    run = None
    try:
        run = Run(directory, name)
        problems = run.crash() if check is refused else run.trouble()
        seen = Seen(problems) if problems else check(run)
    except Exception as error:
        seen = Seen([f"{type(error).__name__}: {error}"])
    counts = "" if seen.counted is None else f", {seen.counted} lost, {between(seen.kernel)} by the kernel's trace"
    verdict(f"faults {name}", seen.problems, seen.note + counts)
    return run, seen


def between(counts: range) -> str:
    """Returns `7`, or `7 to 9` if the trace cannot tell."""
    return str(counts.start) if len(counts) == 1 else f"{counts.start} to {counts[-1]}"


def main(directory: Path) -> None:
    """Judges all runs and writes the table."""
    for name, check in OTHERS:
        judge(directory, name, check)
    rows = ["| fault | reported | received | lost, as counted | lost, by the kernel's trace |", "| --- | --- | --- | --- | --- |"]
    for name, title, check in FAULTS:
        run, seen = judge(directory, name, check)
        try:
            told = ", ".join(f"`{kind}`" for kind in faults(run)) or (seen.note if run.exit or check in (newest, slow) else "nothing") if run else ""
        except Exception:
            told = ""
        counted = ["–", "–", "–"] if seen.counted is None else [str(seen.came), str(seen.counted), between(seen.kernel)]
        rows.append(f"| {title} | {told} | {' | '.join(counted)} |{' FAILED |' if seen.problems else ''}")
    table = "\n".join(rows) + "\n"
    (directory / "table.md").write_text(table)
    print(table, end="")


main(Path(sys.argv[1]))
