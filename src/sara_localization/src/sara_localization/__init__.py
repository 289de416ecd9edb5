"""State estimation for a mobile robot: the names and results of robot_localization, in Python."""
