"""TrajectoryPlannerROS and DWAPlannerROS: local planners that sample velocities."""
