"""Checks the node of wstac_ros as other nodes of ROS 2 meet it: what is heard on its topics is what the package wstac finds.

    heard.py BOARD_BYTES NODE [CHECK...]    a program that plays a board, and wstac-node;
                                            in a network of its own, with the environment of a workspace that has wstac_msgs and wstac_ros
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import queue
import re
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
import types
import zlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any
from unittest import mock
from xml.etree import ElementTree

import numpy as np
import rclpy
import wstac
from ament_index_python.packages import get_package_prefix, get_package_share_directory
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TwistStamped
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from wstac_msgs.msg import ContactEnd, Event, Features, Slip, Taxels
from wstac_msgs.srv import LoadFile, StartRecording
from wstac_ros import messages
from wstac_ros.node import SensorsNode
from wstac_ros.sensor import Sensor

PATIENCE = 60
RELIABLE = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STREAM = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
TYPES = {
    "event": Event,
    "contact_end": ContactEnd,
    "slip": Slip,
    "motion": TwistStamped,
    "features": Features,
    "taxels": Taxels,
    "picture": Image,
}


def fail(message: str) -> None:
    sys.exit(f"heard.py: {message}")


def same(found: Any, expected: Any, what: str) -> None:
    if found != expected:
        fail(f"{what}: {found!r:.1000}, expected {expected!r:.1000}")


def until(is_so: Callable[[], Any], what: str) -> None:
    end = time.monotonic() + PATIENCE
    while not is_so():
        if time.monotonic() > end:
            fail(f"after {PATIENCE} s still not: {what}")
        time.sleep(0.02)


def seconds(stamp: Any) -> float:
    return stamp.sec + stamp.nanosec / 1e9


class Listener:
    """A node that keeps what it hears, by topic, with the time of arrival."""

    def __init__(self) -> None:
        self.node = rclpy.create_node(f"listener_{id(self):x}")
        self.heard: dict[str, list[tuple[float, Any]]] = {}
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.thread = threading.Thread(target=self._spin, daemon=True)
        self.thread.start()

    def _spin(self) -> None:
        with contextlib.suppress(rclpy.executors.ExternalShutdownException):
            self.executor.spin()

    def hear(self, sensor: str, *topics: str) -> None:
        for topic in topics:
            name, quality = f"/wstac/{sensor}/{topic}", RELIABLE if topic in ("event", "contact_end", "slip") else STREAM
            kept = self.heard.setdefault(f"{sensor}/{topic}", [])
            self.node.create_subscription(TYPES[topic], name, lambda message, kept=kept: kept.append((time.time(), message)), quality)

    def messages(self, name: str) -> list[Any]:
        return [message for _, message in list(self.heard.get(name, []))]

    def call(self, kind: type, name: str, **fields: Any) -> Any:
        client = self.node.create_client(kind, name)
        if not client.wait_for_service(PATIENCE):
            fail(f"no service {name}")
        done = threading.Event()
        future = client.call_async(kind.Request(**fields))
        future.add_done_callback(lambda _: done.set())
        if not done.wait(PATIENCE):
            fail(f"{name} does not answer")
        self.node.destroy_client(client)
        return future.result()


@contextlib.contextmanager
def node(sensors: dict[str, str], **parameters: Any) -> Iterator[subprocess.Popen]:
    """Starts the node, as ros2 run does. It is killed at the end if it still runs."""
    program = Path(get_package_prefix("wstac_ros")) / "lib/wstac_ros/node"
    listed = ", ".join(f"'{name}={source}'" for name, source in sensors.items())
    given = [f"sensors:=[{listed}]", *(f"{name.replace('__', '.')}:={value}" for name, value in parameters.items())]
    command = [sys.executable, program, "--ros-args", *(word for one in given for word in ("-p", one))]
    notes = tempfile.TemporaryFile("w+")
    with subprocess.Popen(command, stderr=notes, stdout=notes) as process:

        def said() -> str:
            notes.seek(0)
            return notes.read()

        process.said = said
        try:
            yield process
        finally:
            process.kill()


def scene(folder: Path, name: str, lead_in: int = 150, slides: int = 2) -> str:
    """Writes a scene with time before its first slide, in which nodes find each other."""
    one = '[[slide]]\nspecimen = "Saw3"\nspeed = {}\ndirection = {}\n'
    file = folder / f"{name}.toml"
    file.write_text(f"lead_in = {lead_in}\ngap = 70\nseed = 3\n" + "".join(one.format(130 + 20 * number, 90 * number) for number in range(1, slides + 1)))
    return f"scene:{file}"


def check_topics(folder: Path, listener: Listener) -> None:
    """Two sensors: events and ends of touches are all heard, and features, taxels and motion are those that wstac finds."""
    sources = {"left": scene(folder, "left"), "right": scene(folder, "right", slides=1)}
    for name in sources:
        listener.hear(name, "event", "contact_end", "motion", "features", "taxels")
    diagnostics: list[DiagnosticArray] = []
    listener.node.create_subscription(DiagnosticArray, "/diagnostics", diagnostics.append, 10)
    with node(sources, right__fps=75) as process:
        until(lambda: listener.messages("left/features"), "features are heard")
        for topic, reliability, durability in (("event", "RELIABLE", "TRANSIENT_LOCAL"), ("features", "BEST_EFFORT", "VOLATILE")):
            [found] = listener.node.get_publishers_info_by_topic(f"/wstac/left/{topic}")
            same((found.qos_profile.reliability.name, found.qos_profile.durability.name), (reliability, durability), f"quality of service of {topic}")
        until(lambda: listener.messages("left/event"), "the first event")
        late = Listener()
        late.hear("left", "event")
        until(lambda: late.messages("left/event"), "an event that is heard by who comes late")
        same(late.messages("left/event")[0].frame, listener.messages("left/event")[0].frame, "that event")
        same(process.wait(PATIENCE), 0, f"exit code of a node that says {process.said()!r}")
    count = 0
    for name, source in sources.items():
        truth = list(wstac.open(source, motion=True, at_once=True, fps=75 if name == "right" else None).frames())
        records = [record for frame in truth for record in frame.records]
        events = [record for record in records if isinstance(record, wstac.Event)]
        found = listener.messages(f"{name}/event")
        same([(one.frame, one.contact, one.reliable) for one in found], [(one.frame, one.contact, one.reliable) for one in events], f"events of {name}")
        for one, event in zip(found, events):
            same((one.speed, one.direction), (event.speed.mm_s * 1e-3, event.direction.deg * math.pi / 180), f"motion of an event of {name}")
            same((one.basis, one.contacts, one.why), (event.basis, event.contacts, event.why.get("reliable", "")), f"basis of an event of {name}")
            same((one.acceleration, math.isnan(one.width)), (event.acceleration.mm_s2 * 1e-3, event.width_mm is None), f"more of an event of {name}")
            same(one.header.frame_id, f"{name}_frame", "coordinate frame")
        ends = [(record.frame, record.event_frame) for record in records if isinstance(record, wstac.ContactEnd)]
        same([(one.frame, one.event_frame) for one in listener.messages(f"{name}/contact_end")], ends, f"ends of touches of {name}")
        known = [one for one in records if isinstance(one, wstac.Motion) and one.direction.deg is not None]
        turns = [(one.speed.mm_s, math.radians(one.direction.deg)) for one in known]
        motions = {(round(speed * math.cos(angle), 1), round(speed * math.sin(angle), 1)) for speed, angle in turns}
        heard = {(round(1000 * one.twist.linear.x, 1), round(1000 * one.twist.linear.y, 1)) for one in listener.messages(f"{name}/motion")}
        same((bool(heard), heard - motions), (True, set()), f"motions of {name}")
        by_frame = {one.number: one for frame in truth for one in frame.completed}
        features, taxels = listener.messages(f"{name}/features"), listener.messages(f"{name}/taxels")
        for one in features:
            same(np.array_equal(one.features, by_frame[one.frame].features / np.float32(2048)), True, f"features of frame {one.frame} of {name}")
        for one in taxels:
            same(np.array_equal(one.sums, by_frame[one.frame].taxel_sums.ravel()), True, f"taxels of frame {one.frame} of {name}")
        # Best effort: a busy machine may lose some. Those of before the discovery are not heard.
        same(min(len(features), len(taxels)) > len(by_frame) // 2, True, f"{len(features)} features of {len(by_frame)} frames of {name}")
        # The event's header has the time of its first lit frame, and not that of the frame that completed it.
        stamps = {one.frame: seconds(one.header.stamp) for one in features}
        for one, event in zip(found, events):
            if event.touch_frame in stamps:
                same(seconds(one.header.stamp), stamps[event.touch_frame], f"time of a touch of {name}")
        count += sum(len(listener.messages(f"{name}/{topic}")) for topic in TYPES)
    delays = sorted(arrived - seconds(message.header.stamp) for arrived, message in listener.heard["left/features"])
    levels = {status.level for array in diagnostics for status in array.status}
    same(DiagnosticStatus.OK in levels and levels <= {DiagnosticStatus.OK, DiagnosticStatus.ERROR, DiagnosticStatus.STALE}, True, f"levels of diagnostics {levels}")
    facts = {value.key: value.value for status in diagnostics[-1].status if status.hardware_id == "left" for value in status.values}
    same((facts["skipped"], facts["dropped"], facts["source"]), ("0", "0", sources["left"]), "diagnostics")
    print(
        f"topics: {count} messages of two sensors as wstac finds them; an event is heard by who comes late; "
        f"frame to subscriber: median {1000 * delays[len(delays) // 2]:.1f} ms, worst {1000 * delays[-1]:.1f} ms"
    )


def refused(answer: Any, part: str) -> None:
    same((answer.success, part in answer.message), (False, True), f"a refusal with {part!r}: {answer.message!r}")


def fields_of(message: Any) -> Any:
    """Returns the fields of a message and of those in it."""
    names = getattr(message, "get_fields_and_field_types", dict)()
    return {name: fields_of(getattr(message, name)) for name in names} if names else message


def check_cyclone(folder: Path, listener: Listener) -> None:
    """A program without ROS hears by another DDS, CycloneDDS, what nodes hear by Fast DDS."""
    source = scene(folder, "across", lead_in=300)
    listener.hear("across", "event")
    # The network has one interface, which is not marked for multicast.
    interface = "<NetworkInterface name='lo' multicast='true'/>"
    uri = f"<CycloneDDS><Domain><General><Interfaces>{interface}</Interfaces></General></Domain></CycloneDDS>"
    program = [sys.executable, Path(__file__).with_name("cyclone.py"), "rt/wstac/across/event"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(program, env={**os.environ, "CYCLONEDDS_URI": uri}, **pipes) as other:
        with node({"across": source}) as process:
            same(process.wait(PATIENCE), 0, f"exit code of a node that says {process.said()!r}")
        said, _ = other.communicate()
    # As text: a number that is not known is NaN, which equals nothing.
    found = said.splitlines()
    expected = [json.dumps(fields_of(one)) for one in listener.messages("across/event")]
    same((len(found), found), (2, expected), "events by CycloneDDS")
    print(f"CycloneDDS, without ROS: the {len(found)} events that nodes on Fast DDS hear")


def check_slip(_: Path, listener: Listener) -> None:
    """The slip of a held part is heard."""
    held = f"scene:{Path(__file__).parents[1]}/firmware/held.toml"
    stream = wstac.open(held, at_once=True)
    list(stream)
    listener.hear("held", "slip")
    with node({"held": held}) as process:
        same(process.wait(PATIENCE), 0, f"exit code of a node that says {process.said()!r}")
    fields = ("frame", "onset_frame", "held_since_frame", "strength")
    found = [tuple(getattr(one, name) for name in fields) for one in listener.messages("held/slip")]
    same((len(found), found), (1, [tuple(getattr(one, name) for name in fields) for one in stream.slips]), "slips")
    print("a held part: its slip is heard")


def check_waiting(folder: Path, listener: Listener) -> None:
    """What is skipped is counted, and holds no place of pictures; a recording says what a person should know."""
    stream = wstac.open(scene(folder, "full"), size=(400, 400))
    sensor, frames = Sensor(listener.node, "full", "full", stream, lambda: None), stream.frames(pictures=True)
    sensor._waiting = queue.Queue(1)
    for _ in range(8):
        sensor._take(next(frames))
    # Each frame has a picture, features and taxels, and one of them waits.
    same(sensor._counts["skipped"], 8 * 3 - 1, "skipped messages")
    same(sensor._waiting.get()[0], "picture", "what waits")
    sensor._pictures.release()
    sensor._take(next(frames))
    same(sensor._waiting.get()[0], "picture", "what waits next")
    sensor._pictures.release()
    sensor._counts.clear()
    sensor._waiting = queue.Queue()
    for _ in range(6):
        sensor._take(next(frames))
    same((sensor._counts["skipped"], sensor._waiting.qsize()), (2, 4 + 6 * 2), "pictures that are skipped, and what waits")
    padded = types.SimpleNamespace(size=(4, 2), ros_encoding="mono8", bytes_per_row=6)
    picture = messages.picture(np.arange(18, dtype=np.uint8), padded, Header())
    same((picture.width, picture.step, bytes(picture.data)), (4, 6, bytes(range(12))), "a picture of padded planes")
    nowhere = wstac.Motion(3, None, wstac.Speed(mm_s=9.0), wstac.Direction(deg=None))
    sensor._waiting = queue.Queue()
    sensor._take_records([nowhere], sensor._now())
    same(sensor._waiting.qsize(), 0, "motion without a direction")
    file = folder / "touched.toml"
    file.write_text('fidelity = "taxel"\nlead_in = 100\n[[touch]]\nkind = "hold"\nhold = 6\n')
    sensor.stream = wstac.open(f"scene:{file}")
    frames = sensor.stream.frames()
    for _ in range(150):
        next(frames)
    sensor.stream.start_recording(folder / "touched.mcap", features_only=True)
    for _ in range(40):
        next(frames)
    same(sensor.stop_recording().startswith("40 frames recorded; it begins in a touch"), True, "what a recording says")
    print("full queues: what is skipped is counted, and pictures go on")


def check_failures(folder: Path, listener: Listener) -> None:
    """A recording that cannot be written is told, and the node's exit code is 1."""
    source = scene(folder, "filled", lead_in=200, slides=1)
    with node({"filled": source}, files=folder, filled__size="[400, 400]") as process:
        same(listener.call(StartRecording, "/wstac/filled/start_recording").success, True, "a recording")
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (1 << 20, 1 << 20))
        same((process.wait(PATIENCE), "filled-1.mcap" in process.said()), (1, True), f"exit code of a node that says {process.said()!r}")
    print("a recording that cannot be written: told, with exit code 1")


