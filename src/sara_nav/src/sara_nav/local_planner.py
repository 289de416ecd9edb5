"""All local planners, and the kernels that they use."""
from sara_nav import clearance, collision, critics, map_grid, outline, path_tracker, plan_watch, rollout, smooth_speed, speed_ahead, speed_samples, stopping_steps, tracking_law, ways
from sara_nav.dwa_planner import DWAPlanner, DWAPlannerConfig
from sara_nav.local_command import BLOCKED, DRIVING, FAILED, LOCAL_PLANNERS, OFF_PATH, REACHED, LocalCommand
from sara_nav.rotate_then_pursue import RotateThenPursue, RotateThenPursueConfig
from sara_nav.trajectory_planner import TrajectoryPlanner, TrajectoryPlannerConfig

__all__ = ['BLOCKED', 'DRIVING', 'FAILED', 'LOCAL_PLANNERS', 'OFF_PATH', 'REACHED', 'LocalCommand', 'DWAPlanner', 'DWAPlannerConfig',
           'RotateThenPursue', 'RotateThenPursueConfig', 'TrajectoryPlanner', 'TrajectoryPlannerConfig', 'warm']


def warm():
    """Compile, or load from the cache, every kernel the local planners use."""
    for module in (clearance, collision, critics, map_grid, outline, path_tracker, plan_watch, rollout, smooth_speed, speed_ahead, speed_samples, stopping_steps, tracking_law, ways):
        module.warm()
