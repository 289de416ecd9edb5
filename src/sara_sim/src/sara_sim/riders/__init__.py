"""Simulated riders: where they would steer, from pose and goal, and what gets in the way of their hands and eyes."""