def check_services(folder: Path, listener: Listener) -> None:
    """Services follow orders or say why not; a recording replays, and parameters are listed, read and changed."""
    (folder / "wrong.toml").write_text("[trigger]\nwindow = 71\n")
    (folder / "right.toml").write_text("[trigger]\nwindow = 7\n")
    (folder / "secret.toml").write_text("[trigger]\nhunter2\n")
    os.mkfifo(folder / "pipe.toml")
    (folder / "folder.toml").mkdir()
    (folder / "link.toml").symlink_to(folder / "right.toml")
    source = scene(folder, "hand", lead_in=3000)
    listener.hear("hand", "features", "picture")
    with node({"hand": source}, files=folder, hand__frame_id="finger", hand__size="[400, 400]") as process:
        until(lambda: listener.messages("hand/features"), "features are heard")
        same(listener.messages("hand/features")[0].header.frame_id, "finger", "coordinate frame of a parameter")

        def call(kind: type, last: str, **fields: Any) -> Any:
            return listener.call(kind, f"/wstac/hand/{last}", **fields)

        same(call(Trigger, "restart_baseline").success, True, "a new baseline")
        refused(call(Trigger, "stop_recording"), "no recording in progress")
        refused(call(LoadFile, "load_configuration", file="wrong.toml"), "window is 71")
        refused(call(LoadFile, "load_configuration", file="none.toml"), "none.toml")
        for name in ("../right.toml", "/etc/passwd", ".hidden", ""):
            refused(call(LoadFile, "load_configuration", file=name), "without folders")
        refused(call(LoadFile, "load_configuration", file="link.toml"), "link")
        refused(call(LoadFile, "load_configuration", file="pipe.toml"), "expected a file")
        there = len(os.listdir(f"/proc/{process.pid}/fd"))
        for _ in range(20):
            refused(call(LoadFile, "load_configuration", file="folder.toml"), "expected a file")
        same(len(os.listdir(f"/proc/{process.pid}/fd")) < there + 10, True, "descriptors after folders")
        answer = call(LoadFile, "load_configuration", file="secret.toml")
        refused(answer, "secret.toml: TOML line 2")
        same(("hunter2" in answer.message, "hunter2" in process.said()), (False, True), "who reads what is in a file")
        same(call(LoadFile, "load_configuration", file="right.toml").success, True, "a configuration")
        same(call(LoadFile, "load_model", file="builtin").success, True, "a model")
        refused(call(LoadFile, "load_model", file="right.toml"), "right.toml")
        refused(call(StartRecording, "start_recording", file="a.txt"), ".mcap")
        refused(call(StartRecording, "start_recording", labels=["specimen"]), "NAME=VALUE")
        started = call(StartRecording, "start_recording", labels=["specimen=Saw3"])
        same((started.success, started.recorded), (True, str(folder / "hand-1.mcap")), "a recording")
        refused(call(Trigger, "restart_baseline"), "recording in progress")
        time.sleep(2)
        stopped = call(Trigger, "stop_recording")
        same(stopped.success, True, f"the end of a recording: {stopped.message}")
        recording = wstac.read(folder / "hand-1.mcap")
        same((recording.labels, f"{len(recording.frames)} frames recorded"), ({"specimen": "Saw3"}, stopped.message), "the recording")
        second = call(StartRecording, "start_recording", file="", features_only=True)
        same(second.recorded, str(folder / "hand-2.mcap"), "the second recording")

        names = set(listener.call(ListParameters, "/wstac/node/list_parameters").result.names)
        same({"sensors", "files", "hand.frame_id", "hand.picture", "hand.models", "hand.fps"} <= names, True, f"parameters {sorted(names)}")
        [value] = listener.call(GetParameters, "/wstac/node/get_parameters", names=["sensors"]).values
        same(list(value.string_array_value), [f"hand={source}"], "the parameter sensors")

        def change(name: str, value: Any) -> Any:
            parameters = [Parameter(name, value=value).to_parameter_msg()]
            [result] = listener.call(SetParameters, "/wstac/node/set_parameters", parameters=parameters).results
            return result

        same([change(*one).successful for one in (("files", "/"), ("hand.picture", 3), ("hand.frame_id", ""))], [False] * 3, "changes that are refused")
        same(listener.messages("hand/picture"), [], "pictures that are off")
        same([change(*one).successful for one in (("hand.frame_id", "thumb"), ("hand.picture", True))], [True] * 2, "changes")
        until(lambda: listener.messages("hand/picture"), "pictures")
        picture = listener.messages("hand/picture")[0]
        found = (picture.header.frame_id, picture.encoding, picture.width, picture.height, picture.step, len(picture.data))
        same(found, ("thumb", "mono8", 400, 400, 400, 160_000), "a picture")
        process.send_signal(signal.SIGINT)
        same(process.wait(PATIENCE), 0, f"exit code after SIGINT of a node that says {process.said()!r}")
    # A signal ends a recording as a whole.
    same(len(wstac.read(folder / "hand-2.mcap").features) > 0, True, "frames of the recording that a signal has ended")
    print(f"services: a recording of {len(recording.frames)} frames, a model, a configuration and baselines; {len(names)} parameters listed")


