"""Random goals, maps, sensor messages and cancels against move_base."""
