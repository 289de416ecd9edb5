"""Places on the earth in a robot's world frame: navsat_transform_node without ROS."""
