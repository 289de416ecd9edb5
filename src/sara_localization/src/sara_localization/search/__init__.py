"""Where a robot is that may be anywhere in a map, by range sensors with wide cones."""
