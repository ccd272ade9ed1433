"""One sensor: a thread that reads it, and a thread that publishes what was found."""

from __future__ import annotations

import queue
import threading
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

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

    def _read(self) -> None:
        try:
            sums = messages.SumsOfFrames(self.stream.fps)
            while self._read_frames(sums, self.with_pictures):
                pass
            self._take_records(self.stream.records(), self._now())
        except Exception as error:
            # Whatever it is, the other sensors go on. At the end of the context the stream is closed while it is read.
            if self._node.context.ok():
                self.failure = str(error)
                self._node.get_logger().error(f"{self.name}: {type(error).__name__}: {error}")
        finally:
            self.has_ended = True
            # The publisher ends behind all that waits.
            self._waiting.put(None)

    def _read_frames(self, sums: messages.SumsOfFrames, pictures: bool) -> bool:
        """Reads frames until pictures are switched on or off. Returns False at the end."""
        for frame in self.stream.frames(pictures):
            self._take(frame, sums)
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

    def _put(self, topic: str, message: Any) -> None:
        """Hands a message over. It is skipped and counted if the middleware is behind."""
        try:
            self._waiting.put_nowait((topic, message))
        except queue.Full:
            self._counts["skipped"] += 1

    def _take(self, frame: wstac.Frame, sums: messages.SumsOfFrames) -> None:
        now = messages.time_of(frame.stamp) if frame.stamp else self._now()
        header = Header(stamp=now, frame_id=self.frame_id)
        encoding = self.stream.ros_encoding
        if frame.picture is not None and encoding and self._pictures.acquire(blocking=False):
            picture = messages.picture(frame.picture, self.stream.size, encoding, header)
            if picture is None:
                self._pictures.release()
            else:
                self._put("picture", picture)
        has_taxels = frame.taxels[0, 0] == frame.taxels[0, 0]
        sums.add(frame.sums)
        if frame.features is not None:
            self._counts["frames"] = frame.feature_frame + 1
            self._times[frame.feature_frame] = now
            if len(self._times) > MOST_TIMES:
                del self._times[next(iter(self._times))]
            whole = sums.complete()
            self._put("features", messages.features(frame.feature_frame, frame.features, header))
            if has_taxels:
                self._put("taxels", messages.taxels(frame.feature_frame, whole, header))
        self._take_records(frame.records, now)

    def _take_records(self, records: Iterable[Any], now: Time) -> None:
        for record in records:
            if isinstance(record, wstac.Event):
                self._counts["events"] += 1
                self._put("event", messages.event(record, self._header(record, record.touch_frame, now)))
            elif isinstance(record, wstac.ContactEnd):
                self._put("contact_end", messages.contact_end(record, self._header(record, record.frame, now)))
            elif isinstance(record, wstac.Slip):
                self._put("slip", messages.slip(record, self._header(record, record.frame, now)))
            elif isinstance(record, wstac.Motion):
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
