"""Detects in the readings of one range sensor whether a pedestrian approaches, as opposed to a wall that the chair
drives towards.

The distance to a static obstacle shrinks no faster than the sensor itself moves, plus, while the chair turns, the speed
at which the edge of the cone sweeps along a wall that still reflects: |w| d tan(30 degrees) at distance d. A distance
that shrinks faster, twice in a row and no faster than a person runs, belongs to an obstacle that moves by itself; a
wall that comes into the cone makes one jump, not two steps of a walk. Two obstacles may come in one after the other:
where the chair's own motion brings them in, the two steps have to be of one speed. While it brings nothing in (the
chair stands, or drives in the direction of the sensor and hardly turns), a jump or a step close by is a pedestrian.

Raw readings are best: a median shows a pedestrian one reading late. Steps that the sensor's own scatter explains are
ignored; the scatter is estimated from the readings, and a sensor that scatters by decimetres detects nothing.
"""

import math
from collections import deque
from typing import NamedTuple

from sara_control.zones.zone_config import RangeSensor

READINGS = 3  # in a row that have to agree
STEEPEST = math.tan(math.radians(30.0))  # of walls along which a turning cone sweeps; steeper ones reflect little
LATE = 0.8  # s that a reading may lag behind what the chair does: the median of three, the wheels
LONGEST_GAP = 0.65  # s between two readings that are compared: one of 0.2 s may be lost, and another have no echo
NEAR = 0.9  # m: nearer than this one step is enough,
STEP = 0.35, 1.3  # m/s, if it is within this range
ALERT_NEAR = 1.5  # m: while pedestrians are known to be nearby, one step is enough within this distance,
ALERT_STEP = 0.2, 2.5  # m/s, if it is within this range, whether the chair turns or not
PAUSE = 0.45  # s that one step counts: until the next reading confirms it or not
HOLD = 0.8  # s that an approach counts after its last reading; a longer time would stop the chair for walls, too
# m by which a reading is nearer than both before it when a pedestrian steps into the cone
JUMP = 0.3
JUMP_NEAR = 1.2  # m: farther away jumps are ignored
NOTHING = 3  # consecutive readings without an echo that count as free space: one or two are lost at times
STILL = 0.02, 0.03  # m/s, rad/s: slower motion of the chair is none; a turn may be measured so much too slow
SAME = 0.4  # m/s: two steps that differ by more are not of one pedestrian's walk
STEPPING = 0.8  # m/s: assumed speed of a pedestrian who stepped in
CERTAIN = 3.0  # standard deviations of the sensor's scatter that a step or a jump must exceed
RECENT = 11  # deviations of which the standard deviation is estimated, by their median: outliers hardly count
REMEMBERED = 16  # readings on which the state of an ApproachDetector depends, at most
NEAREST = 0.1  # m: obstacles are taken to be no nearer where it is asked how fast they enter the cone
FINEST = 0.01  # m: least standard deviation
COARSE = 0.05  # m: a sensor that scatters more cannot detect a single step


