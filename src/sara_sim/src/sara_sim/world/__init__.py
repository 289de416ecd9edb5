"""What stands around the chair: map, obstacles, ramps, and rays through them."""
