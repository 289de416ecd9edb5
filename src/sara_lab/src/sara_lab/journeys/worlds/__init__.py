"""Worlds that no map of SARA's shows: made by a seed, or others' (maps, Gazebo), and the planners that drive there."""
