"""Where the robot will be when a command given now takes effect: the pose that is known moved on by what was commanded
since.

A pose is old when it comes, and the drive answers late. A speed is taken to act ``latency`` seconds after it was
commanded (dead time and lags together), a turn rate ``turn_latency`` seconds, so from a pose of time tp until then the
robot drives what was commanded from tp - latency to now (Smith, Closer control of loops with dead time, 1957). What it
drives differs: it may turn less than it is told to, which is learned from the poses, and something behind may slow it,
which shows in the speed measured.
"""

import math
from collections import deque

from sara_common.planar import Pose2D, advanced, wrap

KEPT = 2.0
"""Seconds of commands that are remembered."""
MEMORY = 8.0
"""Seconds after which what was seen of turns counts 1/e."""
LEAST, MOST = 0.6, 1.15
"""A base turns this share of what it is told to; what is seen outside says something else (that it is being held)."""
SETTLING = 0.3
"""Seconds in which a difference between what is commanded and what is driven is believed."""
FARTHEST_OFF = 0.5
"""More than that (m/s, rad/s) is no difference but a wrong measurement."""


class Prediction:
    """latency, turn_latency: s. ``turn_gain``: turn rate driven over commanded, 1 until turns have been seen."""

    def __init__(self, latency: float, turn_latency: float):
        self.latency, self.turn_latency = latency, turn_latency
        self.turn_gain = 1.0
        self._commands = deque([(-math.inf, 0.0, 0.0)])
        self._seen = self._told = 0.005  # (rad)^2: what is believed before anything was seen
        self._pose = None  # (time, yaw) of the last pose
        self._off_v = self._off_w = 0.0

    def commanded(self, t: float, v: float, w: float) -> None:
        """Take note of a command (m/s, rad/s) given at t (s)."""
        while self._commands and self._commands[-1][0] >= t:
            self._commands.pop()
        if not self._commands or self._commands[-1][1:] != (v, w):
            self._commands.append((t, v, w))
        while len(self._commands) > 2 and self._commands[1][0] < t - KEPT:
            self._commands.popleft()

    def driven(self, v: float) -> float:
        """Return the size (m/s) of the speed that a command of v makes: something behind may slow the robot."""
        return min(abs(v), max(math.copysign(1.0, v) * (v + self._off_v), 0.0))

    def ahead(self, t: float, pose: Pose2D, age: float, speed: float, dt: float) -> Pose2D:
        """Return the Pose2D where a command given at t takes effect, of a pose that was measured ``age`` s before t
        with this speed (m/s); dt: since the last call. That is when a speed does while one is commanded, else when a
        turn rate does.
        """
        measured = t - age
        self._learn(measured, pose.yaw)
        began = self._at(measured - self.latency - 0.05)  # a speed measured is the mean over a while
        self._off_v += min(dt / SETTLING, 1.0) * (speed - began[0] - self._off_v)
        self._off_v = min(max(self._off_v, -FARTHEST_OFF), FARTHEST_OFF)
        x, y, yaw = pose.x, pose.y, pose.yaw
        end = t + (self.latency if self._commands[-1][1] else self.turn_latency)
        for elapsed, v, w in self._driven(measured, end):
            x, y, yaw = advanced(x, y, yaw, v + self._off_v, self.turn_gain * w + self._off_w, elapsed)
        return Pose2D(x, y, yaw)

    def _driven(self, start, end):
        """Return [(s, v, w)]: what is driven between two times, a speed and a turn rate each after its own latency."""
        speeds = self._between(start - self.latency, end - self.latency)
        turns = self._between(start - self.turn_latency, end - self.turn_latency)
        found, i, j = [], 0, 0
        while i < len(speeds) and j < len(turns):
            speed_ends, turn_ends = speeds[i][1] + self.latency, turns[j][1] + self.turn_latency
            until = min(speed_ends, turn_ends)
            found.append((until - start, speeds[i][2], turns[j][3]))
            start = until
            i += speed_ends == until
            j += turn_ends == until
        return found

    def _at(self, t):
        """Return the command (v, w) in force at t."""
        for at, v, w in reversed(self._commands):
            if at <= t:
                return v, w
        return self._commands[0][1:]

    def _between(self, start, end):
        """Return [(start, end, v, w)] of the commands in force between two times, in their order."""
        found = []
        for at, v, w in reversed(self._commands):
            low = max(at, start)
            if end > low:
                found.append((low, end, v, w))
            if at <= start:
                break
            end = min(end, at)
        found.reverse()
        return found

    def _learn(self, t, yaw):
        """Compare how much the robot has turned since the last pose with what was commanded for that time."""
        last, self._pose = self._pose, (t, yaw)
        if last is None or not 0.0 < t - last[0] < 0.5:
            if last is not None and t <= last[0]:
                self._pose = last if t == last[0] else (t, yaw)
            return
        elapsed, turned = t - last[0], wrap(yaw - last[1])
        late = self.turn_latency
        told = sum(w * (high - low) for low, high, _, w in self._between(last[0] - late, t - late))
        self._off_w += min(elapsed / SETTLING, 1.0) * ((turned - self.turn_gain * told) / elapsed - self._off_w)
        self._off_w = min(max(self._off_w, -FARTHEST_OFF), FARTHEST_OFF)
        if abs(told) > 0.05 * elapsed and LEAST < turned / told < MOST:
            keep = math.exp(-elapsed / MEMORY)
            self._seen = keep * self._seen + turned * told
            self._told = keep * self._told + told * told
            self.turn_gain = self._seen / self._told
