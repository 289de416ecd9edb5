"""What several packages need and none owns: angles, planar poses, checks of configuration. Plain Python, no ROS."""
