"""The robot's pose and the walls about it, estimated together: an extended Kalman filter whose state is the pose, the
scales of the odometry's turns and ways, and a line for each wall.

A wall is the line n . p = rho with the normal n = (cos theta, sin theta) towards the side it is seen from. A sensor at
s whose cone the normal's foot is in measures

    r = n . s - rho

(J. Leonard, H. Durrant-Whyte, "Directed Sonar Sensing for Mobile Robot Navigation", 1992; J. Tardos, J. Neira,
P. Newman, J. Leonard, "Robust mapping and localization in indoor environments using sonar data", 2002). Walls within a
gate of the direction of a reference, or square to it, are held so by a measurement of their angle. The reference is the
first wall, until clearly more has been seen of walls that are square to another one.
"""

from __future__ import annotations

import math

import numpy as np

from sara_common.planar import compose, wrap
from sara_common.repeatable import cos_sin, times
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.square_walls import square_off

POSE = 5
"""Of the state: x, y, yaw, scale of turns, scale of ways (relative errors)."""
TIGHT = 0.08
"""m that a reading may be off a wall where that wall has not been seen before."""
ALONE = 0.5
"""Times range_sigma_hit: what one reading is off its wall, by which it is told from one of something else. The estimate
trusts it less, for readings that come one after the other share their errors.
"""
BEYOND, FARTHEST = 0.3, 1.5
"""m beyond what was seen of a wall up to which a reading counts as of it, and up to which it does if tight."""
SLANTING = 1.2
"""m that a wall must be long if it is not held square: corners, and two steps of a wall, look like short ones."""
OFF = 0.3, 0.5
"""rad, m that a wall may at most be off the one it is."""
FLIP = np.array([[1.0, -1.0], [-1.0, 1.0]])
"""Makes the covariance of (theta, rho) that of angle and distance, which is minus rho in the robot's frame."""
CHI2 = 9.2
"""Of two degrees of freedom, 99 %."""


