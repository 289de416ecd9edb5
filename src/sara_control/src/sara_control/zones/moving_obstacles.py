"""Whether what a range sensor hears comes nearer by itself: somebody who walks towards the chair, told from walls that
the chair drives towards.

The distance to what stands shrinks no faster than the sensor itself moves, plus, while the chair turns, than the edge
of the cone sweeps along a wall that
sends an echo back: |w| d tan(30 degrees) at distance d. What shrinks faster than that, twice in a row and no faster
than anybody runs, moves by itself; a wall that comes into the cone makes one jump, not two steps of a walk. Where the
chair's own motion brings nothing into the cone (it stands, or drives straight towards where the sensor looks) a jump
near by is somebody who stepped in. Readings are best given raw: a median tells of them one reading late. What a
sensor's own scatter may look like is nobody: how much it scatters is heard in its readings, and one that scatters by
decimetres tells of nobody.
"""

import math
from collections import deque

READINGS = 3  # in a row that have to agree
STEEPEST = math.tan(math.radians(30.0))  # of the walls that a turning cone sweeps along; steeper ones send little back
LATE = 0.8  # s that a reading may lag behind what the chair does: the median of three, the wheels
LONGEST_GAP = 0.65  # s between two readings that are compared: one of 0.2 s may be lost, and another have no echo
NEAR = 0.9  # m: what is nearer than this is met at its first step already, if that is one of so many m/s
STEP = 0.35, 1.3
ALERT_NEAR = 1.5  # m: where people are about already, a first step is enough from here on,
ALERT_STEP = 0.2, 2.5  # m/s, of one of so many, turning or not
PAUSE = 0.45  # s, for as long as it takes to hear whether there is a second
HOLD = 0.8  # s that somebody is reckoned with after the last such reading; longer ones hold the chair for walls, too
# m nearer than both readings before: somebody who stepped in front of a sensor into whose cone the chair's motion
# brings nothing,
JUMP = 0.3
JUMP_NEAR = 1.2  # m, if nearer than this
NOTHING = 3  # readings without an echo in a row that then count as two of nothing: one or two are lost at times
STILL = 0.02, 0.1  # m/s, rad/s: the chair's motion that brings nothing into a side cone; into any cone
STEPPING = 0.8  # m/s that they are taken to come with
SURE = 3.0  # standard deviations of the sensor's own scatter that a step or a jump must exceed
RECENT = (
    11  # scatters that the standard deviation is estimated of; their median, so that what is no scatter hardly counts
)
REMEMBERED = 16  # readings that what a Mover knows depends on, at most
FINEST = 0.01  # m: no sensor is taken for better than this
COARSE = 0.05  # m: one that scatters more than this cannot tell of anybody's first step


