"""move_base without ROS: the state machine and its settings."""
