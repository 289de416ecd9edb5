"""Maps as files: reading and writing the ROS map format."""
