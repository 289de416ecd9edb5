"""costmap_2d: the costmap, its layers and their parameters."""
