"""RotateThenPursue: a local planner that turns in place and then follows the path."""
