"""SARA put together: missions, the lockstep harness, experiments and their reports."""
