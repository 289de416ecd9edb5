"""The joystick node: two axes in, frame JOYSTICK out."""