class Scatter:
    """How much the readings of one sensor scatter about straight lines in time: robustly, of how far each lies off the
    line between its neighbours.

    sigma: their standard deviation (m), FINEST at least.
    """

    def __init__(self):
        self._three = deque(maxlen=3)
        self._off = deque(maxlen=RECENT)
        self.sigma = FINEST

    def add(self, stamp, distance):
        """A reading (m, finite) at stamp (s)."""
        if self._three and not 0.0 < stamp - self._three[-1][0] <= LONGEST_GAP:
            self._three.clear()
        self._three.append((stamp, distance))
        if len(self._three) == 3:
            (first, a), (middle, b), (last, c) = self._three
            share = (middle - first) / (last - first)
            self._off.append(abs(b - a - share * (c - a)) / math.sqrt(1.0 + share**2 + (1.0 - share) ** 2))
            if len(self._off) >= RECENT // 2:
                self.sigma = max(
                    sorted(self._off)[len(self._off) // 2] / 0.6745, FINEST
                )  # the median of a normal distribution's size


class Mover:
    """The mover that one sensor hears. sensor: has x, y (m), yaw (rad). half_angle: of its cone, rad. slowest, fastest:
    m/s by itself that count.
    """

    def __init__(self, sensor, half_angle, slowest=0.25, fastest=2.5):
        self._sensor = sensor
        self._half_angle = half_angle
        self._axis = math.cos(sensor.yaw), math.sin(sensor.yaw)
        self._slowest, self._fastest = slowest, fastest
        self._last = None
        self._moved = deque()  # (stamp, m/s the chair itself came nearer, |w|) of the last LATE seconds
        self._excess = deque(maxlen=READINGS - 1)
        self._steps = deque(maxlen=READINGS - 1)
        self._scatter = Scatter()
        self._before = deque(maxlen=2)
        self._nothing = 0  # readings without an echo in a row
        self._speeds = deque(maxlen=4)
        self._speed, self._until = 0.0, -math.inf
        self._heard, self._sure = -math.inf, -math.inf

    def add(self, stamp, distance, v, w, alert=False):
        """A reading (m, +-Inf as in REP-117) at stamp (s), while the chair moved at v (m/s), w (rad/s). Returns the
        mover's speed, m/s, 0 if nothing moves.
        """
        if self._moved and stamp <= self._moved[-1][0]:  # the clock was set back
            self._forget()
            self._moved.clear()
            self._until = self._sure = -math.inf
        self._heard = stamp
        self._moved.append((stamp, *self._own(v, w)))
        self._speeds.append(v)
        while self._moved[0][0] < stamp - LATE:
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

    def speed(self, now):
        """m/s towards the sensor, 0 if nothing moves or has not for a while."""
        return self._speed if now <= self._until else 0.0

    def trusted(self, now):
        """Whether readings have come in the last second, and do not scatter so that they tell of nobody."""
        return 0.0 <= now - self._heard <= 1.0 and not self.coarse

    @property
    def coarse(self):
        """Whether readings scatter so that they tell of nobody."""
        return self._scatter.sigma > COARSE

    @property
    def sigma(self):
        """Standard deviation (m) of the sensor's own scatter."""
        return self._scatter.sigma

    def sure(self, now):
        """Whether the newest reading, at `now`, made it sure that somebody comes: two steps in a row."""
        return self._sure == now

    def _forget(self):
        self._last = None
        self._excess.clear()
        self._steps.clear()
        self._before.clear()

    def _own(self, v, w):
        """(m/s by which the chair's motion brings what stands nearer at most, |w|): by the cone's direction that the
        sensor moves in most.
        """
        vx, vy = v - w * self._sensor.y, w * self._sensor.x
        size = math.hypot(vx, vy)
        if size == 0.0:
            return 0.0, 0.0
        along = vx * self._axis[0] + vy * self._axis[1]
        off = max(math.acos(max(-1.0, min(1.0, along / size))) - self._half_angle, 0.0)
        return size * max(math.cos(off), 0.0), abs(w)

    def _compare(self, stamp, distance, alert):
        before, farther = self._last
        own = max(own for _, own, _ in self._moved)
        turning = max(turn for _, _, turn in self._moved)
        self._excess.append((farther - distance) / (stamp - before) - own - turning * farther * STEEPEST)
        self._steps.append(self._excess[-1] * (stamp - before))
        chance = SURE * math.sqrt(2.0) * self._scatter.sigma  # m by which two readings may differ all the same
        if (
            len(self._excess) == READINGS - 1
            and sum(self._steps) > chance
            and all(self._slowest <= excess <= self._fastest for excess in self._excess)
        ):
            self._speed = sum(self._excess) / len(self._excess)
            self._until, self._sure = stamp + HOLD, stamp
        elif stamp > self._until and self._stepped_in(distance, max(JUMP, chance)):
            self._speed, self._until = STEPPING, stamp + PAUSE
        elif (
            stamp > self._until
            and self._steps[-1] > chance
            and (
                ALERT_STEP[0] <= self._excess[-1] <= ALERT_STEP[1] and distance < ALERT_NEAR
                if alert
                else distance < NEAR and STEP[0] <= self._excess[-1] <= STEP[1] and turning <= STILL[1]
            )
        ):
            self._speed, self._until = self._excess[-1], stamp + PAUSE

    def _stepped_in(self, distance, jump):
        """Whether something is heard near that was not there before, and that the chair's motion has not brought into
        the cone.
        """
        if not (distance < JUMP_NEAR and len(self._before) == 2 and min(self._before) > distance + jump):
            return False
        if max(turn for _, _, turn in self._moved) > STILL[1]:
            return False
        along = math.cos(self._sensor.yaw)  # driving towards where it looks, things leave the cone
        return all(v * along >= 0.0 if abs(along) > 0.7 else abs(v) < STILL[0] for v in self._speeds)
