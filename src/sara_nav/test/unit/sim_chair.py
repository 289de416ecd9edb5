"""A small chair to test planners on: slip in turns, motor lag, quantised wheel commands, late pose.

Its numbers are those of SARA: commands at 50 Hz in steps of 1/9.5 rad/s with the rest carried over, wheel radius
0.155 m, track 0.525 m, true turn rate 1/1.27 of what the wheels say, lag 0.1 s.
"""
import math

from sara_nav.geometry import Pose2D

RADIUS, TRACK, STEP = 0.155, 0.525, 1.0 / 9.5


class SimChair:
    """Advances in 10 ms; ``pose`` is the truth, ``seen()`` what a planner is given."""

    def __init__(self, pose, delay=0.12, pose_period=0.1, slip=1.27, lag=0.1):
        self.t, self.pose, self.delay, self.slip, self.lag = 0.0, pose, delay, slip, lag
        self.pose_period = pose_period
        self.asked, self.rest, self.sent, self.wheels = (0.0, 0.0), [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        self.velocity = (0.0, 0.0)
        self.history = [(0.0, pose, (0.0, 0.0))]
        self.turned = 0.0

    def command(self, v, w):
        self.asked = ((v + 0.5 * w * TRACK) / RADIUS, (v - 0.5 * w * TRACK) / RADIUS)

    def advance(self):
        """Go on by 10 ms."""
        tick = round(self.t * 100)
        if tick % 2 == 0:
            for i in (0, 1):
                if self.asked == (0.0, 0.0):
                    self.rest[i], self.sent[i] = 0.0, 0.0
                    continue
                wanted = self.asked[i] + self.rest[i]
                self.sent[i] = round(wanted / STEP) * STEP
                self.rest[i] = wanted - self.sent[i]
        for i in (0, 1):
            target = self.sent[i] if abs(self.sent[i]) >= 0.02 else 0.0
            self.wheels[i] += (target - self.wheels[i]) * (1.0 - math.exp(-0.01 / self.lag))
        v = 0.5 * RADIUS * (self.wheels[0] + self.wheels[1])
        w = RADIUS * (self.wheels[0] - self.wheels[1]) / TRACK / self.slip
        self.velocity = (v, w)
        self.pose = self.pose.advance(v, w, 0.01)
        self.turned += w * 0.01
        self.t = (tick + 1) / 100.0
        if abs(self.t / self.pose_period - round(self.t / self.pose_period)) < 1e-6:
            self.history.append((self.t, self.pose, self.velocity))

    def seen(self):
        """Return (pose, velocity, stamp) of the newest measurement that is ``delay`` old."""
        best = self.history[0]
        for entry in reversed(self.history[-40:]):
            if entry[0] <= self.t - self.delay + 1e-9:
                best = entry
                break
        return best[1], best[2], best[0]


def drive(move_base, chair, goal, limit=60.0, each=None):
    """Drive to a goal; return (StepResult of the end, seconds, list of (t, pose, command))."""
    move_base.set_goal(goal, chair.t)
    begin, trail, period = chair.t, [], round(100.0 / move_base.config.controller_frequency)
    while chair.t - begin < limit:
        pose, velocity, stamp = chair.seen()
        result = move_base.step(chair.t, pose, velocity, stamp)
        chair.command(*result.command)
        trail.append((chair.t, chair.pose, result.command))
        if result.status != 'active':
            break
        for _ in range(period):
            chair.advance()
            if each:
                each(chair)
    for _ in range(50):
        chair.advance()
    return result, chair.t - begin - 0.5, trail
