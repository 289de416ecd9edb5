"""A dead-reckoned pose corrected by what range sensors hear of a known map.

The state is the robot's pose in the map (x, y, yaw) with its covariance; dead reckoning moves it, and its variance
grows with the way and the turning. Each range for which the map predicts one plane or one edge (map_echo.py) is a
scalar measurement of an extended Kalman filter:

    y = z - h(x),  S = H P H' + R,  K = P H' / S,  x <- x + K y,  P <- (I - K H) P (I - K H)' + K R K'

H is the plane's normal, or the direction to the edge, and the lever of the sensor about the robot: what lies along a
wall is not corrected by it.
With `turn_scale_sigma` there is a fourth state, the scale of the dead reckoning's turns. It is constant; each turn
correlates it with the heading, so that ranges correct it, too.
Method: J. Leonard, H. Durrant-Whyte, "Mobile robot localization by tracking geometric beacons", 1991 (validation gate,
normal incidence); S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, ch. 7. What the map does not hold (a
box, a person) fails the gate; what passes it must do so twice running, and what is given out follows the estimate no
faster than a rider can bear.
"""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from sara_common.planar import compose, is_apart, wrap_exact
from sara_localization.ranges import map_echo
from sara_localization.ranges.following import followed, frame_of, lag
from sara_localization.ranges.map_echo import Cone
from sara_localization.ranges.range_config import RangeConfig
from sara_localization.ranges.range_data import RangeData, RangeMap, turned_back
from sara_localization.ranges.trail import Trail
from sara_localization.ranges.turn_scale import MOST, TurnScale

FAULTS = ('bad_range', 'bad_pose', 'bad_frame', 'no_pose', 'no_map', 'stepped', 'jumped')
"""What becomes of data that are faulty or come too early or late; all else is what the surroundings are like."""
LONGEST_GAP, LONGEST_STEP = 3.0, 0.1
"""s without dead reckoning after which only a robot that has stood is where it was; s for which what is given out goes
on to follow the estimate meanwhile.
"""
JUMP_M, JUMP_RAD = 0.05, 0.05
"""By which a step of the dead reckoning may be longer than the robot is fast: a filter corrects itself."""
STEP_S = 0.4
"""A step no longer than what the robot drives in so many s is the dead reckoning's own, whose filter has found that the
robot stands, say; a longer one was put there by somebody.
"""
SURE_SCALE = 0.001
"""Standard deviation of that scale below which it does not fall: readings of the same wall err together."""


