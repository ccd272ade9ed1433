#!/usr/bin/env python3
"""Tests that colcon takes the packages for ROS 2: its own parser reads every package.xml."""

from __future__ import annotations

import unittest
from pathlib import Path

from catkin_pkg.package import parse_package

ROOT = Path(__file__).resolve().parents[2]


class PackagesTest(unittest.TestCase):
    def test_every_package_is_read_without_a_complaint(self) -> None:
        names = set()
        for file in sorted((ROOT / "wstac-ros").glob("*/package.xml")):
            with self.subTest(file.parent.name):
                complaints: list[str] = []
                names.add(parse_package(file, warnings=complaints).name)
                self.assertEqual(complaints, [])
        self.assertLessEqual({"wstac_ros", "wstac_msgs"}, names)


if __name__ == "__main__":
    unittest.main()
