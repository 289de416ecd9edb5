"""CAN frames of a robot to plain readings and back; nothing here needs ROS but the modules of canserial.ros."""
