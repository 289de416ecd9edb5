"""range_localization without ROS: a pose found anywhere, and corrected, by ranges against a known map."""
