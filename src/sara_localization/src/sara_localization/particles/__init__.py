"""Particle filters without ROS: amcl, and a place found by range sensors alone."""
