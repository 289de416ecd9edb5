"""What nodes of several packages share; the only part of this package that imports ROS."""
