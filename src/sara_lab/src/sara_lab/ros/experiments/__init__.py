"""The experiments over ROS."""
