"""What RotateThenPursue is configured with: limits of a ride, tolerances of a goal, how it keeps to its path and from
obstacles.
"""

import math
from dataclasses import dataclass, fields

from sara_common.config import range_faults


@dataclass(frozen=True)
class RotateThenPursueConfig:
    """Limits and tolerances, SI units; where the name is the peers', so is the meaning."""

    max_vel_x: float = 0.5
    min_vel_x: float = -0.2
    max_vel_theta: float = 0.6
    acc_lim_x: float = 0.3
    dec_lim_x: float = 0.8
    comfort_dec_x: float = 0.25
    jerk_lim_x: float = 0.6
    acc_lim_theta: float = 0.5
    comfort_dec_theta: float = 0.4
    jerk_lim_theta: float = 2.0
    max_lateral_acc: float = 0.2
    xy_goal_tolerance: float = 0.05
    yaw_goal_tolerance: float = 0.035
    tracking_length: float = 0.25
    tracking_time: float = 0.6
    path_deviation: float = 0.02
    corner_angle: float = 0.5
    turn_first_angle: float = 0.08
    turn_in_place_angle: float = 0.5
    max_path_distance: float = 0.5
    wide_gap: float = 0.35
    narrow_vel: float = 0.1
    ahead_angle: float = 0.7
    ahead_reaction_time: float = 1.35
    ahead_dec: float = 0.8
    ahead_stop_distance: float = 0.15
    drive_latency: float = 0.17
    turn_latency: float = 0.17
    smoother_jerk_x: float = 0.0
    smoother_jerk_theta: float = 0.0
    trans_stopped_vel: float = 0.02
    theta_stopped_vel: float = 0.03
    settle_time: float = 0.25

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = range_faults(self, LIMITS)
        if not result and self.narrow_vel > self.max_vel_x:
            result.append(f'narrow_vel is {self.narrow_vel!r}, allowed is at most max_vel_x ({self.max_vel_x!r})')
        if not result and self.comfort_dec_x > self.dec_lim_x:
            result.append(f'comfort_dec_x is {self.comfort_dec_x!r}, allowed is at most dec_lim_x ({self.dec_lim_x!r})')
        return result


def _limit(name):
    if name == 'min_vel_x':
        return -10.0, -0.02
    if name in (
        'drive_latency',
        'turn_latency',
        'smoother_jerk_x',
        'smoother_jerk_theta',
        'settle_time',
        'path_deviation',
        'ahead_reaction_time',
        'ahead_stop_distance',
        'ahead_angle',
    ):
        return 0.0, 1.3 if name == 'ahead_angle' else 10.0
    return 0.0, math.pi if name.endswith('_angle') else 10.0, True


LIMITS = {field.name: _limit(field.name) for field in fields(RotateThenPursueConfig)}
RotateThenPursueConfig.LIMITS = LIMITS
