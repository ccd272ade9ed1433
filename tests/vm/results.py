"""Reads the results of a guest, and prints the one-line verdicts of the checks."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise, takewhile
from pathlib import Path

REFERENCE = Path(__file__).resolve().parent.parent / "reference"


def verdict(name: str, problems: list[str], note: str = "") -> None:
    """Prints `ok` or `FAILED`. `run` counts these lines."""
    print(f"FAILED {name}: {'; '.join(problems)}" if problems else f"ok {name}{': ' if note else ''}{note}", flush=True)


@dataclass(frozen=True)
class Buffer:
    """A buffer as the kernel returned it."""

    sequence: int
    flagged: bool
    # Of the monotonic clock, in seconds. Wraps if vivid is set to wrap it.
    time: float


class Run:
    """A `watched` command: its output, its end, and the buffers that it got."""

    def __init__(self, directory: Path, name: str) -> None:
        self.directory = directory
        base = directory / name
        self.raw = Path(f"{base}.raw")
        self.stderr = Path(f"{base}.err").read_text(errors="replace")
        self.exit = int(Path(f"{base}.exit").read_text())
        self.stdout = Path(f"{base}.out").read_text(errors="replace")
        self.buffers = [
            Buffer(
                int(re.search(r"sequence = (\d+)", line)[1]),
                "ERROR" in re.search(r"flags = (.*?), field", line)[1],
                int(re.search(r"timestamp = (\d+)", line)[1]) / 1e9,
            )
            for line in Path(f"{base}.trace").read_text().splitlines()
        ]

    @cached_property
    def records(self) -> list[dict]:
        """Returns the JSON records. Raises an error for a line that is not JSON."""
        return [json.loads(line) for line in self.stdout.splitlines()]

    def of_kind(self, kind: str) -> list[dict]:
        """Returns the records of one kind, in order."""
        return [record for record in self.records if record["kind"] == kind]

    @property
    def end(self) -> dict:
        """Returns the end record, which has to be the last one."""
        records = self.records
        if not records or records[-1]["kind"] != "end":
            raise LookupError("the output does not end with an end record")
        return records[-1]

    def crash(self) -> list[str]:
        """Returns the problems of any run, whatever its options: panics, signals, no end within the guest's limit."""
        problems = []
        if "panicked" in self.stderr:
            problems.append("panic: " + self.stderr[self.stderr.index("panicked") :][:200].replace("\n", " "))
        if self.exit > 2:
            problems.append(f"exit code {self.exit}")
        return problems

    def trouble(self) -> list[str]:
        """Returns the problems of a run that should have succeeded."""
        problems = self.crash()
        if not problems and self.exit != 0:
            problems.append(f"exit code {self.exit}: {self.stderr.strip()[-300:]!r}")
        return problems

    def saved(self, frame_bytes: int) -> int:
        """Returns the number of saved frames."""
        frames, rest = divmod(self.raw.stat().st_size, frame_bytes)
        if rest or not frames:
            raise LookupError(f"{self.raw.stat().st_size} raw bytes are not frames of {frame_bytes}")
        return frames

    def sound(self) -> list[int]:
        """Returns when each undamaged buffer was taken, in frames since the first buffer.

        The sequence number wraps at 2^32. On a busy machine, vivid gives the same number to two frames in a row. The
        second is a frame like any other, so a step is never less than 1.
        """
        steps = [(later.sequence - earlier.sequence) & 0xFFFF_FFFF for earlier, later in pairwise(self.buffers)]
        times = accumulate((step if 0 < step < 1 << 31 else 1 for step in steps), initial=0)
        return [time for time, buffer in zip(times, self.buffers) if not buffer.flagged]

    def arrived(self, frames: int) -> list[int]:
        """Returns when the saved frames were taken."""
        sound = self.sound()
        if len(sound) < frames:
            raise LookupError(f"the kernel handed out {len(sound)} sound buffers, but {frames} were saved")
        return sound[:frames]

    def lost(self, frames: int) -> range:
        """Returns how many frames were lost or damaged by the kernel's sequence numbers.

        The number is exact up to the last saved frame. Those between it and the next buffer may be counted too, because
        a limit on frames, or a signal, ends a run before or after the gap.
        """
        sound, last = self.sound(), self.arrived(frames)[-1]
        before = last + 1 - frames
        damaged = sum(1 for _ in takewhile(lambda buffer: buffer.flagged, reversed(self.buffers)))
        after = sound[frames] - last - 1 if len(sound) > frames else damaged
        return range(before, before + after + 1)


    def lost_by_time(self, frames: int, rate: float, unsaved: int = 0) -> range:
        """Returns how many frames were lost, damaged or never taken by the kernel's timestamps. It is valid across
        breaks of the stream, each of which may shift frames by half a period. `unsaved` undamaged buffers were refused
        before the last frame.
        """
        sound = [buffer for buffer in self.buffers if not buffer.flagged]
        last = frames + unsaved - 1
        if len(sound) <= last:
            raise LookupError(f"the kernel handed out {len(sound)} sound buffers, but {last + 1} were taken")
        times = [buffer.time for buffer in sound]
        breaks = 1 + sum(later.sequence < earlier.sequence for earlier, later in pairwise(self.buffers))
        lost = round((times[last] - times[0]) * rate) + 1 - frames
        after = round((times[last + 1] - times[last]) * rate) - 1 if len(sound) > last + 1 else 0
        return range(max(lost - breaks, 0), lost + breaks + max(after, 0) + 1)


def reference_features(raw: Path, fourcc: str, size: tuple[int, int], line: int, colors: Sequence[str] = ()) -> list[list[int]]:
    """Returns the features of each raw frame from the float64 reference, in units of 1/2048. Colors are matrix and range."""
    # Imported here, because other checks have no NumPy.
    sys.path.insert(0, str(REFERENCE))
    from wstac_reference.features import Features, row_and_column_sums
    from wstac_reference.formats import by_fourcc
    from wstac_reference.green import GreenSums, YCbCr
    from wstac_reference.layout import paper_layout

    ycbcr = YCbCr(*(colors or ("bt601", "limited")), "exact")
    green = GreenSums(by_fourcc(fourcc), *size, line, paper_layout(*size), 1, ycbcr)
    features, data = Features(green.full_scale, green.pixels, 0.5), raw.read_bytes()
    frames = [data[at : at + green.frame_bytes] for at in range(0, len(data), green.frame_bytes)]
    return [features.of(row_and_column_sums(green.sums(frame))) for frame in frames]


def compare_features(run: Run, times: list[int], expected: list[list[int]]) -> tuple[list[str], str]:
    """Compares each saved frame's features with the reference. Returns the problems and a summary."""
    measured = {record["frame"]: record["f"] for record in run.of_kind("features")}
    missing = [time for time in times if time not in measured]
    if missing:
        return [f"no features for frames {missing[:5]}"], ""
    off = []
    for time, want in zip(times, expected, strict=True):
        got = [value * 2048 for value in measured[time]]
        if len(got) != 10 or any(value != int(value) for value in got):
            return [f"frame {time}: not ten multiples of 1/2048"], ""
        off += [abs(int(value) - reference) for value, reference in zip(got, want, strict=True)]
    summary = f"{len(off)} features, {sum(d == 1 for d in off)} one unit off"
    return ([f"{sum(d > 1 for d in off)} of {len(off)} features off, worst {max(off)} units"] if max(off) > 1 else []), summary
