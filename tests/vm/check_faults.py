"""Checks what guest/faults.sh left: check_faults.py RESULTS."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path

from results import Run, verdict

FRAME = 320 * 180


def check_gaps(run: Run, at_least: int) -> tuple[list[str], str]:
    """Lost frames are counted one by one, and the frames that came keep their time."""
    frames = run.saved(FRAME)
    times, gaps, counted = run.arrived(frames), run.lost(frames), run.end["dropped"]
    problems = []
    if gaps.start < at_least:
        problems.append(f"only {gaps.start} frames were lost, so this proves little")
    if counted not in gaps:
        problems.append(f"dropped {counted}, but the sequence has gaps of {gaps}")
    said = [record["frame"] for record in run.of_kind("features")]
    if not set(times) <= set(said):
        problems.append(f"features at {said[:8]}…, but the buffers are those of {times[:8]}…")
    return problems, f"{frames} frames, {counted} lost"


def dropped(run: Run) -> tuple[list[str], str]:
    """Three buffers in ten lost."""
    return check_gaps(run, 10)


def wrapped(run: Run) -> tuple[list[str], str]:
    """The same while the sequence number goes through 2^32."""
    sequences = [buffer.sequence for buffer in run.buffers]
    problems, note = check_gaps(run, 20)
    if max(sequences) < 0xFFFF_FF80 or min(sequences) > 1000:
        problems.append("the sequence number did not wrap")
    return problems, note


def flagged(run: Run) -> tuple[list[str], str]:
    """Buffers that the driver marks as damaged are lost frames."""
    bad = sum(buffer.flagged for buffer in run.buffers)
    problems, note = check_gaps(run, 2)
    return problems + (["no buffer was flagged"] if not bad else []), f"{note}, {bad} flagged"


def slow(run: Run) -> tuple[list[str], str]:
    """A camera slower than asked is used as it is, and the user is told."""
    rate = re.search(r"([\d.]+) fps|Frames per second: ([\d.]+)", (run.directory / "slow.format").read_text())
    rate = float(rate[1] or rate[2])
    problems = [] if rate < 30 else [f"the driver grants {rate} fps, so this proves nothing"]
    problems += [] if "fps" in run.stderr else ["nothing on standard error about the frame rate"]
    # A button pressed for the run before may mark one of these as damaged.
    frames = len(run.of_kind("features")) + run.end["dropped"]
    return problems + ([] if frames == 8 else [f"{frames} frames, not 8"]), f"{rate} fps"


def stopped(run: Run) -> tuple[list[str], str]:
    """SIGINT and SIGTERM finish everything that was begun."""
    size = run.raw.stat().st_size
    saved, said = size // FRAME, run.end["frames"]
    problems = [] if size % FRAME == 0 else ["the raw file ends inside a frame"]
    problems += [] if saved > 20 else [f"only {saved} frames in three seconds"]
    problems += [] if saved == said or run.end["dropped"] else [f"{saved} frames saved, {said} counted"]
    # A busy machine may lose a frame here, too; frames lost at the very end have no place in time.
    printed, lost = len(run.of_kind("features")), run.end["dropped"]
    if not printed <= said <= printed + lost:
        problems.append(f"the end record counts {said} frames, {printed} were printed and {lost} lost")
    return problems, f"{said} frames"


def devices(run: Run) -> tuple[list[str], str]:
    """Cameras are listed, other video nodes are not."""
    problems = [] if "/dev/video0" in run.stdout else ["/dev/video0 is not listed"]
    return problems + (["the output node /dev/video1 is listed"] if "/dev/video1" in run.stdout else []), ""


# Runs that have to succeed.
SOUND: dict[str, Callable[[Run], tuple[list[str], str]]] = {
    "devices": devices, "dropped": dropped, "wrapped": wrapped, "flagged": flagged, "slow": slow,
    "interrupted": stopped, "terminated": stopped,
}  # fmt: skip
# A camera that refuses to start once: an error in words, or another try that succeeds.
REFUSED = ("streamon", "reqbufs")
# A camera that fails on the way: what came before is finished, whatever the exit code.
BROKEN = ("qbuf", "fatal", "disconnected")


def judge(run: Run, name: str) -> tuple[list[str], str]:
    """The problems of one run, and a note."""
    if name in SOUND:
        problems = run.trouble()
        return (problems, "") if problems else SOUND[name](run)
    problems = run.crash()
    if name in REFUSED:
        started = run.exit == 0 and len(run.of_kind("features")) == 5
        problems += [] if started or run.exit == 1 and run.stderr.strip() else [f"exit code {run.exit}, {run.stderr!r}: not an error in words"]
    else:
        problems += [] if run.end["frames"] > 0 else ["no frames before the fault"]
    return problems, f"exit code {run.exit}: {run.stderr.strip().splitlines()[-1] if run.stderr.strip() else 'silent'}"


for each in (*SOUND, *REFUSED, *BROKEN):
    try:
        verdict(f"faults {each}", *judge(Run(Path(sys.argv[1]), each), each))
    except Exception as error:  # a broken record must cost one check, not the rest
        verdict(f"faults {each}", [f"{type(error).__name__}: {error}"])