class Scatter:
    """Estimates the noise of one sensor: a robust standard deviation of each reading from the line between its
    neighbours.

    sigma: standard deviation, m, FINEST at least.
    """

    def __init__(self) -> None:
        self._three = deque(maxlen=3)
        self._off = deque(maxlen=RECENT)
        self.sigma = FINEST

    def add(self, stamp: float, distance: float) -> None:
        """Takes a reading (m, finite) at stamp (s)."""
        if self._three and not 0.0 < stamp - self._three[-1][0] <= LONGEST_GAP:
            self._three.clear()
        self._three.append((stamp, distance))
        if len(self._three) == 3:
            (first, a), (middle, b), (last, c) = self._three
            share = (middle - first) / (last - first)
            self._off.append(abs(b - a - share * (c - a)) / math.sqrt(1.0 + share**2 + (1.0 - share) ** 2))
            if len(self._off) >= RECENT // 2:
                # 0.6745: median of the size of a standard normal variable
                self.sigma = max(sorted(self._off)[len(self._off) // 2] / 0.6745, FINEST)


class _Motion(NamedTuple):
    """How the sensor moved at `stamp` (s). nearing: m/s at most at which it brought static obstacles nearer.
    v, turn: the chair's, m/s, rad/s.
    """

    stamp: float
    nearing: float
    v: float
    turn: float


class ApproachDetector:
    """sensor: RangeSensor. half_angle: of its cone, rad. slowest, fastest: range of a pedestrian's own speed, m/s."""

    def __init__(self, sensor: RangeSensor, half_angle: float, slowest: float = 0.25, fastest: float = 2.5) -> None:
        self._sensor = sensor
        self._half_angle = half_angle
        self._axis = math.cos(sensor.yaw), math.sin(sensor.yaw)
        self._slowest, self._fastest = slowest, fastest
        self._last = None
        self._edges = tuple(
            (math.sin(sensor.yaw + side * half_angle), math.cos(sensor.yaw + side * half_angle), side)
            for side in (1.0, -1.0)
        )
        self._moved = deque()  # _Motion of the last LATE seconds
        self._excess = deque(maxlen=READINGS - 1)
        self._steps = deque(maxlen=READINGS - 1)
        self._scatter = Scatter()
        self._before = deque(maxlen=2)
        self._nothing = 0  # readings without an echo in a row
        self._speed, self._until = 0.0, -math.inf
        self._newest, self._confirmed_at = -math.inf, -math.inf

    def add(self, stamp: float, distance: float, v: float, w: float, alert: bool = False) -> float:
        """Takes a reading (m, +-Inf as in REP-117) at stamp (s), while the chair moves at v (m/s), w (rad/s).

        alert: pedestrians are known to be nearby. Returns the obstacle's own speed towards the sensor, m/s, 0 if it
        does not move.
        """
        if self._moved and stamp <= self._moved[-1].stamp:  # the clock was set back
            self._forget()
            self._moved.clear()
            self._until = self._confirmed_at = -math.inf
        self._newest = stamp
        self._moved.append(self._motion(stamp, v, w))
        while self._moved[0].stamp < stamp - LATE:
            self._moved.popleft()
        if math.isfinite(distance):
            if self._last is not None and stamp - self._last[0] > LONGEST_GAP:
                self._forget()
            if alert and self._nothing >= NOTHING:
                self._before.extend((math.inf, math.inf))
            self._scatter.add(stamp, distance)
            if self._last is not None:
                self._compare(stamp, distance, alert)
            elif self._stepped_in(distance, JUMP):
                self._speed, self._until = STEPPING, stamp + PAUSE
            self._last = stamp, distance
            self._before.append(distance)
        self._nothing = self._nothing + 1 if distance == math.inf else 0
        return self.speed(stamp)

    def speed(self, now: float) -> float:
        """The obstacle's own speed towards the sensor at `now`, m/s; 0 if nothing has moved lately."""
        return self._speed if now <= self._until else 0.0

    def trusted(self, now: float) -> bool:
        """Whether readings have come in the last second, and their noise permits a detection."""
        return 0.0 <= now - self._newest <= 1.0 and not self.noisy

    @property
    def noisy(self) -> bool:
        """Whether the readings are too noisy for a detection."""
        return self._scatter.sigma > COARSE

    @property
    def sigma(self) -> float:
        """Standard deviation of the sensor's noise, m."""
        return self._scatter.sigma

    def confirmed(self, now: float) -> bool:
        """Whether the newest reading, at `now`, confirmed an approach: two steps in a row."""
        return self._confirmed_at == now

    def _forget(self):
        self._last = None
        self._excess.clear()
        self._steps.clear()
        self._before.clear()

    def _motion(self, stamp, v, w):
        """The _Motion of the sensor while the chair moves at v (m/s), w (rad/s)."""
        x, y = self._velocity(v, w)
        size = math.hypot(x, y)
        if size == 0.0:
            return _Motion(stamp, 0.0, v, w)
        along = x * self._axis[0] + y * self._axis[1]
        off = max(math.acos(max(-1.0, min(1.0, along / size))) - self._half_angle, 0.0)
        return _Motion(stamp, size * max(math.cos(off), 0.0), v, w)

    def _velocity(self, v, w):
        """(x, y) of the sensor in the base frame, m/s, while the chair moves at v (m/s), w (rad/s)."""
        return v - w * self._sensor.y, w * self._sensor.x

    def _compare(self, stamp, distance, alert):
        before, farther = self._last
        own = max(motion.nearing for motion in self._moved)
        turning = max(abs(motion.turn) for motion in self._moved)
        self._excess.append((farther - distance) / (stamp - before) - own - turning * farther * STEEPEST)
        self._steps.append(self._excess[-1] * (stamp - before))
        chance = CERTAIN * math.sqrt(2.0) * self._scatter.sigma  # m by which noise may make two readings differ
        if (
            len(self._excess) == READINGS - 1
            and sum(self._steps) > chance
            and all(self._slowest <= excess <= self._fastest for excess in self._excess)
            and (max(self._excess) - min(self._excess) <= SAME or not self._brings_in(distance))
        ):
            self._speed = sum(self._excess) / len(self._excess)
            self._until, self._confirmed_at = stamp + HOLD, stamp
        elif stamp > self._until and self._stepped_in(distance, max(JUMP, chance)):
            self._speed, self._until = STEPPING, stamp + PAUSE
        elif (
            stamp > self._until
            and self._steps[-1] > chance
            and (
                ALERT_STEP[0] <= self._excess[-1] <= ALERT_STEP[1] and distance < ALERT_NEAR
                if alert
                else distance < NEAR and STEP[0] <= self._excess[-1] <= STEP[1] and not self._brings_in(distance)
            )
        ):
            self._speed, self._until = self._excess[-1], stamp + PAUSE

    def _stepped_in(self, distance, jump):
        """Whether an obstacle is near that was not there before, and that the chair's motion has not brought into the
        cone.
        """
        return (
            distance < JUMP_NEAR
            and len(self._before) == 2
            and min(self._before) > distance + jump
            and not self._brings_in(distance)
        )

    def _brings_in(self, distance):
        """Whether the chair's own motion of late may have brought static obstacles at this distance (m) in."""
        return any(self._nears_edge(motion, max(distance, NEAREST)) for motion in self._moved)

    def _nears_edge(self, motion, distance):
        """Whether static obstacles at this distance (m) come nearer to the cone by one of its edges.

        Seen from the sensor, one at the bearing a moves by (x sin(a) - y cos(a)) / distance - turn (rad/s), where x, y
        (m/s) is the sensor's velocity. Beside a chair that drives, obstacles of all distances come in.
        """
        v = motion.v if abs(motion.v) >= STILL[0] else 0.0
        turn = motion.turn + math.copysign(STILL[1], motion.turn) if abs(motion.turn) > STILL[1] else 0.0
        if v != 0.0 and self._sensor.side in ('left', 'right'):
            return True
        x, y = self._velocity(v, turn)
        return any(side * ((x * sine - y * cosine) / distance - turn) < 0.0 for sine, cosine, side in self._edges)
