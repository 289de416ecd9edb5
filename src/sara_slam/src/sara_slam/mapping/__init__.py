"""Scans and odometry in, the graph and the map out."""
