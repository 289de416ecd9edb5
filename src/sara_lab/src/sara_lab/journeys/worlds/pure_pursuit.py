"""sara_lab/PurePursuit: the textbook's local planner, to compare others with.

Pure pursuit (R. C. Coulter, "Implementation of the Pure Pursuit Path Tracking Algorithm", CMU-RI-TR-92-01, 1992): the
arc to the point of the path one lookahead L away, which lies at the angle a to the heading, has the curvature
2 sin(a) / L. Where a is large, the chair stops and turns in place first; at the goal it turns to the goal's heading. It
slows before the goal, sees no obstacles, and leaves the rest to the path: here of A* on the inflated map.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sara_common.config import range_faults
from sara_common.planar import Pose2D, wrap
from sara_nav.grids.collision import LocalWorld
from sara_nav.planners.local_command import LOCAL_PLANNERS, OFF_PATH, REACHED, LocalCommand
from sara_nav.planners.planning import distances_along

AHEAD_M = 1.5  # m of the path that the nearest point may be further on than the last one
TURN_GAIN = 1.0  # 1/s: turn rate in place over the angle that is left
STILL = 0.02  # m/s


@dataclass(frozen=True)
class PurePursuitConfig:
    """`lookahead`, m. `max_vel_x`, m/s. `max_vel_theta`, `min_in_place_vel_theta`, rad/s. `acc_lim_x`, m/s2: braking
    before the goal. `turn_angle`, rad: from there on it turns in place, until it is below a quarter of that.
    `xy_goal_tolerance`, m, `yaw_goal_tolerance`, rad. `max_path_distance`, m: farther off, it is planned anew.
    """

    lookahead: float = 0.4
    max_vel_x: float = 0.4
    max_vel_theta: float = 0.6
    min_in_place_vel_theta: float = 0.15
    acc_lim_x: float = 0.4
    turn_angle: float = 0.8
    xy_goal_tolerance: float = 0.10
    yaw_goal_tolerance: float = 0.05
    max_path_distance: float = 0.5

    def faults(self) -> list[str]:
        """A list of sentences, one for each bad value."""
        return range_faults(
            self,
            {
                'lookahead': (0.05, 5.0),
                'max_vel_x': (0.01, 2.0),
                'max_vel_theta': (0.01, 4.0),
                'min_in_place_vel_theta': (0.0, 4.0),
                'acc_lim_x': (0.01, 5.0),
                'turn_angle': (0.05, math.pi),
                'xy_goal_tolerance': (0.01, 1.0),
                'yaw_goal_tolerance': (0.01, math.pi),
                'max_path_distance': (0.05, 5.0),
            },
        )


@LOCAL_PLANNERS.register('sara_lab/PurePursuit')
class PurePursuit:
    """Drives a plan; see the module. One object drives one goal after the other."""

    config_class = PurePursuitConfig

    def __init__(self, config: PurePursuitConfig = PurePursuitConfig()) -> None:
        self.config = config
        self.goal: Pose2D | None = None
        self._plan = np.empty((0, 3))
        self._along = np.empty(0)
        self._nearest = 0
        self._arrived = self._turning = False

    @property
    def phase(self) -> str:
        """follow path, turn to path, or turn to goal."""
        return 'turn to goal' if self._arrived else 'turn to path' if self._turning else 'follow path'

    def start(self, plan: np.ndarray) -> None:
        """Begin a new goal: plan (n, 3) in the global frame, its last row the goal."""
        self._arrived = False
        self.replan(plan)

    def replan(self, plan: np.ndarray) -> None:
        """Take another plan to the same goal."""
        self._plan = np.asarray(plan, float).reshape(-1, 3)
        self._along = distances_along(self._plan)
        self.goal = Pose2D(*(float(value) for value in self._plan[-1]))
        self._nearest, self._turning = 0, False

    def stop(self) -> None:
        """Nothing of the last command is kept."""

    def update(
        self, _t: float, _dt: float, pose: Pose2D, velocity: tuple[float, float], pose_age: float, _world: LocalWorld
    ) -> LocalCommand:
        """The LocalCommand for the pose that the robot has by now, at its measured velocity (m/s, rad/s)."""
        now = pose.advance(velocity[0], velocity[1], pose_age)
        left = math.hypot(self.goal.x - now.x, self.goal.y - now.y)
        self._arrived |= left <= self.config.xy_goal_tolerance
        if self._arrived:
            return self._turn_to_goal(now, velocity)
        if self._off_path(now):
            return LocalCommand(0.0, 0.0, OFF_PATH, 'the plan is too far away')
        x, y = self._ahead(now)
        angle = wrap(math.atan2(y - now.y, x - now.x) - now.yaw)
        self._turning = abs(angle) > self.config.turn_angle * (0.25 if self._turning else 1.0)
        if self._turning:
            return LocalCommand(0.0, 0.0 if abs(velocity[0]) > STILL else self._rate(angle))
        speed = min(self.config.max_vel_x, max(0.05, math.sqrt(2.0 * self.config.acc_lim_x * left)))
        rate = 2.0 * speed * math.sin(angle) / max(math.hypot(x - now.x, y - now.y), 0.1)
        share = min(1.0, self.config.max_vel_theta / max(abs(rate), 1e-9))
        return LocalCommand(share * speed, share * rate)

    def _turn_to_goal(self, now, velocity):
        off = wrap(self.goal.yaw - now.yaw)
        if abs(velocity[0]) > STILL:
            return LocalCommand(0.0, 0.0)
        if abs(off) <= self.config.yaw_goal_tolerance:
            return LocalCommand(0.0, 0.0, REACHED)
        return LocalCommand(0.0, self._rate(off))

    def _rate(self, angle):
        """Turn rate in place (rad/s) for an angle that is left."""
        c = self.config
        return math.copysign(min(max(TURN_GAIN * abs(angle), c.min_in_place_vel_theta), c.max_vel_theta), angle)

    def _off_path(self, now):
        """Find the nearest point of the path; whether it is too far away."""
        last = int(np.searchsorted(self._along, self._along[self._nearest] + AHEAD_M)) + 1
        off = np.hypot(*(self._plan[self._nearest : last, :2] - (now.x, now.y)).T)
        self._nearest += int(off.argmin())
        return float(off.min()) > self.config.max_path_distance

    def _ahead(self, now):
        """The first point after the nearest that is one lookahead away, the goal where there is none."""
        away = np.hypot(*(self._plan[self._nearest :, :2] - (now.x, now.y)).T)
        far = np.flatnonzero(away >= self.config.lookahead)
        return self._plan[self._nearest + far[0] if len(far) else -1, :2]