SLOW = """
import os, signal, sys, rclpy
from wstac_msgs.msg import Event, Features
from rclpy.qos import QoSProfile
rclpy.init()
node = rclpy.create_node("slow")
stop = lambda message: os.kill(os.getpid(), signal.SIGSTOP)
node.create_subscription(Event, "/wstac/left/event", stop, QoSProfile(depth=1))
print("ready", flush=True)
node.create_subscription(Features, "/wstac/left/features", stop, rclpy.qos.qos_profile_sensor_data)
rclpy.spin(node)
"""


def check_swapped(folder: Path, _listener: Listener) -> None:
    """What a service has looked at is what it reads, though the file becomes a link to another one at that moment."""
    secret, plain, link = folder / "outside", folder / "plain.toml", folder / "link.new"
    secret.write_text("hunter2")
    plain.write_text("[trigger]\nwindow = 7\n")
    given = {"sensors": [f"swapped={scene(folder, 'swapped', lead_in=3000)}"], "files": str(folder)}
    swapped = SensorsNode(parameter_overrides=[Parameter(name, value=value) for name, value in given.items()])
    sensor, request, answer = swapped.sensors["swapped"], LoadFile.Request(file="plain.toml"), LoadFile.Response()
    looks = []

    def swapping(look: Callable[..., Any]) -> Callable[..., Any]:
        def swap(*arguments: Any, **options: Any) -> Any:
            looks.append(look(*arguments, **options))
            link.symlink_to(secret)
            link.rename(plain)
            return looks[-1]

        return swap

    with mock.patch.multiple(os, stat=swapping(os.stat), fstat=swapping(os.fstat)):
        swapped._load_configuration(sensor, request, answer)
    same((len(looks), plain.is_symlink(), "window = 7" in sensor.stream.config.toml), (1, True, True), "what is read")
    try:
        fail(f"a link is read: {swapped._load_configuration(sensor, request, answer)}")
    except wstac.Error as error:
        same("a link" in str(error), True, f"refusal of a link: {error}")
    sensor.close()
    swapped.destroy_node()
    print("a file that becomes a link after a look at it: what was looked at is read, and then the link is refused")


