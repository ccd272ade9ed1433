"""Starts wstac-node for one sensor, and publishes the sensor's frames.

    ros2 launch wstac_bringup wstac.launch.py name:=left source:=/dev/video0

wstac-node must be on the path. Its other arguments go into `arguments`, in quotes: arguments:="--model builtin".
"""

import shlex
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = {
    "name": ("left", "The sensor's name, which is a part of its topics and frames."),
    "source": ("/dev/video0", "The camera, board, recording or scene."),
    "namespace": ("wstac", "The beginning of all topics and services."),
    "files": ("", "The folder in which services may read and write; empty for none."),
    "arguments": ("", "Other arguments of wstac-node."),
}


def start(context):
    """Returns what is started, now that the arguments are known."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    name = given["name"]
    command = ["wstac-node", f"{name}={given['source']}", "--ros", "--namespace", given["namespace"], "--node-name", f"wstac_{name}"]
    if given["files"]:
        command += ["--files", given["files"]]
    command += shlex.split(given["arguments"])
    file = Path(get_package_share_directory("wstac_bringup")) / "urdf" / "wstac.urdf"
    description = file.read_text().replace('"sensor_', f'"{name}_')
    return [
        ExecuteProcess(cmd=command, name="wstac_node", output="screen"),
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            namespace=f"{given['namespace']}/{name}",
            parameters=[{"robot_description": description}],
        ),
    ]


def generate_launch_description():
    """Returns the description that ros2 launch asks for."""
    declared = [DeclareLaunchArgument(name, default_value=value, description=about) for name, (value, about) in ARGUMENTS.items()]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])
