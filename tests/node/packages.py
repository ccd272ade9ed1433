"""Checks the packages for colcon as far as can be done without ROS: their lists of files, the launch file with stand-ins for
ROS's modules, and the sensor's frames as urdf_parser_py reads them."""

import re
import subprocess
import sys
import types
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from urdf_parser_py.urdf import URDF

from common import PATIENCE, fail, same

FOLDER = Path(__file__).parents[2] / "wstac-node"
BRINGUP = FOLDER / "wstac_bringup"


class Stand:
    """Stands in for a class of ROS, and keeps what it was made of."""

    def __init__(self, *positional, **named):
        self.positional, self.named = positional, named


def launched(given):
    """Runs the launch file. Returns what it declares and what it starts."""

    class Given(Stand):
        def perform(self, _):
            return given.get(self.positional[0], defaults[self.positional[0]])

    stands = {
        "ament_index_python": {}, "ament_index_python.packages": {"get_package_share_directory": lambda package: FOLDER / package},
        "launch": {"LaunchDescription": Stand}, "launch.substitutions": {"LaunchConfiguration": Given},
        "launch.actions": {name: type(name, (Stand,), {}) for name in ("DeclareLaunchArgument", "ExecuteProcess", "OpaqueFunction")},
        "launch_ros": {}, "launch_ros.actions": {"Node": type("Node", (Stand,), {})},
    }
    for name, content in stands.items():
        sys.modules[name] = types.ModuleType(name)
        vars(sys.modules[name]).update(content)
    scope = {}
    file = BRINGUP / "launch" / "wstac.launch.py"
    exec(compile(file.read_text(), str(file), "exec"), scope)
    *declared, function = scope["generate_launch_description"]().positional[0]
    defaults = {one.positional[0]: one.named["default_value"] for one in declared}
    if not given.keys() <= defaults.keys():
        fail(f"the launch file declares {sorted(defaults)}, expected {sorted(given)}")
    return function.named["function"](None)


def check_packages(programs):
    """The packages name their files, the launch file starts the node, and the frames are a tree."""
    for package in ("wstac_msgs", "wstac_bringup"):
        text = (FOLDER / package / "package.xml").read_text()
        root = ElementTree.fromstring(text)
        same((root.tag, root.findtext("name")), ("package", package), "package.xml")
        cmake = (FOLDER / package / "CMakeLists.txt").read_text()
        same(f"project({package}" in cmake and "ament_package()" in cmake, True, f"CMakeLists.txt of {package}")
        for dependency in re.findall(r"find_package\((\w+)", cmake):
            same(dependency in text, True, f"{dependency} in {package}/package.xml")
    listed = sorted(re.findall(r"^\s+((?:msg|srv)/\w+\.(?:msg|srv))$", (FOLDER / "wstac_msgs" / "CMakeLists.txt").read_text(), re.MULTILINE))
    there = sorted(str(file.relative_to(FOLDER / "wstac_msgs")) for file in (FOLDER / "wstac_msgs").glob("*/*.*"))
    same(listed, there, "definitions in CMakeLists.txt")
    for folder in re.search(r"install\(DIRECTORY (.*) DESTINATION", (BRINGUP / "CMakeLists.txt").read_text())[1].split():
        same((BRINGUP / folder).is_dir(), True, f"the folder {folder} of wstac_bringup")

    node, publisher = launched({"name": "thumb", "source": "scene:Saw3@150", "files": str(programs.folder), "arguments": "--listen tcp/127.0.0.1:0"})
    command = node.named["cmd"]
    same(command[:2], ["wstac-node", "thumb=scene:Saw3@150"], "what the launch file starts")
    with programs.node(*command[1:]) as process:
        same(process.wait(PATIENCE), 0, f"exit code of what the launch file starts: {process.said()!r}")
    same(publisher.named["executable"], "robot_state_publisher", "what the launch file starts")
    robot = URDF.from_xml_string(publisher.named["parameters"][0]["robot_description"].encode())
    same([link.name for link in robot.links], ["thumb_base", "thumb_frame"], "links of the sensor")
    same(robot.get_root(), "thumb_base", "root of the frames")
    same(robot.get_chain("thumb_base", "thumb_frame", joints=True, links=False), ["thumb_mount"], "joints of the sensor")
    same([joint.type for joint in robot.joints], ["fixed"], "types of joints")
    done = subprocess.run([programs.command, "--node-name", "1st", "scene:Saw3@150"], capture_output=True, text=True, timeout=PATIENCE, check=False)
    same((done.returncode, "no digit in front" in done.stderr), (2, True), f"a wrong name of a node: {done.stderr!r}")
    print("packages: files, dependencies and frames fit each other, and wstac-node takes what the launch file starts")
