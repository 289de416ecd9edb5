"""A differential drive without ros_control: odometry, commands, and the CAN base of SARA. ROS only in sara_control.ros."""