class RangeCorrection:
    """`offset`: (x, y, yaw) of the dead reckoning's frame in the map as it is given out; `laid`: whether somebody has
    laid that frame in the map, who can do so again, and it was not found by a search; `counts`: Counter of what became
    of the readings; `scale`: turns of the robot over those of the dead reckoning, as learned so far.
    """

    def __init__(self, config: RangeConfig, map_: RangeMap | None = None, turn_scale: TurnScale | None = None):
        """turn_scale: what is known of it from before; else 1, give or take the configuration's turn_scale_sigma."""
        map_echo.warm()
        self.config, self.map = config, map_
        self.counts = Counter()
        self.scale, sigma = turn_scale or TurnScale(1.0, config.turn_scale_sigma)
        self._P = np.diag([0.0, 0.0, 0.0, sigma**2])
        self.forget()

    def forget(self) -> None:
        """As at the start: the dead reckoning is believed, within the initial variances; the scale of turns stays."""
        c = self.config
        self.offset, self._wanted, self.laid = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), True
        self._P = np.diag([c.initial_cov_xx, c.initial_cov_yy, c.initial_cov_aa, self._P[3, 3]])
        self._trail = Trail()
        self._passed, self._used = {}, {}

    def start_at(self, pose: tuple[float, float, float], covariance: np.ndarray) -> None:
        """The robot is at (x, y, yaw) in the map now, with a covariance (3, 3): given out at once. There must have been
        dead reckoning.
        """
        self.offset = self._wanted = frame_of(pose, self.dead_reckoned)
        self.laid = False
        self._P[:3, :] = self._P[:, :3] = 0.0
        self._P[:3, :3] = covariance
        self._passed, self._used = {}, {}

    @property
    def P(self) -> np.ndarray:
        """(3, 3): the covariance of the pose estimated."""
        return self._P[:3, :3]

    @property
    def P_given_out(self) -> np.ndarray:
        """(3, 3): the covariance of the pose that is given out: what it is off the estimate that it follows counts."""
        here = self.dead_reckoned
        if self.offset == self._wanted or here is None:
            return self.P
        off = lag(self.offset, self._wanted, here)
        return self.P + np.outer(off, off)

    @property
    def turn_scale(self) -> TurnScale:
        """`scale` and its standard deviation, 0 where it is not learned."""
        return TurnScale(self.scale, math.sqrt(self._P[3, 3]))

    @property
    def pose(self) -> tuple[float, float, float] | None:
        """The pose estimated, (x, y, yaw) in the map; None before there is any."""
        here = self.dead_reckoned
        return None if here is None else compose(self._wanted, here)

    @property
    def dead_reckoned(self) -> tuple[float, float, float] | None:
        """The newest (x, y, yaw) by dead reckoning; None before there is any."""
        return None if self._trail.newest is None else self._trail.newest[1]

    @property
    def sigma(self) -> tuple[float, float]:
        """Standard deviations of the estimate: (the greatest in the plane, m; yaw, rad)."""
        (a, b), (_, d) = self.P[:2, :2].tolist()
        return math.sqrt(0.5 * (a + d) + math.hypot(0.5 * (a - d), b)), math.sqrt(self.P[2, 2])

    # Dead reckoning

    def on_pose(self, stamp: float, pose: tuple[float, float, float]) -> str:
        """The dead reckoning has the robot at (x, y, yaw) at a time (s). One that jumps was put there, and is believed
        anew; where its frame was never laid in the map, the robot is taken to be where it was. A step (STEP_S) is a way
        as uncertain as it is long. Returns 'jumped', 'stepped' or ''.
        """
        if not (math.isfinite(stamp) and all(map(math.isfinite, pose))):
            self.counts['bad_pose'] += 1
            return ''
        what, newest = '', self._trail.newest
        if newest is not None:
            last, before = newest
            dt, way, turned = stamp - last, math.dist(pose[:2], before[:2]), wrap_exact(pose[2] - before[2])
            if dt <= 0.0 and dt > -1.0:
                return ''
            driven = dt if dt <= LONGEST_GAP else 0.0
            if dt < 0.0 or not self._within(driven, way, turned):
                what = self._jump(before, pose, way, turned)
            else:
                self._grow(before, pose, way, turned)
        self._trail.add(stamp, pose)
        if newest is not None and not what:
            self._slew(min(stamp - newest[0], LONGEST_STEP))
        return what

    def _within(self, seconds, way, turned):
        """Whether a robot can drive so far (m) and turn so much (rad) in that time, or a filter correct it by that."""
        c = self.config
        return way <= c.max_vel_x * seconds + JUMP_M and abs(turned) <= c.max_vel_theta * seconds + JUMP_RAD

    def _jump(self, before, pose, way, turned):
        """The dead reckoning went from `before` to a pose at once, or its clock was set back. Returns what that was."""
        what = 'stepped' if self._within(STEP_S, way, turned) else 'jumped'
        self.counts[what] += 1
        if self.laid and what == 'jumped':
            self.forget()
            return what
        if what == 'stepped':
            self._grow(before, pose, way, turned)
            self._P[:3, :3] += np.diag([way**2, way**2, turned**2])
        else:
            self.offset = frame_of(compose(self.offset, before), pose)
            self._wanted = frame_of(compose(self._wanted, before), pose)
        self._trail.clear()
        self._passed, self._used = {}, {}
        return what

    def _grow(self, before, pose, way, turned):
        c, turn = self.config, abs(turned)
        yaw = self._wanted[2]
        dx, dy = pose[0] - before[0], pose[1] - before[1]
        dx, dy = math.cos(yaw) * dx - math.sin(yaw) * dy, math.sin(yaw) * dx + math.cos(yaw) * dy
        if way == 0.0 and turn == 0.0:
            return
        if self.scale != 1.0:
            x, y, yaw = compose(self._wanted, pose)
            self._wanted = frame_of((x, y, wrap_exact(yaw + (self.scale - 1.0) * turned)), pose)
        F = np.eye(4)
        F[0, 2], F[1, 2], F[2, 3] = -dy, dx, turned
        P = F @ self._P @ F.T
        plane = c.odom_alpha3 * way + c.odom_alpha4 * turn
        P[0, 0] += plane
        P[1, 1] += plane
        P[2, 2] += c.odom_alpha1 * turn + c.odom_alpha2 * way
        self._P = P

    def _slew(self, dt):
        """Let what is given out follow the estimate: the robot's own place by so many m, its heading by so many rad per
        second.
        """
        if self.offset != self._wanted:
            c = self.config
            most = c.max_correction_rate * dt, c.max_correction_turn_rate * dt
            self.offset = followed(self.offset, self._wanted, self.dead_reckoned, most)

    # Ranges

    def on_range(self, reading: RangeData) -> str:
        """Take a reading; returns what became of it: 'used', or why not (`counts` has all of these)."""
        what = self._take(reading)
        self.counts[what] += 1
        return what

    def _take(self, r):
        c = self.config
        fault = self.fault(r)
        if fault:
            return fault
        here = self.at(r.stamp - c.range_delay)
        if here is None:
            return 'waiting' if self.is_young(r.stamp - c.range_delay) else 'no_pose'
        passed, self._passed[r.name] = self._passed.get(r.name), None
        if not max(c.range_min_range, r.least) <= r.range <= min(c.range_max_range, r.most):
            return 'out_of_span'
        found = self._predicted(r, here)
        if isinstance(found, str):
            return found
        distance, H, sigma = found
        y, S = r.range - distance, float(H @ self.P @ H) + sigma**2
        if y * y > c.gate**2 * S or abs(y) > c.max_innovation:
            return 'shorter' if y < 0.0 else 'longer'
        self._passed[r.name] = r.stamp, y
        if passed is None or r.stamp - passed[0] > c.twice_within or abs(passed[1] - y) > c.gate * sigma:
            return 'first'
        last = self._used.get(r.name)
        if last is not None and not is_apart(last, here, c.update_min_d, c.update_min_a):
            return 'same_place'
        self._used[r.name] = here
        self._correct(H, y, sigma, S)
        return 'used'

    def fault(self, r: RangeData) -> str:
        """Why a reading cannot be used wherever the robot is, as on_range has it; '' where it can."""
        if not (
            math.isfinite(r.stamp)
            and not math.isnan(r.range)
            and 0.0 < r.field_of_view <= math.pi
            and all(map(math.isfinite, r.mount))
        ):
            return 'bad_range'
        return 'no_map' if self.map is None else ''

    def is_young(self, stamp: float) -> bool:
        """Whether a time (s) is not remembered because the dead reckoning has not gone on for long."""
        return self._trail.is_young(stamp)

    def at(self, stamp: float) -> tuple[float, float, float] | None:
        """The dead-reckoned pose (x, y, yaw) at a time (s), None where that is not remembered."""
        return self._trail.at(stamp, self.config.transform_tolerance)

    def sensor_in_grid(
        self, here: tuple[float, float, float], mount: tuple[float, float, float]
    ) -> tuple[float, float, float]:
        """A sensor of the robot by the estimate, as x, y, yaw from the corner of the map's grid.

        here: the dead-reckoned pose then. mount: the sensor in the robot.
        """
        return self.map.in_grid(compose(compose(self._wanted, here), mount))

    def _predicted(self, r, here):
        """(distance, H (3,), standard deviation of the reading) by the map, in its frame; or why there is none."""
        c, m = self.config, self.map
        base, sensor = m.in_grid(self.pose), self.sensor_in_grid(here, r.mount)
        back = m.back
        # Half axes of the uncertainty, turned into the grid's frame.
        L = np.linalg.cholesky(self.P + 1e-12 * np.eye(3))
        axes = np.empty((3, 3))
        for k in range(3):
            dx, dy = turned_back(L[0, k], L[1, k], back)
            axes[k] = c.sigmas * dx, c.sigmas * dy, c.sigmas * L[2, k]
        cone = Cone(0.5 * r.field_of_view, c.range_max_range + c.max_innovation, c.plane_tolerance)
        what, distance, hx, hy, hyaw = map_echo.predict(m.cells, m.resolution, base[:2], sensor, cone, axes)
        sigma = {map_echo.PLANE: c.range_sigma_hit, map_echo.EDGE: c.range_sigma_edge}.get(what, 0.0)
        if sigma == 0.0:
            return 'not_predicted' if what == map_echo.SILENT else 'ambiguous'
        return distance, np.array([back[0] * hx - back[1] * hy, back[1] * hx + back[0] * hy, hyaw]), sigma

    def _correct(self, H, y, sigma, S):
        H = np.append(H, 0.0)
        K = self._P @ H / S
        G = np.eye(4) - np.outer(K, H)
        P = G @ self._P @ G.T + sigma**2 * np.outer(K, K)
        self._P = 0.5 * (P + P.T)
        if self.config.turn_scale_sigma > 0.0:
            self._P[3, 3] = max(self._P[3, 3], SURE_SCALE**2)
            self.scale = min(max(self.scale + float(K[3]) * y, 1.0 - MOST), 1.0 + MOST)
        here = self.dead_reckoned
        x, y_, yaw = compose(self._wanted, here)
        moved = K * y
        self._wanted = frame_of((x + float(moved[0]), y_ + float(moved[1]), wrap_exact(yaw + float(moved[2]))), here)
