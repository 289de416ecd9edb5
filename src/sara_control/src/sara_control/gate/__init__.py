"""The safety gate: the last check of a command before the wheels."""
