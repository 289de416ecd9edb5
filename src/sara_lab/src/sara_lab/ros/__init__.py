"""The parts of the laboratory that need ROS."""
