"""Installs the node where ros2 run and ros2 launch look for it. It needs the Python package wstac, which pip
installs."""

from setuptools import setup

setup(
    name="wstac_ros",
    version="0.3.0",
    description="A node that publishes WSTac tactile sensors",
    license="MIT OR Apache-2.0",
    packages=["wstac_ros"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/wstac_ros"]),
        ("share/wstac_ros", ["package.xml"]),
        ("share/wstac_ros/launch", ["launch/wstac.launch.py"]),
        ("share/wstac_ros/urdf", ["urdf/wstac.urdf"]),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    entry_points={"console_scripts": ["node = wstac_ros.node:main"]},
)
