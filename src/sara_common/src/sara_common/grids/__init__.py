"""Grids: distances to the nearest obstacle, and images of maps."""
