"""All local planners, and the kernels that they use."""

from sara_nav.goals import plan_check as plan_watch
from sara_nav.grids import clearance, collision, outline
from sara_nav.grids import free_motions as ways
from sara_nav.planners.local_command import BLOCKED, DRIVING, FAILED, LOCAL_PLANNERS, OFF_PATH, REACHED, LocalCommand
from sara_nav.pursuit import curvature_law as tracking_law
from sara_nav.pursuit import path_tracker, smooth_speed, smooth_turn, speed_ahead, stopping_path
from sara_nav.pursuit.rotate_then_pursue import RotateThenPursue, RotateThenPursueConfig
from sara_nav.sampled import critics, map_grid, rollout, speed_samples, trajectory
from sara_nav.sampled.dwa_planner import DWAPlanner, DWAPlannerConfig
from sara_nav.sampled.trajectory_planner import TrajectoryPlanner, TrajectoryPlannerConfig

__all__ = [
    'BLOCKED',
    'DRIVING',
    'FAILED',
    'LOCAL_PLANNERS',
    'OFF_PATH',
    'REACHED',
    'LocalCommand',
    'DWAPlanner',
    'DWAPlannerConfig',
    'RotateThenPursue',
    'RotateThenPursueConfig',
    'TrajectoryPlanner',
    'TrajectoryPlannerConfig',
    'warm',
]


def warm() -> None:
    """Compile, or load from the cache, every kernel the local planners use."""
    for module in (
        clearance,
        collision,
        critics,
        map_grid,
        outline,
        path_tracker,
        plan_watch,
        rollout,
        smooth_speed,
        smooth_turn,
        speed_ahead,
        speed_samples,
        stopping_path,
        tracking_law,
        trajectory,
        ways,
    ):
        module.warm()
