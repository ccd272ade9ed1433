#!/usr/bin/env python3
"""Measures one wstac-node with many sensors, by Zenoh's own client for Python: what is lost, how long a frame takes to a
subscriber, and whether memory grows.

    many.py WSTAC NODE [--minutes M] [--sensors N] [--most-ms MS] [--write]

Sensors are recordings of taxel sums that are played at 30 frames per second. --write puts the table into docs/NETWORK.md.
It fails if something is lost, if memory grows, or if 99 % of the frames take longer than --most-ms to the subscriber: 10 ms
by default, for which the node needs priority over what else the machine does (nice -n -15).
"""

import argparse
import json
import os
import struct
import subprocess
import tempfile
import threading
import time
from pathlib import Path

from common import PATIENCE, Programs, fail, free_port, run_main, same, session

PAGE = Path(__file__).parents[2] / "docs" / "NETWORK.md"
# Slides of 105 mm at 130 to 170 mm/s, with pauses: about one event in four seconds.
SLIDES = (("Saw3", 150, 90), ("Sin2", 170, 180), ("Tri4", 130, 300))
# Recordings that sensors share: a sensor is like every fourth one.
RECORDINGS = 4
# A histogram of latencies in steps of 0.1 ms, to a second.
STEP_NS, STEPS = 100_000, 10_000
TICKS = os.sysconf("SC_CLK_TCK")


def recording(programs, number, minutes):
    """Records slides for so many minutes. Returns the file, its number of frames, and the events that are found: the
    frame that completes each, by the frame of the event.
    """
    scene, file = programs.folder / f"many-{number}.toml", programs.folder / f"many-{number}.mcap"
    # One slide with its pause takes 3.7 seconds.
    count = max(1, round(minutes * 60 / 3.7))
    slides = (SLIDES[k % len(SLIDES)] for k in range(count))
    parts = (f'[[slide]]\nspecimen = "{name}"\nspeed = {speed}\ndirection = {way}\n' for name, speed, way in slides)
    scene.write_text(f'fidelity = "taxel"\nlead_in = 40\ngap = 85\nseed = {number}\n' + "".join(parts))
    command = [programs.wstac, "record", f"scene:{scene}", "-o", file, "--features-only", "--json"]
    done = subprocess.run(command, capture_output=True, check=True, text=True)
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    frames = next(line["frames"] for line in lines if line["kind"] == "end")
    events = (line for line in lines if line["kind"] == "event")
    return file, frames, {event["frame"]: round(event["completed_ns"] * 30 / 1e9) for event in events}


class Heard:
    """What has arrived under one key."""

    def __init__(self):
        self.first = self.last = self.count = self.late = self.frame = 0

    def take(self, sequence, frame):
        if self.count == 0:
            self.first = sequence
        self.late += sequence <= self.last
        self.last = max(self.last, sequence)
        self.count += 1
        self.frame = frame

    @property
    def lost(self):
        return self.last - self.first + 1 - self.count


