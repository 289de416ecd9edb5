"""The joystick node: two axes in, frame 0x110 out."""
