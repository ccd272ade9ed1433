"""The node /wstac/node: sensors as topics, with services, parameters and diagnostics.

ros2 run wstac_ros node --ros-args -p sensors:="['left=/dev/video0', 'right=scene:Saw3@150']"
"""

from __future__ import annotations

import errno
import os
import re
import stat
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
import wstac
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger
from wstac import _wstac
from wstac_msgs.srv import LoadFile, StartRecording

from .sensor import Sensor

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
FILE = re.compile(r"[^./\\\x00-\x1f\x7f][^/\\\x00-\x1f\x7f]*")
# Parameters of a sensor that are read at the start: the default, which requests nothing, and a description.
OPTIONS: dict[str, tuple[Any, str]] = {
    "configuration": ("", "TOML file of wstac run --config"),
    "models": (Parameter.Type.STRING_ARRAY, "texture models: files or builtin"),
    "fps": (0.0, "frames per second that a camera or scene is asked for, or those of a file"),
    "size": (Parameter.Type.INTEGER_ARRAY, "width and height that a camera or scene is asked for"),
    "format": ("", "four-character code that a camera or scene is asked for"),
    "keep_controls": (False, "leaves a camera's exposure, gain, white balance and focus as they are"),
    "recorded": ("", "name of the sensor in a recording of several"),
    "baud": (0, "bits per second of a board's serial line"),
}
TOML = re.compile(r".*: (TOML line \d+, column \d+): ")
IS_FOLDER = "files: is empty, expected the folder that services may read and write"