class Meter:
    """Hears features and events, and keeps counts alone, so that it needs no more memory in an hour."""

    def __init__(self, endpoint, completing):
        """`completing` has the frame that completes each event of a sensor."""
        self.completing = completing
        self.heard, self.lock = {}, threading.Lock()
        # The time of each of the last frames of a sensor, and events that came before their frame.
        self.stamps, self.early = {}, {}
        self.steps = {"features": [0] * (STEPS + 1), "event": [0] * (STEPS + 1)}
        self.worst = dict.fromkeys(self.steps, 0)
        self.session = session("peer", listen=endpoint)
        self.subscribers = [self.session.declare_subscriber(f"wstac/*/{kind}", self.take) for kind in self.steps]

    def take(self, sample):
        now = time.time_ns()
        sensor, kind = str(sample.key_expr).split("/")[1:]
        payload = sample.payload.to_bytes()
        seconds, nanoseconds, length = struct.unpack_from("<iII", payload, 4)
        at = 4 + (12 + length + 7) // 8 * 8
        frame = int.from_bytes(payload[at : at + 8], "little")
        # Events have numbers from 0, and features those of their frames.
        number = 1 + (int(sample.attachment.to_string()) if kind == "event" else frame)
        # Each subscriber has a thread of its own.
        with self.lock:
            self.heard.setdefault((sensor, kind), Heard()).take(number, frame)
            stamps = self.stamps.setdefault(sensor, {})
            if kind == "features":
                stamp = seconds * 1_000_000_000 + nanoseconds
                stamps[frame] = stamp
                stamps.pop(frame - 100, None)
                self.count(kind, now - stamp)
                if (sensor, frame) in self.early:
                    self.count("event", self.early.pop((sensor, frame)) - stamp)
            else:
                # The features of the frame that completed it may come to their thread later than this.
                last = self.completing[sensor][frame]
                if last in stamps:
                    self.count(kind, now - stamps[last])
                else:
                    self.early[sensor, last] = now

    def count(self, kind, latency):
        self.steps[kind][min(max(latency, 0) // STEP_NS, STEPS)] += 1
        self.worst[kind] = max(self.worst[kind], latency)

    def quantile(self, kind, share):
        """Returns the latency in ms that this share of all messages does not exceed."""
        left = share * sum(self.steps[kind])
        for step, count in enumerate(self.steps[kind]):
            left -= count
            if left <= 0:
                return (step + 1) * STEP_NS / 1e6
        return self.worst[kind] / 1e6


class Machine:
    """Memory and processor time of the node, once a second, and the time that the whole machine was busy."""

    def __init__(self, process):
        self.process, self.memory, self.files = process, [], 0
        self.begun = (time.monotonic(), *self.times())
        self.ended = self.begun
        self.over = threading.Event()
        self.thread = threading.Thread(target=self.watch)
        self.thread.start()

    def times(self):
        own = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        mine = os.times()
        busy = Path("/proc/stat").read_text().split("\n", 1)[0].split()
        # All but idle and waiting for disks.
        whole = sum(map(int, busy[1:4])) + sum(map(int, busy[6:9]))
        return (int(own[11]) + int(own[12])) / TICKS, mine.user + mine.system, whole / TICKS

    def watch(self):
        while not self.over.wait(1):
            try:
                status = Path(f"/proc/{self.process.pid}/status").read_text()
                rss = next(line for line in status.splitlines() if line.startswith("VmRSS"))
                self.memory.append(int(rss.split()[1]) / 1024)
                self.ended = (time.monotonic(), *self.times())
            except (OSError, StopIteration):
                return

    def finish(self):
        """Returns the processor time of the node, of this program and of all others, in processors."""
        self.over.set()
        self.thread.join()
        wall, node, own, whole = (end - begin for begin, end in zip(self.begun, self.ended, strict=True))
        wall = max(wall, 1)
        return node / wall, own / wall, max(0.0, whole - node - own) / wall


def measure(programs, minutes, sensors):
    recordings = [recording(programs, number, minutes) for number in range(min(RECORDINGS, sensors))]
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    names = [f"s{number:03}" for number in range(sensors)]
    meter = Meter(endpoint, {name: recordings[number % RECORDINGS][2] for number, name in enumerate(names)})
    sources = [f"{name}={recordings[number % RECORDINGS][0]}" for number, name in enumerate(names)]
    begun = time.monotonic()
    with programs.node(*sources, "--zenoh-encoding", "cdr", "--connect", endpoint) as node:
        machine = Machine(node)
        same(node.wait(minutes * 90 + PATIENCE), 0, f"exit code of the node, which says {node.said()[-2000:]!r}")
    took = time.monotonic() - begun
    time.sleep(1)
    used = machine.finish()
    expected = [recordings[number % RECORDINGS][1:] for number in range(sensors)]
    lost = {kind: 0 for kind in meter.steps}
    for name, (frames, completing) in zip(names, expected, strict=True):
        features, events = (meter.heard.get((name, kind), Heard()) for kind in meter.steps)
        # Messages from before the connection are not heard, and those at the end would be missing.
        lost["features"] += features.lost + (frames - 1 - features.frame)
        lost["event"] += len(completing) - events.count
        if features.late or events.late or meter.early:
            fail(f"{name}: messages out of their order, or events without a frame")
    heard = {kind: sum(meter.steps[kind]) for kind in meter.steps}
    before = sum(frames for frames, _ in expected) - heard["features"] - lost["features"]
    memory = machine.memory
    early = memory[min(30, len(memory) // 3)]
    kept = [early, *(memory[quarter * (len(memory) - 1) // 4] for quarter in (1, 2, 3, 4))]
    rows = [
        ("sensors, time", f"{sensors}, {took / 60:.1f} minutes"),
        ("build, priority over other programs (nice)", f"{programs.command.parent.name}, {os.nice(0)}"),
        ("features that were heard, and lost", f"{heard['features']}, {lost['features']}"),
        ("events that were heard, and lost", f"{heard['event']}, {lost['event']}"),
        ("frames from before the connection", f"{before}"),
        ("frame to subscriber, features: median, 99 %, 99.9 %, worst", latencies(meter, "features")),
        ("frame to subscriber, events: median, 99 %, 99.9 %, worst", latencies(meter, "event")),
        ("memory of the node: after half a minute, and at each quarter of the time", ", ".join(f"{one:.1f}" for one in kept) + " MiB"),
        ("processors that the node took, and the subscriber", f"{used[0]:.2f}, {used[1]:.2f}"),
        ("processors that other programs took meanwhile", f"{used[2]:.2f} of {os.cpu_count()}"),
    ]
    meter.session.close()
    return rows, lost, (early, memory[-1]), {kind: meter.quantile(kind, 0.99) for kind in meter.steps}


def latencies(meter, kind):
    parts = [meter.quantile(kind, share) for share in (0.5, 0.99, 0.999)]
    return ", ".join(f"{part:.1f}" for part in (*parts, meter.worst[kind] / 1e6)) + " ms"


def write(rows):
    """Puts the table between its two marks into the page."""
    text = PAGE.read_text()
    before, mark, rest = text.partition("<!-- sensors: ci/node sensors --write -->\n")
    _, end, after = rest.partition("<!-- sensors end -->")
    if not mark or not end:
        fail(f"{PAGE}: has no marks for the table")
    lines = ["| measured | found |", "| --- | --- |", *(f"| {what} | {found} |" for what, found in rows)]
    PAGE.write_text(before + mark + "\n".join(lines) + "\n" + end + after)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wstac", type=Path)
    parser.add_argument("node", type=Path)
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--sensors", type=int, default=100)
    parser.add_argument("--most-ms", type=float, default=10)
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        programs = Programs(arguments.wstac.resolve(), arguments.node.resolve(), Path(folder))
        rows, lost, (early, last), slowest = measure(programs, arguments.minutes, arguments.sensors)
    for what, found in rows:
        print(f"{what}: {found}")
    if arguments.write:
        write(rows)
    if any(lost.values()):
        fail(f"lost: {lost}")
    late = {kind: latency for kind, latency in slowest.items() if latency > arguments.most_ms}
    if late:
        took = ", ".join(f"{latency:.1f} ms of {kind}" for kind, latency in late.items())
        fail(f"99 % took {took}, expected at most {arguments.most_ms:g} ms (priority over other programs: nice {os.nice(0)})")
    # Buffers may still grow a little in the first minutes.
    if last > 1.2 * early + 2:
        fail(f"memory grew from {early:.1f} to {last:.1f} MiB")


if __name__ == "__main__":
    run_main(main)
