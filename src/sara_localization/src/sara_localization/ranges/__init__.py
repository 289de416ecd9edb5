"""range_localization without ROS: a pose corrected by ranges against a known map."""
