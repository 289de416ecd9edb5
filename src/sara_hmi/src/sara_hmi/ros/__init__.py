"""The touch screen's node: what the server needs of a robot, by ROS."""