class SensorsNode(Node):
    """A node for all sensors of the parameter `sensors`."""

    def __init__(self, **options: Any) -> None:
        super().__init__("node", namespace="wstac", **options)
        fixed = {"descriptor": ParameterDescriptor(read_only=True, description="NAME=SOURCE of each sensor")}
        given = self.declare_parameter("sensors", Parameter.Type.STRING_ARRAY, **fixed).value or []
        about = "folder that services may read and write; none without it"
        folder = self.declare_parameter("files", "", ParameterDescriptor(read_only=True, description=about)).value
        self._folder = Path(folder) if folder else None
        if self._folder and not self._folder.is_dir():
            raise wstac.Error(f"files: is {folder!r}, expected an existing folder")
        # An order waits for the sensor, for at most a second: the others go on.
        self._group = ReentrantCallbackGroup()
        self.is_over = threading.Event()
        self.sensors: dict[str, Sensor] = {}
        for one in given or ["sensor=/dev/video0"]:
            name, _, source = one.partition("=")
            if not source or not NAME.fullmatch(name) or name in self.sensors:
                expected = "NAME=SOURCE, and a name of its own of letters, digits and _"
                raise wstac.Error(f"sensors: has {one!r}, expected {expected}")
            self.sensors[name] = self._sensor(name, source)
        self.add_on_set_parameters_callback(self._change)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_timer(1.0, self._publish_diagnostics)
        for sensor in self.sensors.values():
            sensor.start()

    def _sensor(self, name: str, source: str) -> Sensor:
        """Opens a sensor, and declares its topics, parameters and services."""
        options = self._options(name)
        # With a folder, all frames of a camera can be recorded; else the newest one is worth more than those before it.
        # A board has no such choice.
        every = self._folder is not None and not _wstac.is_board(source)
        stream = wstac.open(source, every=every, motion=True, at_once=True, paced=True, **options)
        self.get_logger().info(f"{name}: {stream.about}")
        for note in stream.notes:
            self.get_logger().info(f"{name}: {note}")
        sensor = Sensor(self, name, source, stream, self._one_has_ended)
        about = {"frame_id": "coordinate frame of messages", "picture": "whether pictures are published"}
        described = {of: ParameterDescriptor(description=text) for of, text in about.items()}
        sensor.frame_id = self.declare_parameter(f"{name}.frame_id", sensor.frame_id, described["frame_id"]).value
        sensor.with_pictures = self.declare_parameter(f"{name}.picture", False, described["picture"]).value
        if sensor.with_pictures and stream.ros_encoding is None:
            self.get_logger().warning(f"{name}: its frames are no pictures of ROS 2; they are not published")
        orders: dict[str, tuple[type, Callable[[Sensor, Any, Any], str]]] = {
            "restart_baseline": (Trigger, self._restart_baseline),
            "load_configuration": (LoadFile, self._load_configuration),
            "load_model": (LoadFile, self._load_model),
            "start_recording": (StartRecording, self._start_recording),
            "stop_recording": (Trigger, self._stop_recording),
        }
        for order, (kind, follow) in orders.items():
            self.create_service(kind, f"{name}/{order}", _answering(sensor, follow), callback_group=self._group)
        return sensor

    def _options(self, name: str) -> dict[str, Any]:
        """Declares the parameters of a sensor that are read once. Returns the given ones, as wstac.open takes them."""
        found = {}
        for option, (default, about) in OPTIONS.items():
            # 60 is as good as 60.0.
            descriptor = ParameterDescriptor(read_only=True, description=about, dynamic_typing=option == "fps")
            value = self.declare_parameter(f"{name}.{option}", default, descriptor).value
            if value:
                found[option] = value if isinstance(value, (str, int, float)) else list(value)
        if "configuration" in found:
            found["config"] = wstac.Config.read(found.pop("configuration"))
        if "recorded" in found:
            found["sensor"] = found.pop("recorded")
        return found

    def _one_has_ended(self) -> None:
        if all(sensor.has_ended for sensor in self.sensors.values()):
            self.is_over.set()

    def _change(self, parameters: list[Parameter]) -> SetParametersResult:
        """Follows changes of parameters. rclpy itself refuses those that are read-only or of another type."""
        for parameter in parameters:
            if parameter.name.endswith(".frame_id") and not parameter.value:
                return SetParametersResult(successful=False, reason=f"{parameter.name} is empty, expected a name")
        for parameter in parameters:
            name, _, of = parameter.name.partition(".")
            if name in self.sensors and of == "frame_id":
                self.sensors[name].frame_id = parameter.value
            elif name in self.sensors and of == "picture":
                self.sensors[name].with_pictures = parameter.value
        return SetParametersResult(successful=True)

    def _publish_diagnostics(self) -> None:
        message = DiagnosticArray(status=[sensor.status() for sensor in self.sensors.values()])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _path(self, file: str) -> Path:
        """Returns the path of a file that a service names."""
        if self._folder is None:
            raise wstac.Error(IS_FOLDER)
        if not FILE.fullmatch(file):
            raise wstac.Error(f"file is {file!r}, expected the name of a file without folders")
        return self._folder / file

    def _content(self, file: str, most_mb: int) -> bytes:
        """Returns the content of a file that a service names. It is opened once: what is checked is what is read."""
        refusal = wstac.Error(f"file is {file!r}: a link or no file, expected a file")
        try:
            # Whoever opens a pipe may wait forever.
            opened = os.open(self._path(file), os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        except OSError as error:
            raise refusal if error.errno == errno.ELOOP else wstac.Error(f"{file}: {error.strerror}") from error
        try:
            # fdopen refuses a folder, and leaves it open.
            if not stat.S_ISREG(os.fstat(opened).st_mode):
                raise refusal
        except BaseException:
            os.close(opened)
            raise
        with os.fdopen(opened, "rb") as content:
            whole = content.read((most_mb << 20) + 1)
        if len(whole) > most_mb << 20:
            raise wstac.Error(f"file is {file!r}: larger than {most_mb} MB, expected a smaller file")
        return whole

    def _restart_baseline(self, sensor: Sensor, _request: Any, _response: Any) -> str:
        sensor.stream.restart_baseline()
        return "the baseline is gathered; leave the sensor untouched for 25 frames"

    def _load_configuration(self, sensor: Sensor, request: LoadFile.Request, _response: Any) -> str:
        try:
            config = wstac.Config(self._content(request.file, 1).decode())
        except UnicodeDecodeError:
            raise wstac.Error(f"{request.file}: is no text, expected TOML") from None
        except wstac.Error as error:
            if place := TOML.match(str(error)):
                # The rest quotes the file, and whoever asks may not read it.
                self.get_logger().error(f"{sensor.name}: {error}")
                raise wstac.Error(f"{request.file}: {place[1]} is wrong; the log of the node says why") from error
            raise wstac.Error(str(error).replace("configuration:", f"{request.file}:", 1)) from error
        sensor.stream.reconfigure(config)
        return f"{request.file} is used"

    def _load_model(self, sensor: Sensor, request: LoadFile.Request, _response: Any) -> str:
        file = request.file
        if file == "builtin" or file.startswith("builtin:"):
            model = wstac.Model.load(file)
        else:
            model = wstac.Model.from_bytes(self._content(file, 256), file)
        sensor.stream.use_models([model])
        return f"{request.file} is used"

    def _start_recording(self, sensor: Sensor, request: StartRecording.Request, response: Any) -> str:
        labels = dict(label.split("=", 1) for label in request.labels if "=" in label)
        if len(labels) != len(request.labels):
            raise wstac.Error(f"labels: are {list(request.labels)}, expected NAME=VALUE, each name once")
        names = [request.file] if request.file else [f"{sensor.name}-{number}.mcap" for number in range(1, 10_000)]
        paths = [self._path(name) for name in names]
        path = next((path for path in paths if not path.exists()), paths[0])
        if path.suffix != ".mcap":
            raise wstac.Error(f"file is {request.file!r}, expected a name that ends in .mcap")
        sensor.stream.start_recording(path, labels, features_only=request.features_only)
        response.recorded = str(path)
        return "the baseline is gathered; leave the sensor untouched for 25 frames"

    def _stop_recording(self, sensor: Sensor, _request: Any, _response: Any) -> str:
        return sensor.stop_recording()


def _answering(sensor: Sensor, follow: Callable[[Sensor, Any, Any], str]) -> Callable[[Any, Any], Any]:
    """Returns the callback of a service: one that is refused has changed nothing, and says why."""

    def answer(request: Any, response: Any) -> Any:
        try:
            response.message = follow(sensor, request, response)
            response.success = True
        except (wstac.Error, OSError) as error:
            response.success, response.message = False, str(error)
        return response

    return answer


def main() -> None:
    """Publishes all sensors to their ends. The exit code is 1 if one of them failed, 2 if one cannot be used."""
    rclpy.init()
    try:
        node = SensorsNode()
    except (wstac.Error, ParameterException) as error:
        print(f"wstac_ros: {error}", file=sys.stderr)
        sys.exit(2)
    executor = MultiThreadedExecutor()
    executor.add_node(node)
    try:
        while rclpy.ok() and not node.is_over.is_set():
            executor.spin_once(timeout_sec=0.1)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    for sensor in node.sensors.values():
        sensor.close()
    rclpy.try_shutdown()
    sys.exit(1 if any(sensor.failure for sensor in node.sensors.values()) else 0)


if __name__ == "__main__":
    main()
