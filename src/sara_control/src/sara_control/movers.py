"""Whether what a range sensor hears comes nearer by itself: somebody who walks towards the chair, told from walls that the chair drives towards.

The distance to what stands shrinks no faster than the sensor itself moves, plus, while the chair turns, than the edge of the cone sweeps along a wall that
sends an echo back: |w| d tan(30 degrees) at distance d. What shrinks faster than that, twice in a row and no faster than anybody runs, moves by
itself; a wall that comes into the cone makes one jump, not two steps of a walk.
"""

import math
from collections import deque

READINGS = 3           # in a row that have to agree
STEEPEST = math.tan(math.radians(30.0))   # of the walls that a turning cone sweeps along; steeper ones send little back
LATE = 0.8             # s that a reading may lag behind what the chair does: the median of three, the wheels
LONGEST_GAP = 0.65     # s between two readings that are compared: one of 0.2 s may be lost, and another have no echo
NEAR = 0.9             # m: what is nearer than this is met at its first step already, if that is one of so many m/s
STEP = 0.35, 1.3
PAUSE = 0.45           # s, for as long as it takes to hear whether there is a second
HOLD = 0.8             # s that somebody is reckoned with after the last such reading


class Mover:
    """The mover that one sensor hears. sensor: has x, y (m), yaw (rad). half_angle: of its cone, rad. slowest, fastest: m/s by itself that count."""

    def __init__(self, sensor, half_angle, slowest=0.25, fastest=2.5):
        self._sensor = sensor
        self._half_angle = half_angle
        self._axis = math.cos(sensor.yaw), math.sin(sensor.yaw)
        self._slowest, self._fastest = slowest, fastest
        self._last = None
        self._moved = deque()   # (stamp, m/s the chair itself came nearer, |w|) of the last LATE seconds
        self._excess = deque(maxlen=READINGS - 1)
        self._speed, self._until = 0.0, -math.inf

    def add(self, stamp, distance, v, w):
        """A reading (m, +-Inf as in REP-117) at stamp (s), while the chair moved at v (m/s), w (rad/s). Returns the mover's speed, m/s, 0 if nothing moves."""
        if self._moved and stamp <= self._moved[-1][0]:   # the clock was set back
            self._forget()
            self._moved.clear()
            self._until = -math.inf
        self._moved.append((stamp, *self._own(v, w)))
        while self._moved[0][0] < stamp - LATE:
            self._moved.popleft()
        if math.isfinite(distance):
            if self._last is not None and stamp - self._last[0] > LONGEST_GAP:
                self._forget()
            if self._last is not None:
                self._compare(stamp, distance)
            self._last = stamp, distance
        return self.speed(stamp)

    def speed(self, now):
        """m/s towards the sensor, 0 if nothing moves or has not for a while."""
        return self._speed if now <= self._until else 0.0

    def _forget(self):
        self._last = None
        self._excess.clear()

    def _own(self, v, w):
        """(m/s by which the chair's motion brings what stands nearer at most, |w|): by the cone's direction that the sensor moves in most."""
        vx, vy = v - w * self._sensor.y, w * self._sensor.x
        size = math.hypot(vx, vy)
        if size == 0.0:
            return 0.0, 0.0
        along = vx * self._axis[0] + vy * self._axis[1]
        off = max(math.acos(max(-1.0, min(1.0, along / size))) - self._half_angle, 0.0)
        return size * max(math.cos(off), 0.0), abs(w)

    def _compare(self, stamp, distance):
        before, farther = self._last
        own = max(own for _, own, _ in self._moved)
        turning = max(turn for _, _, turn in self._moved)
        self._excess.append((farther - distance) / (stamp - before) - own - turning * farther * STEEPEST)
        if len(self._excess) == READINGS - 1 and all(self._slowest <= excess <= self._fastest for excess in self._excess):
            self._speed = sum(self._excess) / len(self._excess)
            self._until = stamp + HOLD
        elif distance < NEAR and STEP[0] <= self._excess[-1] <= STEP[1] and stamp > self._until:
            self._speed, self._until = self._excess[-1], stamp + PAUSE
