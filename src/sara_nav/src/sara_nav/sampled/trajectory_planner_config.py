"""The parameters of base_local_planner/TrajectoryPlannerROS, under the peer's names."""

import math
from dataclasses import dataclass
from typing import ClassVar

from sara_common.config import range_faults


@dataclass(frozen=True)
class TrajectoryPlannerConfig:
    """Names, units and values in force of TrajectoryPlannerROS, but holonomic_robot, which is false here.

    Of no effect on a differential drive, as in the peer: acc_lim_y, y_vels. Of no effect in the peer nor here:
    stop_time_buffer. path_distance_bias and goal_distance_bias are per cell, with meter_scoring per metre.
    """

    acc_lim_x: float = 2.5
    acc_lim_y: float = 2.5
    acc_lim_theta: float = 3.2
    max_vel_x: float = 0.55
    min_vel_x: float = 0.0
    max_vel_theta: float = 1.0
    min_vel_theta: float = -1.0
    min_in_place_vel_theta: float = 0.4
    escape_vel: float = -0.1
    holonomic_robot: bool = False
    y_vels: str = '-0.3,-0.1,0.1,0.3'
    xy_goal_tolerance: float = 0.10
    yaw_goal_tolerance: float = 0.05
    latch_xy_goal_tolerance: bool = False
    stop_time_buffer: float = 0.2
    prune_plan: bool = True
    sim_time: float = 1.7
    sim_granularity: float = 0.025
    angular_sim_granularity: float = 0.025
    vx_samples: int = 20
    vtheta_samples: int = 20
    controller_frequency: float = 20.0
    meter_scoring: bool = False
    path_distance_bias: float = 0.6
    goal_distance_bias: float = 0.8
    occdist_scale: float = 0.01
    heading_lookahead: float = 0.325
    heading_scoring: bool = False
    heading_scoring_timestep: float = 0.1
    dwa: bool = False
    simple_attractor: bool = False
    oscillation_reset_dist: float = 0.05
    escape_reset_dist: float = 0.10
    escape_reset_theta: float = 0.5 * math.pi
    world_model: str = 'costmap'

    LIMITS: ClassVar[dict] = {
        'acc_lim_x': (0.01, 20.0),
        'acc_lim_y': (0.0, 20.0),
        'acc_lim_theta': (0.01, 20.0),
        'max_vel_x': (0.0, 20.0, True),
        'min_vel_x': (0.0, 20.0),
        'max_vel_theta': (0.0, 20.0, True),
        'min_vel_theta': (-20.0, 0.0),
        'min_in_place_vel_theta': (0.0, 20.0, True),
        'xy_goal_tolerance': (0.0, 10.0, True),
        'yaw_goal_tolerance': (0.0, math.pi, True),
        'stop_time_buffer': (0.0, 10.0),
        'sim_time': (0.0, 10.0, True),
        'sim_granularity': (0.001, 5.0),
        'angular_sim_granularity': (0.001, 0.5 * math.pi),
        'vx_samples': (1, 300),
        'vtheta_samples': (1, 300),
        'controller_frequency': (0.0, 1000.0, True),
        'path_distance_bias': (0.0, 5.0),
        'goal_distance_bias': (0.0, 5.0),
        'occdist_scale': (0.0, 5.0),
        'heading_lookahead': (0.0, 5.0),
        'heading_scoring_timestep': (0.0, 1.0),
        'oscillation_reset_dist': (0.0, 5.0),
        'escape_reset_dist': (0.0, 5.0),
        'escape_reset_theta': (0.0, 5.0),
    }
    """Limits of the numbers: (low, high, whether low itself is excluded)."""
    FIXED: ClassVar[tuple] = (
        'xy_goal_tolerance',
        'yaw_goal_tolerance',
        'latch_xy_goal_tolerance',
        'stop_time_buffer',
        'prune_plan',
        'controller_frequency',
        'meter_scoring',
        'world_model',
    )
    """What the peer does not let dynamic_reconfigure change."""
    WITHOUT_EFFECT: ClassVar[dict] = {
        'stop_time_buffer': 'a trajectory that touches something within sim_time is discarded, however late',
        'point_grid/': 'world_model is costmap, the only one there is',
    }
    """What is taken but changes nothing, here as in the peer, and why; a name ending in / is a group."""

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = range_faults(self, self.LIMITS)
        if not -2.0 <= self.escape_vel < 0.0:
            result.append(
                f'escape_vel is {self.escape_vel!r}, allowed are numbers from -2 to below 0 (the robot backs out '
                'with it)'
            )
        if self.holonomic_robot:
            result.append(
                'holonomic_robot is true, allowed is false: this planner drives robots with differential '
                'drive, which cannot move sideways'
            )
        if self.world_model != 'costmap':
            result.append(f'world_model is {self.world_model!r}, allowed is costmap')
        try:
            [float(v) for v in self.y_vels.strip('[] ').replace(',', ' ').split()]
        except (ValueError, AttributeError):
            result.append(f'y_vels is {self.y_vels!r}, allowed are numbers separated by commas')
        if self.min_vel_x > self.max_vel_x:
            result.append(f'min_vel_x is {self.min_vel_x!r}, allowed is no more than max_vel_x ({self.max_vel_x!r})')
        if self.heading_scoring and self.heading_scoring_timestep >= self.sim_time:
            result.append(
                f'heading_scoring_timestep is {self.heading_scoring_timestep!r}, allowed is less than sim_time '
                f'({self.sim_time!r})'
            )
        return result
