"""The ROS shell of sara_control."""
