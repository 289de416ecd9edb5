"""A differential drive without ros_control, with its multiplexer and safety gate. ROS is only in sara_control.ros."""
