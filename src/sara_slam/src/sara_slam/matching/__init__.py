"""Correlative scan matching (Olson 2009): a likelihood grid of points, and the pose of a scan in it."""
