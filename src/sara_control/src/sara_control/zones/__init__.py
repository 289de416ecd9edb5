"""Distance zones: how fast the robot may drive given what its range sensors measure."""