class WallFilter:
    """`x`, `P`: the state and its covariance; `spans`: (walls, 2) m, from where to where along its tangent
    (-sin theta, cos theta) a wall has been seen; `square`: (walls,) those that are held square to the one with the
    number `reference`.
    """

    def __init__(self, config: SonarConfig):
        self.config = config
        self.x = np.zeros(POSE)
        self.P = np.diag([0.0, 0.0, 0.0, config.turn_scale_sigma**2, config.way_scale_sigma**2])
        self.spans, self.square, self.reference = np.empty((0, 2)), np.empty(0, bool), 0
        self._others: list[tuple[float, float, float, float]] = []  # theta, rho, from, to: short, and not square

    @property
    def pose(self) -> tuple[float, float, float]:
        """(x, y, yaw), m, rad, from the start on."""
        return tuple(self.x[:3].tolist())

    @property
    def walls(self) -> np.ndarray:
        """(walls, 2): theta, rho."""
        return self.x[POSE:].reshape(-1, 2)

    @property
    def believed(self) -> np.ndarray:
        """(walls,) those that are walls: long ones, and those that are about square to the others."""
        found = self.square | (self._lengths() >= SLANTING)
        found[self.reference : self.reference + 1] = True
        return found

    def _lengths(self):
        return self.spans[:, 1] - self.spans[:, 0]

    def move(self, relation: tuple[float, float, float]) -> None:
        """The robot moved by (x, y, yaw) in its own frame, as the odometry says."""
        c, (dx, dy, turn) = self.config, relation
        way = math.hypot(dx, dy)
        if way == 0.0 and turn == 0.0:
            return
        x, y, yaw, turns, ways = self.x[:POSE]
        heading = yaw + 0.5 * turns * turn
        cosine, sine = math.cos(heading), math.sin(heading)
        ex, ey = cosine * dx - sine * dy, sine * dx + cosine * dy
        F = np.eye(POSE)
        F[0, 2], F[1, 2] = -(1.0 + ways) * ey, (1.0 + ways) * ex
        F[0, 3], F[1, 3], F[2, 3] = 0.5 * turn * F[0, 2], 0.5 * turn * F[1, 2], turn
        F[0, 4], F[1, 4] = ex, ey
        self.x[:3] = x + (1.0 + ways) * ex, y + (1.0 + ways) * ey, yaw + (1.0 + turns) * turn
        P = self.P
        P[:POSE, :] = F @ P[:POSE, :]
        P[:, :POSE] = P[:, :POSE] @ F.T
        plane = c.odom_alpha3 * way + c.odom_alpha4 * abs(turn)
        P[0, 0] += plane
        P[1, 1] += plane
        P[2, 2] += c.odom_alpha1 * abs(turn) + c.odom_alpha2 * way

    def sensor(self, mount: tuple[float, float, float]) -> tuple[float, float, float]:
        """(x, y, yaw) of a sensor that the robot has at a mount (x, y, yaw)."""
        return compose(self.pose, mount)

    def matched(self, mount: tuple[float, float, float], distance: float) -> int:
        """The wall that a reading (m) of a sensor at a mount (x, y, yaw) is of; -1 where there is none."""
        if not len(self.spans):
            return -1
        x, y, axis = self.sensor(mount)
        ahead, along, steep = foot(self.walls, x, y, axis)
        off = distance - ahead
        beyond = np.maximum(self.spans[:, 0] - along, along - self.spans[:, 1])
        near = np.where(beyond < BEYOND, self.config.max_innovation, TIGHT)
        heard = (ahead > 0.0) & (steep <= 0.5 * self.config.field_of_view)
        fits = self.believed & heard & (beyond < FARTHEST) & (np.abs(off) < near)
        best, least = -1, self.config.gate**2
        for wall in np.flatnonzero(fits).tolist():
            at, H = self._jacobian(mount, wall)
            S = H @ times(self.P[np.ix_(at, at)], H) + (ALONE * self.config.range_sigma_hit) ** 2
            if off[wall] ** 2 / S < least:
                best, least = wall, off[wall] ** 2 / S
        return best

    def _jacobian(self, mount, wall):
        """(indices in the state, derivatives of the distance by them)."""
        x, y, _ = self.sensor(mount)
        theta = self.walls[wall, 0]
        c, s = math.cos(theta), math.sin(theta)
        dx, dy = x - self.x[0], y - self.x[1]
        at = np.array([0, 1, 2, POSE + 2 * wall, POSE + 2 * wall + 1])
        return at, np.array([c, s, s * dx - c * dy, c * y - s * x, -1.0])

    def see(self, wall: int, mount: tuple[float, float, float], distance: float) -> None:
        """A reading (m) is of a wall."""
        at, H = self._jacobian(mount, wall)
        x, y, axis = self.sensor(mount)
        ahead, _, _ = foot(self.walls[wall : wall + 1], x, y, axis)
        self._correct(at, H, distance - float(ahead[0]), self.config.range_sigma_hit**2)

    def extend(self, wall: int, mount: tuple[float, float, float]) -> None:
        """The foot of a sensor on a wall has been seen."""
        x, y, axis = self.sensor(mount)
        _, along, _ = foot(self.walls[wall : wall + 1], x, y, axis)
        low, high = self.spans[wall]
        self.spans[wall] = min(low, along[0]), max(high, along[0])

    def _correct(self, at, H, y, R):
        PH = times(self.P[:, at], H)
        S = float(H @ PH[at]) + R
        self.x += PH * (y / S)
        self.P -= np.outer(PH, PH / S)
        self.x[2] = wrap(self.x[2])

    def add(self, wall: tuple[float, float], covariance: np.ndarray, span: tuple[float, float]) -> int:
        """A wall (theta, rho) in the robot's frame, with its covariance (2, 2), seen along its tangent from and to (m):
        its number. It may be one that is known; -1 where it is none.
        """
        x, y, yaw = self.pose
        theta = wrap(wall[0] + yaw)
        c, s = math.cos(theta), math.sin(theta)
        rho = wall[1] + c * x + s * y
        span = np.array(span) + (c * y - s * x)
        known = self._known(theta, rho, covariance, span)
        if known >= 0:
            self.spans[known] = min(span[0], self.spans[known, 0]), max(span[1], self.spans[known, 1])
            self._refer()
            return known
        G = np.array([[0.0, 0.0, 1.0], [c, s, c * y - s * x]])
        J = np.array([[1.0, 0.0], [c * y - s * x, 1.0]])
        size = len(self.x)
        P = np.empty((size + 2, size + 2))
        P[:size, :size] = self.P
        P[size:, :size] = G @ self.P[:3, :]
        P[:size, size:] = P[size:, :size].T
        P[size:, size:] = G @ self.P[:3, :3] @ G.T + J @ covariance @ J.T
        self.x, self.P = np.append(self.x, (theta, rho)), P
        self.spans, self.square = np.vstack((self.spans, span)), np.append(self.square, False)
        newest = len(self.spans) - 1
        self._refer()
        if not self.believed[newest]:
            self._leave_out_newest()
            return -1
        return newest

    def _known(self, theta, rho, covariance, span):
        """Which wall it is by angle, distance and extent; -1 if none. That wall is corrected by it."""
        best, least = None, CHI2
        x, y, _ = self.pose
        ahead = math.cos(theta) * x + math.sin(theta) * y - rho
        for wall, (its_theta, its_rho) in enumerate(self.walls.tolist()):
            c, s = math.cos(its_theta), math.sin(its_theta)
            off = np.array((wrap(theta - its_theta), ahead - (c * x + s * y - its_rho)))
            low, high = self.spans[wall]
            if abs(off[0]) > OFF[0] or abs(off[1]) > OFF[1] or span[0] > high + FARTHEST or span[1] < low - FARTHEST:
                continue
            at = np.array([0, 1, 2, POSE + 2 * wall, POSE + 2 * wall + 1])
            H = np.array([[0.0, 0.0, -1.0, 1.0, 0.0], [c, s, 0.0, c * y - s * x, -1.0]])
            S = H @ self.P[np.ix_(at, at)] @ H.T + covariance * FLIP
            squared = float(off @ np.linalg.solve(S, off))
            if squared < least:
                best, least = (wall, at, H, off, S), squared
        if best is None:
            return -1
        wall, at, H, off, S = best
        PH = self.P[:, at] @ H.T
        K = PH @ np.linalg.inv(S)
        self.x += times(K, off)
        self.P -= K @ PH.T
        self.x[2] = wrap(self.x[2])
        return wall

    def _refer(self):
        """Hold the walls that are about square to the reference, which may be another one now. Those that are believed
        are asked again each time, for the heading is known better then, and the newest one; all are by a new reference.
        """
        theta, gate = self.walls[:, 0], self.config.square_gate
        alike = np.abs(square_off(theta - theta[:, None])) <= gate
        most, asked = self._most_seen(alike), self.believed
        asked[-1] = True
        if most != self.reference:
            self.reference = most
            self.square[:], asked[:] = False, True
        for wall in np.flatnonzero(alike[most] & asked & ~self.square).tolist():
            self.square[wall] = wall != most and self._held(wall)

    def _most_seen(self, alike):
        """The reference: another one where SLANTING more has been seen of the walls about square to that. Of one in
        other directions than the reference's the short ones count, too, that were left out: two edges that are square
        to each other by chance may have come first.
        """
        seen = times(alike, self._lengths())
        most = int(np.argmax(seen))
        if seen[most] > seen[self.reference] + SLANTING:
            return most
        theta, gate, others = self.walls[:, 0], self.config.square_gate, np.array(self._others).reshape(-1, 4)
        seen += times(np.abs(square_off(others[:, 0] - theta[:, None])) <= gate, others[:, 3] - others[:, 2])
        most = int(np.argmax(np.where(alike[self.reference], 0.0, seen)))
        return most if seen[most] > seen[self.reference] + SLANTING else self.reference

    def _held(self, number):
        """Whether a wall is about square to the reference, or parallel; then it is held so."""
        c = self.config
        off = float(square_off(self.walls[number, 0] - self.walls[self.reference, 0]))
        at = np.array([POSE + 2 * self.reference, POSE + 2 * number])
        H = np.array([-1.0, 1.0])
        S = float(H @ times(self.P[np.ix_(at, at)], H)) + c.square_sigma**2
        if abs(off) > c.square_gate or off * off > c.gate**2 * S:
            return False
        self._correct(at, H, -off, c.square_sigma**2)
        return True

    def _leave_out_newest(self):
        theta, rho, low, high = *self.walls[-1].tolist(), *self.spans[-1].tolist()
        for k, (angle, distance, start, end) in enumerate(self._others):
            if abs(wrap(theta - angle)) < OFF[0] and abs(rho - distance) < OFF[1] and low < end and high > start:
                self._others[k] = angle, distance, min(low, start), max(high, end)
                break
        else:
            self._others.append((theta, rho, low, high))
        self.x, self.P = self.x[:-2], np.ascontiguousarray(self.P[:-2, :-2])
        self.spans, self.square = self.spans[:-1], self.square[:-1]


def foot(walls: np.ndarray, x: float, y: float, axis: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of walls (n, 2) and a sensor at x, y with its axis (rad): m to the walls, m along their tangents, and rad between
    the axis and the way to the wall.
    """
    c, s = cos_sin(walls[:, 0])
    return c * x + s * y - walls[:, 1], c * y - s * x, np.abs(wrap(axis - walls[:, 0] - math.pi))