def check_slow(folder: Path, listener: Listener) -> None:
    """A subscriber that stops reading holds nobody up: the sensor goes on in time, and others hear all events."""
    source = scene(folder, "slow")
    frames = list(wstac.open(source, at_once=True).frames())
    listener.heard.clear()
    other = Listener()
    other.hear("left", "event", "features")
    with subprocess.Popen([sys.executable, "-c", SLOW], stdout=subprocess.PIPE) as slow:
        try:
            slow.stdout.readline()
            with node({"left": source}, left__picture="true") as process:
                # How long a busy machine takes to start it says nothing.
                until(lambda: other.messages("left/features"), "features are heard")
                begun = time.monotonic()
                same(process.wait(PATIENCE), 0, f"exit code of a node that says {process.said()!r}")
            took = time.monotonic() - begun
            state = Path(f"/proc/{slow.pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
        finally:
            slow.kill()
    same(state, "T", "the state of the subscriber that stops reading")
    same(took < len(frames) / 30 + 15, True, f"{len(frames)} frames in {took:.1f} s")
    events = [frame.event.frame for frame in frames if frame.event]
    same([one.frame for one in other.messages("left/event")], events, "events beside a subscriber that stops reading")
    print(f"a subscriber that stops reading: {len(frames)} frames in {took:.1f} s, and others hear all {len(events)} events")


class Stamped:
    """A stream whose frames and records have wall-clock times, as those of a camera have."""

    BEGUN = datetime(2026, 11, 22, 10, 0, 1, 500_999, tzinfo=timezone.utc)

    def __init__(self, stream: wstac.Stream) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    @classmethod
    def stamp(cls, number: int) -> datetime:
        return cls.BEGUN + timedelta(milliseconds=33) * number

    def frames(self, pictures: bool = False) -> Iterator[wstac.Frame]:
        for frame in self._stream.frames(pictures):
            records = [
                replace(record, stamp=self.stamp(record.touch_frame if isinstance(record, wstac.Event) else record.frame))
                for record in frame.records
                if hasattr(record, "stamp")
            ]
            yield replace(frame, stamp=self.stamp(frame.number), records=records)


def check_stamps(folder: Path, listener: Listener) -> None:
    """Headers have the time at which the light came, if the source knows it, and not that of sending."""
    source, whole = scene(folder, "stamped", slides=1), wstac.open
    listener.hear("stamped", "event", "contact_end", "motion", "features", "taxels")
    wstac.open = lambda *arguments, **options: Stamped(whole(*arguments, **options))
    sensors = Parameter("sensors", value=[f"stamped={source}"])
    stamped = SensorsNode(parameter_overrides=[sensors])
    listener.executor.add_node(stamped)
    until(stamped.is_over.is_set, "the end of the source")
    until(lambda: listener.messages("stamped/contact_end"), "the end of the touch")
    wstac.open = whole
    features = [*listener.messages("stamped/features"), *listener.messages("stamped/taxels")]
    same(len(features) > 100, True, "features and taxels")
    [event] = whole(source, at_once=True)
    [found], [end] = listener.messages("stamped/event"), listener.messages("stamped/contact_end")
    times = [(one.header.stamp, one.frame) for one in (*features, end)] + [(found.header.stamp, event.touch_frame)]
    for stamp, frame in times:
        since = Stamped.stamp(frame) - datetime(1970, 1, 1, tzinfo=timezone.utc)
        found_us = stamp.sec * 1_000_000 + stamp.nanosec // 1000
        same(found_us, since // timedelta(microseconds=1), f"time of frame {frame}")
    stamps = {seconds(one.header.stamp) for one in features}
    same({seconds(one.header.stamp) for one in listener.messages("stamped/motion")} <= stamps, True, "times of motion")
    print(f"time stamps: {len(times)} messages have the times of the light, to a microsecond")


def check_board(folder: Path, listener: Listener) -> None:
    """The events of a board are those of the same scene here."""
    source = scene(folder, "board", lead_in=30)
    sent = subprocess.run([sys.argv[1], source], capture_output=True, check=True, timeout=PATIENCE).stdout
    listener.hear("board", "event", "features")
    with socket.create_server(("127.0.0.1", 0)) as server:
        with node({"board": f"tcp:127.0.0.1:{server.getsockname()[1]}"}, files=folder) as process:
            board, _ = server.accept()
            until(lambda: listener.node.count_publishers("/wstac/board/event"), "the node is found")
            step = len(sent) // 100
            board.sendall(sent[:step])
            until(lambda: listener.node.count_publishers("/wstac/board/event"), "the node is found")
            refused(listener.call(Trigger, "/wstac/board/restart_baseline"), "is a board")
            # The node ends with the board's last message.
            with contextlib.suppress(ConnectionError):
                for start in range(step, len(sent), step):
                    board.sendall(sent[start : start + step])
                    time.sleep(0.03)
            same(process.wait(PATIENCE), 0, f"exit code of a node that says {process.said()!r}")
            board.close()
    until(lambda: len(listener.messages("board/event")) == 2, "two events")
    frames = [event.frame for event in wstac.open(source, at_once=True)]
    same([one.frame for one in listener.messages("board/event")], frames, "events of a board")
    check_end_of_board(sent)
    print(f"a board: {len(frames)} events, {len(listener.messages('board/features'))} features; its services refuse")


def check_end_of_board(sent: bytes) -> None:
    """What a board has sent before its line fails is read before the error."""
    other = bytes([99, 0, 0])
    other += zlib.crc32(other).to_bytes(4, "little")
    stuffed = b"".join(bytes([len(part) + 1]) + part for part in other.split(b"\0"))
    begin = sent[: sent.rindex(b"\0", 0, 2000) + 1]
    found = []
    for end in (b"", b"\0" + stuffed + b"\0"):
        with socket.create_server(("127.0.0.1", 0)) as server:
            stream = wstac.open(f"tcp:127.0.0.1:{server.getsockname()[1]}")
            with server.accept()[0] as board:
                board.sendall(begin + end)
        failure, numbers = "", []
        try:
            numbers.extend(frame.number for frame in stream.frames())
        except wstac.Error as error:
            failure = str(error)
        found.append((numbers, "version" in failure))
    [(whole, _), (before, is_other)] = found
    same((len(whole) > 3, before, is_other), (True, whole, True), "features before the end of a line")


class Stand:
    """Stands in for a class of launch, which PyPI does not have, and keeps what it was made of."""

    def __init__(self, *positional: Any, **named: Any) -> None:
        self.positional, self.named = positional, named


def launched(file: Path, given: dict[str, str]) -> list[Any]:
    """Runs the launch file. Returns what it starts."""

    class Given(Stand):
        def perform(self, _: Any) -> str:
            return given.get(self.positional[0], defaults[self.positional[0]])

    stands = {
        "launch": {"LaunchDescription": Stand},
        "launch.substitutions": {"LaunchConfiguration": Given},
        "launch.actions": {name: type(name, (Stand,), {}) for name in ("DeclareLaunchArgument", "OpaqueFunction")},
        "launch_ros": {},
        "launch_ros.actions": {"Node": type("Node", (Stand,), {})},
    }
    for name, content in stands.items():
        sys.modules[name] = types.ModuleType(name)
        vars(sys.modules[name]).update(content)
    scope: dict[str, Any] = {}
    exec(compile(file.read_text(), str(file), "exec"), scope)  # noqa: S102
    *declared, function = scope["generate_launch_description"]().positional[0]
    defaults = {one.positional[0]: one.named["default_value"] for one in declared}
    same(given.keys() <= defaults.keys(), True, f"arguments {sorted(defaults)} of the launch file")
    return function.named["function"](None)


def check_launch(folder: Path, listener: Listener) -> None:
    """The installed launch file starts the node with parameters that it takes, and the frames of the sensor are a tree."""
    file = Path(get_package_share_directory("wstac_ros")) / "launch" / "wstac.launch.py"
    started, publisher = launched(file, {"name": "thumb", "source": scene(folder, "thumb", slides=1), "files": str(folder)})
    same((started.named["package"], started.named["executable"], started.named["namespace"]), ("wstac_ros", "node", "wstac"), "what is started")
    [parameters] = started.named["parameters"]
    listener.hear("thumb", "event")
    sensors = dict(one.split("=", 1) for one in parameters.pop("sensors"))
    with node(sensors, **parameters) as process:
        same(process.wait(PATIENCE), 0, f"exit code of a node that says {process.said()!r}")
    until(lambda: listener.messages("thumb/event"), "the event of what the launch file starts")
    robot = ElementTree.fromstring(publisher.named["parameters"][0]["robot_description"])
    same([link.get("name") for link in robot.findall("link")], ["thumb_base", "thumb_frame"], "links of the sensor")
    [joint] = robot.findall("joint")
    ends = (joint.find("parent").get("link"), joint.find("child").get("link"), joint.get("type"))
    same(ends, ("thumb_base", "thumb_frame", "fixed"), "the joint of the sensor")
    same(listener.messages("thumb/event")[0].header.frame_id, "thumb_frame", "coordinate frame")
    package = Path(__file__).parents[2] / "wstac-ros/wstac_ros"
    text = "\n".join(one.read_text() for one in package.glob("[wl]*/*.py"))
    # pip installs wstac.
    imported = set(re.findall(r"^(?:from|import) (\w+)", text, re.MULTILINE)) - sys.stdlib_module_names - {"wstac"}
    declared = {one.text.removeprefix("python3-") for one in ElementTree.parse(package / "package.xml").findall("exec_depend")}
    same(imported - declared, set(), "packages that package.xml leaves out")
    print("launch: the installed file starts a node that is heard, and its frames are a tree")


def check_relay(folder: Path, listener: Listener) -> None:
    """The program of the page hands messages of wstac-node on."""
    page = (Path(__file__).parents[2] / "docs/ROS.md").read_text()
    code = next(block for block in re.findall(r"(?:^    .*\n|^\n)+", page, re.MULTILINE) if "import importlib" in block)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    source = scene(folder, "relayed", lead_in=450, slides=3)
    listener.hear("relayed", "features", "taxels")
    listener.node.create_subscription(Event, "/wstac/relayed/event", listener.heard.setdefault("relayed/event", []).append, 10)
    command = [sys.argv[2], f"relayed={source}", "--zenoh-encoding", "cdr", "--listen", endpoint]
    with subprocess.Popen(command, stderr=subprocess.PIPE) as zenoh_node:
        zenoh_node.stderr.readline(), zenoh_node.stderr.readline()
        time.sleep(1)
        program = textwrap.dedent(code).replace("tcp/127.0.0.1:7447", endpoint)
        with subprocess.Popen([sys.executable, "-c", program]) as relay:
            same(zenoh_node.wait(PATIENCE), 0, "exit code of wstac-node")
            relay.kill()
    frames = [event.frame for event in wstac.open(source, at_once=True)]
    heard = [message.frame for message in listener.heard["relayed/event"]]
    # Nodes find a publisher only after its first message.
    same((len(heard) >= 1, heard), (True, frames[-len(heard) :]), "events through the relay")
    print(f"the relay of the page: {len(heard)} of {len(frames)} events of wstac-node, and {len(listener.messages('relayed/features'))} features")


def check_refusals(folder: Path, _listener: Listener) -> None:
    """Parameters that cannot be used end the node with a line and exit code 2."""
    for sensors, parameters, part in (
        ({"left-1": "scene:Saw3@150"}, {}, "expected NAME=SOURCE"),
        ({"left": "scene:Saw3@0"}, {}, "speed is"),
        ({"left": str(folder / "none.mcap")}, {}, "no such file"),
        ({"left": "scene:Saw3@150"}, {"files": folder / "none"}, "expected an existing folder"),
        ({"left": "tcp:127.0.0.1:1"}, {"left__fps": "60"}, "leave fps out"),
        ({"left": "scene:Saw3@150"}, {"left__models": "builtin"}, "left.models"),
    ):
        with node(sensors, **parameters) as process:
            code = process.wait(PATIENCE)
            if code != 2 or part not in process.said() or "Traceback" in process.said():
                fail(f"{sensors}: exit code {code}, {process.said()!r}, expected 2 and {part!r}")
    print("parameters that cannot be used: 6 refused in a line")


def main() -> None:
    rclpy.init()
    listener = Listener()
    heard = (check_topics, check_cyclone, check_slip, check_waiting, check_failures, check_services, check_swapped)
    checks = (*heard, check_slow, check_stamps, check_board, check_launch, check_relay, check_refusals)
    named = sys.argv[3:]
    with tempfile.TemporaryDirectory() as folder:
        for check in checks:
            if not named or check.__name__.removeprefix("check_") in named:
                check(Path(folder).resolve(), listener)
    # Threads of the middleware would hold the end up.
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
