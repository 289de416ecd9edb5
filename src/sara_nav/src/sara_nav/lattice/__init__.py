"""LatticePlanner: a global planner for the oriented footprint."""
