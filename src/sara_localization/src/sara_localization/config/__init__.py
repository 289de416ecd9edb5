"""The parameters of robot_localization, read and checked."""
