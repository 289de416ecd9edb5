"""Frames of the bus to readings in SI units: the whole of read.py without ROS."""
