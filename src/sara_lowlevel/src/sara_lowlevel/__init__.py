"""The programs of SARA's microcontrollers (motor, sensor and joystick node) as plain Python objects: no ROS, no
threads, no clock of their own.
"""
