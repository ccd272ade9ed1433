"""One sensor: a thread that reads it, and a thread that publishes what was found."""

from __future__ import annotations

import queue
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import wstac
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import TwistStamped
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from wstac_msgs.msg import ContactEnd, Event, Features, Slip, Taxels

from . import messages

MOST_WAITING = 4096
"""Messages that wait for the middleware at most: more than half a minute of a camera's."""
MOST_TIMES = 1000
"""Frames whose times are remembered: the touch of an event was so long ago at most."""
MOST_PICTURES = 4
"""Pictures that wait at most: they are large."""
EVENTS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Whoever comes late hears the last hundred events."""
TOPICS: dict[str, tuple[type, QoSProfile]] = {
    "event": (Event, EVENTS),
    "contact_end": (ContactEnd, EVENTS),
    "slip": (Slip, EVENTS),
    "motion": (TwistStamped, qos_profile_sensor_data),
    "features": (Features, qos_profile_sensor_data),
    "taxels": (Taxels, qos_profile_sensor_data),
    "picture": (Image, qos_profile_sensor_data),
}


class Sensor:
    """A sensor that is being read. `frame_id` and `with_pictures` may change meanwhile."""

    def __init__(self, node: Node, name: str, source: str, stream: wstac.Stream, ended: Callable[[], None]) -> None:
        self.name, self.stream, self.frame_id, self.with_pictures = name, stream, f"{name}_frame", False
        self.has_ended, self.failure = False, ""
        self._node, self._source, self._ended = node, source, ended
        self._counts, self._lost = Counter[str](), Counter[str]()
        self._before: tuple[int, int] = (0, 0)
        self.recorded = ""
        self._last, self._has_taxels = Time(), False
        self._times: dict[int, Time] = {}
        # Those that are there at the start are logged by the node.
        self._noted = len(stream.notes)
        self._waiting: queue.Queue[tuple[str, Any] | None] = queue.Queue(MOST_WAITING)
        self._pictures = threading.Semaphore(MOST_PICTURES)
        overriding = QoSOverridingOptions.with_default_policies()
        self._publishers: dict[str, Publisher] = {
            topic: node.create_publisher(kind, f"{name}/{topic}", quality, qos_overriding_options=overriding)
            for topic, (kind, quality) in TOPICS.items()
        }
        runs = (self._read, self._publish)
        self._threads = [threading.Thread(target=run, name=f"{name} {run.__name__}", daemon=True) for run in runs]

    def start(self) -> None:
        """Starts to read and to publish."""
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Releases the source, and waits for what was found to be published."""
        self.stream.close()
        for thread in self._threads:
            thread.join(5)
        self._tell_recording()

    def stop_recording(self) -> str:
        """Ends the recording, and returns its length in words. One that has ended by itself is told here, too."""
        said, self.recorded = self.recorded or _in_words(self.stream.end_recording()), ""
        if not said:
            raise wstac.Error(f"{self.name}: has no recording in progress")
        return said

    def _tell_recording(self) -> None:
        """Logs how a recording went that the end of the source, a full disk or a signal has ended."""
        try:
            if said := _in_words(self.stream.end_recording()):
                self.recorded = said
                self._log(said)
        except (wstac.Error, OSError) as error:
            self.failure = self.failure or str(error)
            self._log(str(error), is_error=True)

    def _log(self, text: str, *, is_error: bool = False) -> None:
        if not self._node.context.ok():
            # The logger has ended with the context.
            print(f"wstac_ros: {self.name}: {text}", file=sys.stderr, flush=True)
        elif is_error:
            self._node.get_logger().error(f"{self.name}: {text}")
        else:
            self._node.get_logger().info(f"{self.name}: {text}")

    def _read(self) -> None:
        try:
            while self._read_frames(self.with_pictures):
                pass
            for one in self.stream.completed:
                self._take_completed(one, self._last)
            self._take_records(self.stream.records(), self._now())
        except Exception as error:
            # Whatever it is, the other sensors go on. At the end of the context the stream is closed while it is read.
            if self._node.context.ok():
                self.failure = str(error)
                self._node.get_logger().error(f"{self.name}: {type(error).__name__}: {error}")
        finally:
            self._tell_recording()
            self.has_ended = True
            # The publisher ends behind all that waits.
            self._waiting.put(None)

    def _read_frames(self, pictures: bool) -> bool:
        """Reads frames until pictures are switched on or off. Returns False at the end."""
        for frame in self.stream.frames(pictures):
            self._take(frame)
            if self.with_pictures != pictures:
                return True
        return False

    def _publish(self) -> None:
        while (waiting := self._waiting.get()) is not None:
            topic, message = waiting
            if topic == "picture":
                self._pictures.release()
            # Nothing is published after the end of the context.
            if self._node.context.ok():
                self._publishers[topic].publish(message)
        for topic, (_, quality) in TOPICS.items():
            if quality is EVENTS and self._node.context.ok():
                # The node may end now, and with it what nobody has taken yet.
                self._publishers[topic].wait_for_all_acked(Duration(seconds=1))
        self._ended()

    def _now(self) -> Time:
        return self._node.get_clock().now().to_msg()

    def _header(self, record: Any, frame: int | None, now: Time) -> Header:
        """Returns the header of a record about a frame: the source's time of that frame, else that of reading it."""
        time = messages.time_of(record.stamp) if record.stamp else self._times.get(-1 if frame is None else frame, now)
        return Header(stamp=time, frame_id=self.frame_id)

    def _put(self, topic: str, message: Any) -> bool:
        """Hands a message over. It is skipped and counted if the middleware is behind; False then."""
        try:
            self._waiting.put_nowait((topic, message))
        except queue.Full:
            self._counts["skipped"] += 1
            return False
        return True

    def _put_picture(self, pixels: np.ndarray, header: Header) -> None:
        """Hands a picture over. It is skipped and counted, too, if too many wait."""
        if not self._pictures.acquire(blocking=False):
            self._counts["skipped"] += 1
            return
        picture = messages.picture(pixels, self.stream, header)
        if picture is None or not self._put("picture", picture):
            self._pictures.release()

    def _take(self, frame: wstac.Frame) -> None:
        now = messages.time_of(frame.stamp) if frame.stamp else self._now()
        if frame.picture is not None and self.stream.ros_encoding:
            self._put_picture(frame.picture, Header(stamp=now, frame_id=self.frame_id))
        self._has_taxels = bool(frame.taxels[0, 0] == frame.taxels[0, 0])
        for one in frame.completed:
            # What lost frames have completed ended with the frame before.
            self._take_completed(one, now if one.last_frame == frame.number else self._last)
        self._last = now
        self._take_records(frame.records, now)

    def _take_completed(self, one: wstac.FeatureFrame, time: Time) -> None:
        self._counts["frames"] = one.number + 1
        self._times[one.number] = time
        if len(self._times) > MOST_TIMES:
            del self._times[next(iter(self._times))]
        header = Header(stamp=time, frame_id=self.frame_id)
        self._put("features", messages.features(one.number, one.features, header))
        if self._has_taxels:
            self._put("taxels", messages.taxels(one.number, one.taxel_sums, header))

    def _take_records(self, records: Iterable[Any], now: Time) -> None:
        for record in records:
            if isinstance(record, wstac.Event):
                self._counts["events"] += 1
                self._put("event", messages.event(record, self._header(record, record.touch_frame, now)))
            elif isinstance(record, wstac.ContactEnd):
                self._put("contact_end", messages.contact_end(record, self._header(record, record.frame, now)))
            elif isinstance(record, wstac.Slip):
                self._put("slip", messages.slip(record, self._header(record, record.frame, now)))
            elif isinstance(record, wstac.Motion) and record.direction.deg is not None:
                self._put("motion", messages.motion(record, self._header(record, record.frame, now)))
            elif isinstance(record, wstac.Lost):
                self._counts["dropped"] += record.frames
                self._lost[record.why] += record.frames
            elif isinstance(record, wstac.Fault):
                self._counts["faults"] += 1
                self._node.get_logger().warning(f"{self.name}: {record.message}")

    def status(self) -> DiagnosticStatus:
        """Returns the state since the last call: a warning if something was lost, an error without frames."""
        notes = self.stream.notes
        for note in notes[self._noted :]:
            self._node.get_logger().info(f"{self.name}: {note}")
        self._noted = len(notes)
        counts = {name: self._counts[name] for name in ("frames", "events", "dropped", "skipped", "faults")}
        frames, lost = counts["frames"], counts["dropped"] + counts["skipped"] + counts["faults"]
        frames_before, lost_before = self._before
        self._before = (frames, lost)
        if self.failure:
            level, text = DiagnosticStatus.ERROR, self.failure
        elif lost != lost_before:
            level, text = DiagnosticStatus.WARN, "frames or messages were lost"
        elif self.has_ended:
            level, text = DiagnosticStatus.STALE, "the source has ended"
        elif frames == frames_before:
            level, text = DiagnosticStatus.ERROR, "no frames arrive"
        else:
            level, text = DiagnosticStatus.OK, "frames arrive"
        lost_by = {f"dropped: {why}": count for why, count in list(self._lost.items())}
        facts = {"source": self._source, **counts, **lost_by}
        values = [KeyValue(key=name, value=str(value)) for name, value in facts.items()]
        name = f"{self._node.get_fully_qualified_name()}: {self.name}"
        return DiagnosticStatus(level=level, name=name, message=text, hardware_id=self.name, values=values)


def _in_words(recording: tuple[int, str] | None) -> str:
    """Returns how long a recording is, and what a person should know of it; nothing without one."""
    if recording is None:
        return ""
    frames, doubt = recording
    return f"{frames} {'frame' if frames == 1 else 'frames'} recorded{doubt}"
