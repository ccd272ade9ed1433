"""Tactile sensors as a node of ROS 2."""
