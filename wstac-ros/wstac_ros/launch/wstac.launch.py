"""Starts the node for one sensor, and publishes the sensor's coordinate frames.

    ros2 launch wstac_ros wstac.launch.py name:=left source:=/dev/video0

For several sensors, or other parameters, `parameters` is a file of parameters in the place of name and source.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = {
    "name": ("left", "The sensor's name, which is a part of its topics and frames."),
    "source": ("/dev/video0", "The camera, board, recording or scene."),
    "namespace": ("wstac", "The beginning of all topics and services."),
    "files": ("", "The folder in which services may read and write; empty for none."),
    "parameters": ("", "A file of parameters of the node, in the place of the above."),
}


def start(context):
    """Returns what is started, now that the arguments are known."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    name, namespace = given["name"], given["namespace"]
    file = Path(get_package_share_directory("wstac_ros")) / "urdf" / "wstac.urdf"
    description = file.read_text().replace('"sensor_', f'"{name}_')
    parameters = given["parameters"] or {"sensors": [f"{name}={given['source']}"], "files": given["files"]}
    return [
        Node(package="wstac_ros", executable="node", namespace=namespace, output="screen", parameters=[parameters]),
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            namespace=f"{namespace}/{name}",
            parameters=[{"robot_description": description}],
        ),
    ]


def generate_launch_description():
    """Returns the description that ros2 launch asks for."""
    arguments = ((name, value, about) for name, (value, about) in ARGUMENTS.items())
    declared = [DeclareLaunchArgument(name, default_value=value, description=about) for name, value, about in arguments]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])
