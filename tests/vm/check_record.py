"""Checks the results of guest/record.sh: check_record.py RESULTS WSTAC."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

from mcap.reader import make_reader
from results import Run, verdict

FRAME, RATE = 320 * 180, 30


def read(wstac: str, *arguments: str | Path) -> tuple[str, list[dict]]:
    """Returns the output of `wstac run` for a recording: as text, and as records."""
    done = subprocess.run([wstac, "run", *arguments, "--json"], check=True, capture_output=True, text=True)
    return done.stdout, [json.loads(line) for line in done.stdout.splitlines()]


def frames_of(records: list[dict]) -> int:
    """Returns the frames that arrived, from the records of a run with features."""
    return sum(record["kind"] == "features" for record in records)


def recorded(run: Run, wstac: str) -> tuple[list[str], str]:
    """A camera went away and came back. The file replays the live output, and no frame is missing."""
    path = run.directory / "recorded.mcap"
    text, _ = read(wstac, path)
    problems = [] if text == run.stdout else [f"live {run.stdout!r}, of the file {text!r}"]
    kinds = [record.get("fault", record["kind"]) for record in run.records]
    if not {"disconnected", "reconnected", "event"} <= set(kinds):
        problems.append(f"the run shows {kinds}, which proves little")
    _, all_records = read(wstac, path, "--features")
    frames = frames_of(all_records)
    kernel, counted = run.lost_by_time(frames, RATE), run.end["dropped"]
    if counted not in kernel:
        problems.append(f"dropped {counted}, but the kernel's times say {kernel}")
    return problems, f"{frames} frames, {counted} lost, {kinds.count('event')} event(s)"


def killed(run: Run, wstac: str) -> tuple[list[str], str]:
    """The program was killed. What it had written is recovered."""
    whole = run.directory / "whole.mcap"
    done = subprocess.run([wstac, "recover", run.directory / "killed.mcap", "-o", whole], capture_output=True, text=True)
    if done.returncode:
        return [f"recover: exit code {done.returncode}: {done.stderr}"], ""
    frames, taken = frames_of(read(wstac, whole, "--features")[1]), len(run.buffers)
    problems = [] if run.exit == 137 else [f"exit code {run.exit}, not that of a killed program"]
    # All that the file holds, however long a busy machine kept the last ones waiting. Other records take less than a tenth.
    held = int(0.9 * (run.directory / "killed.mcap").stat().st_size / FRAME) - 1
    if not max(60, held) <= frames <= taken:
        problems.append(f"{frames} frames came back, the file has room for {held}, the kernel handed out {taken}")
    return problems, f"{frames} of {taken} frames came back"


def full(run: Run, wstac: str) -> tuple[list[str], str]:
    """A full disk ends a recording with a message, and the file is complete."""
    problems = [] if run.exit == 1 and "full.mcap: the disk is full" in run.stderr else [f"exit code {run.exit}: {run.stderr}"]
    path = run.directory / "full.mcap"
    records = read(wstac, path, "--features")[1]
    size, frames = path.stat().st_size, frames_of(records)
    if frames * FRAME < 0.8 * size or frames < 30:
        problems.append(f"{frames} frames in {size} bytes")
    done = subprocess.run([wstac, "recover", path, "-o", run.directory / "again.mcap"], capture_output=True, text=True)
    if "the recording was finished properly" not in done.stderr:
        problems.append(f"recover: {done.stderr}")
    return problems, f"{frames} frames in {size} bytes, finished properly"


def both(run: Run, wstac: str) -> tuple[list[str], str]:
    """Two cameras in one recording. The frames of each are in the order of the driver's times, and each has its own end."""
    path = run.directory / "both.mcap"
    _, records = read(wstac, path, "--features")
    problems, counts = [], {}
    for name in ("left", "right"):
        own = [record for record in records if record["sensor"] == name]
        times = [record["time_ns"] for record in own if record["kind"] == "features"]
        counts[name] = len(times)
        if times != sorted(set(times)) or own[-1]["kind"] != "end" or own[-1]["clock"] != "driver":
            problems.append(f"{name}: {len(times)} times, then {own[-1]}")
        live = [record for record in run.records if record["sensor"] == name and record["kind"] == "end"]
        if [own[-1]] != live:
            problems.append(f"{name}: live {live}, of the file {own[-1]}")
    with path.open("rb") as file:
        cameras = [
            (message.log_time, channel.topic)
            for _, channel, message in make_reader(file).iter_messages(log_time_order=False)
            if channel.topic.endswith("/camera")
        ]
    changes = sum(a[1] != b[1] for a, b in pairwise(cameras))
    for camera in {topic for _, topic in cameras}:
        times = [time for time, topic in cameras if topic == camera]
        if times != sorted(times):
            problems.append(f"{camera}: frames are not in the order of their times")
    # Cameras of the same rate take turns.
    if len(cameras) != sum(counts.values()) or changes < len(cameras) // 2 or min(counts.values()) < 60:
        problems.append(f"{counts}, and {changes} changes of the camera in {len(cameras)} frames")
    return problems, f"{counts}, {changes} changes of the camera, in order"


def sensors(run: Run, _: str) -> tuple[list[str], str]:
    """Two cameras, of which one goes away for a moment. Each has its own frames and faults."""
    of = {name: [record for record in run.records if record["sensor"] == name] for name in ("left", "right")}
    told = {name: [record["fault"] for record in records if record["kind"] == "fault"] for name, records in of.items()}
    problems = []
    if told != {"left": ["disconnected", "reconnected"], "right": []}:
        problems.append(f"told {told}")
    for name, records in of.items():
        end = records[-1]
        if end["kind"] != "end" or frames_of(records) + end["dropped"] != 120:
            problems.append(f"{name}: {frames_of(records)} frames, then {end}")
    return problems, ", ".join(f"{name} {frames_of(records)} frames" for name, records in of.items())


def main(directory: Path, wstac: str) -> None:
    """Judges all runs. A broken record must fail one check, and not the rest."""
    checks: list[Callable[[Run, str], tuple[list[str], str]]] = [recorded, killed, both, full, sensors]
    for check in checks:
        try:
            run = Run(directory, check.__name__)
            crash = [] if check is killed else run.crash()
            problems, note = (crash, "") if crash else check(run, wstac)
        except Exception as error:
            problems, note = [f"{type(error).__name__}: {error}"], ""
        verdict(f"record {check.__name__}", problems, note)


main(Path(sys.argv[1]), sys.argv[2])
