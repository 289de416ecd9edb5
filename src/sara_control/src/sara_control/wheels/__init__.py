"""diff_drive_controller without ROS: commands to wheel speeds, wheel positions to odometry."""
