"""The parameters of dwa_local_planner/DWAPlannerROS, under the peer's names."""

import math
from dataclasses import dataclass
from typing import ClassVar

from sara_common.config import range_faults


@dataclass(frozen=True)
class DWAPlannerConfig:
    """Names, units and defaults of DWAPlannerROS, but max_vel_y and min_vel_y, which are 0 here.

    Of no effect on a differential drive, as in the peer: acc_lim_y, vy_samples. Of no effect in the peer nor here:
    acc_lim_trans, stop_time_buffer. path_distance_bias and goal_distance_bias are per metre.
    """

    max_vel_trans: float = 0.55
    min_vel_trans: float = 0.1
    max_vel_x: float = 0.55
    min_vel_x: float = 0.0
    max_vel_y: float = 0.0
    min_vel_y: float = 0.0
    max_vel_theta: float = 1.0
    min_vel_theta: float = 0.4
    acc_lim_x: float = 2.5
    acc_lim_y: float = 2.5
    acc_lim_theta: float = 3.2
    acc_lim_trans: float = 0.1
    prune_plan: bool = False
    xy_goal_tolerance: float = 0.1
    yaw_goal_tolerance: float = 0.1
    trans_stopped_vel: float = 0.1
    theta_stopped_vel: float = 0.1
    sim_time: float = 1.7
    sim_granularity: float = 0.025
    angular_sim_granularity: float = 0.1
    path_distance_bias: float = 0.6
    goal_distance_bias: float = 0.8
    occdist_scale: float = 0.01
    twirling_scale: float = 0.0
    stop_time_buffer: float = 0.2
    oscillation_reset_dist: float = 0.05
    oscillation_reset_angle: float = 0.2
    forward_point_distance: float = 0.325
    scaling_speed: float = 0.25
    max_scaling_factor: float = 0.2
    vx_samples: int = 3
    vy_samples: int = 10
    vth_samples: int = 20
    use_dwa: bool = True
    latch_xy_goal_tolerance: bool = False
    sum_scores: bool = False
    publish_cost_grid_pc: bool = False
    publish_traj_pc: bool = False
    global_frame_id: str = 'odom'
    cheat_factor: float = 1.0
    controller_frequency: float = 20.0
    odom_topic: str = 'odom'

    LIMITS: ClassVar[dict] = {
        'max_vel_trans': (-1.0, 20.0),
        'min_vel_trans': (-1.0, 20.0),
        'max_vel_x': (0.0, 20.0, True),
        'min_vel_x': (-20.0, 20.0),
        'max_vel_theta': (0.0, 20.0, True),
        'min_vel_theta': (-1.0, 20.0),
        'acc_lim_x': (0.01, 20.0),
        'acc_lim_y': (0.0, 20.0),
        'acc_lim_theta': (0.01, 20.0),
        'acc_lim_trans': (0.0, 20.0),
        'xy_goal_tolerance': (0.0, 10.0, True),
        'yaw_goal_tolerance': (0.0, math.pi, True),
        'trans_stopped_vel': (0.0, 10.0, True),
        'theta_stopped_vel': (0.0, 10.0, True),
        'sim_time': (0.0, 10.0, True),
        'sim_granularity': (0.001, 5.0),
        'angular_sim_granularity': (0.001, math.pi),
        'path_distance_bias': (0.0, 1000.0),
        'goal_distance_bias': (0.0, 1000.0),
        'occdist_scale': (0.0, 1000.0),
        'twirling_scale': (0.0, 1000.0),
        'stop_time_buffer': (0.0, 10.0),
        'oscillation_reset_dist': (0.0, 10.0),
        'oscillation_reset_angle': (0.0, 2.0 * math.pi),
        'forward_point_distance': (-10.0, 10.0),
        'scaling_speed': (0.0, 20.0),
        'max_scaling_factor': (0.0, 10.0),
        'vx_samples': (1, 300),
        'vy_samples': (0, 300),
        'vth_samples': (1, 300),
        'cheat_factor': (0.0, 1000.0),
        'controller_frequency': (0.0, 1000.0, True),
    }
    """Limits of the numbers: (low, high, whether low itself is excluded)."""
    FIXED: ClassVar[tuple] = (
        'latch_xy_goal_tolerance',
        'sum_scores',
        'publish_cost_grid_pc',
        'publish_traj_pc',
        'global_frame_id',
        'cheat_factor',
        'controller_frequency',
        'odom_topic',
    )
    """What the peer does not let dynamic_reconfigure change."""
    WITHOUT_EFFECT: ClassVar[dict] = {
        'stop_time_buffer': 'a trajectory that touches something within sim_time is discarded, however late',
        'acc_lim_trans': 'acc_lim_x is the limit of a robot that moves along x alone',
    }
    """What is taken but changes nothing, here as in the peer, and why; a name ending in / is a group."""

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = range_faults(self, self.LIMITS)
        for name in ('max_vel_y', 'min_vel_y'):
            if getattr(self, name) != 0.0:
                result.append(
                    f'{name} is {getattr(self, name)!r}, allowed is 0: this planner drives robots with differential '
                    'drive, which cannot '
                    'move sideways'
                )
        for low, high in (('min_vel_x', 'max_vel_x'), ('min_vel_theta', 'max_vel_theta')):
            if getattr(self, low) > getattr(self, high):
                result.append(
                    f'{low} is {getattr(self, low)!r}, allowed is no more than {high} ({getattr(self, high)!r})'
                )
        if 0.0 <= self.max_vel_trans < max(self.min_vel_trans, 1e-3):
            result.append(
                f'max_vel_trans is {self.max_vel_trans!r}, allowed is at least min_vel_trans '
                f'({self.min_vel_trans!r}), or negative for no limit'
            )
        return result
