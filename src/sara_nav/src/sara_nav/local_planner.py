"""All local planners, by name: importing this module enters every one of them in LOCAL_PLANNERS."""
from sara_nav.dwa_planner import DWAPlanner, DWAPlannerConfig  # noqa: F401
from sara_nav.local_command import (BLOCKED, DRIVING, FAILED, LOCAL_PLANNERS, OFF_PATH, REACHED,  # noqa: F401
                                    LocalCommand)
from sara_nav.rotate_then_pursue import RotateThenPursue, RotateThenPursueConfig, approach_speed  # noqa: F401
from sara_nav.trajectory_planner import TrajectoryPlanner, TrajectoryPlannerConfig  # noqa: F401
