"""The touch screen's server as a node, a stand-in for the robot, and pages that fail while they drive."""
