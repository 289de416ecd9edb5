"""What to believe while the sensors that say how the robot moves are silent: that it stands.

A filter predicts with the last speed it knows. Where nothing comes for seconds (a bus that is unplugged) the estimate
runs off with it, although robots stop when they lose their sensors. With `hold_after` the speed is taken for zero when
nobody has measured a speed or a position for so long, and the turn rate likewise. Meanwhile the pose follows the
odometry through the map -> odom that held when all was well: what the wheels have counted unheard is there as soon as
they are heard again; but for an odometry that begins anew, for its node was started again: then the robot has stood.
An extension; robot_localization has nothing of the kind.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from sara_common.planar import wrap_exact
from sara_localization.filters import state_pose
from sara_localization.filters.estimator import Estimator
from sara_localization.filters.state import ACCELERATION, ANGLES, POSITION, RATES, VELOCITY, YAW
from sara_localization.geometry.rigid import Transform

BEGINS, STEP = 0.1, 0.5
"""m and rad from its origin at which an odometry is that has just begun, if it was further from there than STEP."""


class Silence:
    """hold_after: s. inputs: InputConfigs. report: called with a sentence when the odometry begins anew. `moving`,
    `turning`: whether speed or turn rate is held at zero. `fresh`: whether anybody has told of motion since the last
    `anchor`.
    """

    def __init__(self, hold_after, inputs, report: Callable[[str], None] = lambda sentence: None):
        self.hold_after, self._report = hold_after, report
        self._tell_motion = {i.name for i in inputs if any(i.mask[POSITION]) or any(i.mask[VELOCITY])}
        self._tell_turn = {i.name for i in inputs if any(i.mask[ANGLES]) or any(i.mask[RATES])}
        self.forget()

    def forget(self) -> None:
        """As if nothing had ever been heard."""
        self._motion_at = self._turn_at = None
        self.fresh = self.moving = self.turning = False
        self._anchor = None

    @property
    def holding(self) -> bool:
        """Whether anything is held."""
        return self.moving or self.turning

    def heard(self, name: str, stamp: float) -> None:
        """A measurement of input `name` at stamp (s) was taken in; one that came late makes nothing older."""
        if name in self._tell_motion:
            self._motion_at, self.fresh = _later(self._motion_at, stamp), True
        if name in self._tell_turn:
            self._turn_at = _later(self._turn_at, stamp)

    def anchor(self, world_from_odom: Transform) -> None:
        """The transform that was given out; kept where it comes from fresh odometry (without any, there is nothing to
        keep).
        """
        if self.fresh and not self.holding and world_from_odom is not None:
            self._anchor = world_from_odom
        self.fresh = False

    def follow(self, kf: Estimator, odom_from_base: Transform) -> None:
        """Before a tick's measurements: while held, the pose is where the odometry says."""
        if self._anchor is None or odom_from_base is None:
            return
        pose = self._anchor @ odom_from_base
        if _begins_anew(self._anchor.inverse() @ state_pose.pose_of(kf.x), odom_from_base):
            self._anchor = None
            self._report('the odometry begins anew: the robot is taken to have stood meanwhile')
            return
        x = kf.x.copy()
        if self.moving:
            x[POSITION] = pose.translation
        if self.turning:
            x[YAW] = wrap_exact(pose.yaw)
        kf.set_state(x, kf.P.copy())

    def hold(self, kf: Estimator, now: float) -> None:
        """After a tick's measurements: zero what nobody has measured for hold_after. Its covariances with the pose are
        zero with it: else the first speed heard again would push the pose on by the way of the whole silence, which it
        has followed the odometry along already.
        """
        self.moving, self.turning = self._is_silent(self._motion_at, now), self._is_silent(self._turn_at, now)
        if not self.holding:
            return
        held = (
            [*range(VELOCITY.start, VELOCITY.stop), *range(ACCELERATION.start, ACCELERATION.stop)]
            if self.moving
            else []
        ) + ([*range(RATES.start, RATES.stop)] if self.turning else [])
        x, P = kf.x.copy(), kf.P.copy()
        variances = P[held, held]
        x[held] = 0.0
        P[held, :] = P[:, held] = 0.0
        P[held, held] = variances
        kf.set_state(x, P)

    def _is_silent(self, last, now):
        return last is not None and now - last > self.hold_after


def _begins_anew(before, odom_from_base):
    """Whether an odometry that was at a pose before is where it begins."""
    x, y, _ = odom_from_base.translation
    if math.hypot(x, y) > BEGINS or abs(odom_from_base.yaw) > BEGINS:
        return False
    way, turn = math.dist(before.translation[:2], (x, y)), abs(wrap_exact(before.yaw - odom_from_base.yaw))
    return max(way, turn) > STEP


def _later(last, stamp):
    return stamp if last is None else max(last, stamp)
