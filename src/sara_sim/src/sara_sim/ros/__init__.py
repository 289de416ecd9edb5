"""ROS shell of the simulator."""
