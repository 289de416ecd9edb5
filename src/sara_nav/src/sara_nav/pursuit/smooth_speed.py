"""Speeds whose acceleration changes gently and that still keep to what lies ahead: planned so, not limited afterwards.

Braking from a speed v at an acceleration a goes in three parts: the acceleration falls at the jerk limit to -b, stays
there, and rises to zero as the speed is reached that is braked to; b is the braking limit, or less where the speed does
not last for it. (The double-S profile of Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and
Robots, 2008, section 3.4.) What is behind a limiter of jerk needs nothing else to follow exactly.
"""

import math
from dataclasses import dataclass

import numpy as np

from ahead_of_time import kernel

HALVINGS = 14
"""Steps of the search for the acceleration: it is found to a share of 1/16384 of what one step may change."""


@dataclass(frozen=True)
class SpeedLimits:
    """Acceleration and braking (m/s2) and jerk (m/s3), all > 0; of a turn in rad."""

    acceleration: float
    braking: float
    jerk: float


@kernel
def braking_to_rest(v, a, braking, jerk):
    """Return (way m, time s) from a speed v at an acceleration a until rest, braking as hard as the limits allow.

    A braking so hard that the jerk limit carries it past rest ends there: the way is that of easing off. v may be
    negative where a lifts it above rest again.
    """
    b = min(braking, math.sqrt(max(jerk * v + 0.5 * a * a, 0.0)))
    if a < -b:  # easing off is all there is to do
        b = -a
    turning = max((a + b) / jerk, 0.0)
    v1 = v + (a - 0.5 * jerk * turning) * turning
    way = (v + (0.5 * a - jerk * turning / 6.0) * turning) * turning
    time = turning
    if v1 <= 0.0:
        return max(way, 0.0), time
    if b <= 0.0:
        return way, time
    easing = b / jerk
    v2 = 0.5 * b * easing
    if v1 > v2:
        way += (v1 * v1 - v2 * v2) / (2.0 * b)
        time += (v1 - v2) / b
        v1 = v2
    # From v1 <= v2 the easing is over when the speed is; of a smaller speed, earlier.
    ends = (b - math.sqrt(max(b * b - 2.0 * jerk * v1, 0.0))) / jerk
    return way + v1 * ends - 0.5 * b * ends * ends + jerk * ends**3 / 6.0, time + ends


@kernel
def way_to_slow(v, a, end, braking, jerk):
    """Return the way (m) from a speed v at an acceleration a until the speed is ``end`` (both >= 0) and stays there."""
    above = v - end
    if above <= 0.0 and (a <= 0.0 or above + 0.5 * a * a / jerk <= 0.0):
        return 0.0
    way, time = braking_to_rest(above, a, braking, jerk)
    return way + end * time


@kernel
def _left(after, new, way, cap, braking, jerk):
    """Return how much of a way (m) is left over by which a speed is to be ``cap``; +Inf where that does not ask for
    slowing.
    """
    needed = way_to_slow(after, new, cap, braking, jerk)
    return way - needed if needed > 0.0 else np.inf


@kernel
def _kept(v, new, ways, caps, braking, jerk, dt):
    """Return how much way (m) is left over where it is least, driving dt at the acceleration ``new``, and at which cap
    that is; +Inf, -1 where no cap asks for slowing.
    """
    after = max(v + new * dt, 0.0)
    moved = 0.5 * (v + after) * dt
    least, at = np.inf, -1
    for i in range(len(ways)):
        left = _left(after, new, ways[i] - moved, caps[i], braking, jerk)
        if left < least:
            least, at = left, i
    return least, at


@kernel
def _keeps(v, new, ways, caps, braking, jerk, dt):
    """Return whether way is left over at every cap, driving dt at the acceleration ``new``."""
    after = max(v + new * dt, 0.0)
    moved = 0.5 * (v + after) * dt
    for i in range(len(ways)):  # noqa: SIM110 (numba compiles no generators)
        if _left(after, new, ways[i] - moved, caps[i], braking, jerk) < 0.0:
            return False
    return True


@kernel
def _next(v, a, highest, ways, caps, acceleration, braking, jerk, dt):
    least, most = max(a - jerk * dt, -braking), min(a + jerk * dt, acceleration)
    least = min(max(least, a - jerk * dt), most)
    gap = highest - v
    # The acceleration that can be brought to zero just as ``highest`` is reached: a dt + a^2 / (2 jerk) = gap.
    wanted = 2.0 * jerk * gap / (jerk * dt + math.sqrt((jerk * dt) ** 2 + 2.0 * jerk * abs(gap)))
    most = max(min(most, wanted), least)
    over, at = _kept(v, most, ways, caps, braking, jerk, dt)
    if over >= 0.0:
        return most, -1
    if not _keeps(v, least, ways, caps, braking, jerk, dt):
        return least, at
    low, high = least, most
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _keeps(v, middle, ways, caps, braking, jerk, dt):
            low = middle
        else:
            high = middle
    return low, at


@kernel
def following(v, a, highest, ways, caps, acceleration, braking, jerk, dt):
    """`next_speed` with its limits one by one."""
    chosen, at = _next(v, a, highest, ways, caps, acceleration, braking, jerk, dt)
    after = v + chosen * dt
    return (after, chosen, at) if after > 0.0 else (0.0, 0.0, at)


def next_speed(v, a, highest, ways, caps, limits, dt):
    """Return (speed, acceleration, index) after dt (s): as fast as keeps ``highest`` (m/s) and, at each way ahead, its
    cap.

    v >= 0, a: speed and acceleration now. ways (n,) m, caps (n,) m/s >= 0: within ways[i] the speed must have come down
    to caps[i]. index: of the cap that slows, -1 when none does. Where the jerk limit no longer allows a cap to be kept,
    it brakes as hard as it does allow.
    """
    return following(
        float(v),
        float(a),
        float(highest),
        np.asarray(ways, np.float64),
        np.asarray(caps, np.float64),
        limits.acceleration,
        limits.braking,
        limits.jerk,
        float(dt),
    )


def approach(v, a, target, acceleration, jerk, dt):
    """Return (speed, acceleration) after dt (s) on the way to a target, either sign, within acceleration and jerk.

    The acceleration can be brought to zero by the jerk limit when the target is reached: a resting one is not overshot.
    """
    gap = target - v
    size = abs(gap)
    wanted = 2.0 * jerk * gap / (jerk * dt + math.sqrt((jerk * dt) ** 2 + 2.0 * jerk * size))
    chosen = min(max(wanted, -acceleration, a - jerk * dt), acceleration, a + jerk * dt)
    return v + chosen * dt, chosen


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    next_speed(0.1, 0.0, 0.5, np.ones(1), np.zeros(1), SpeedLimits(1.0, 1.0, 1.0), 0.05)
    way_to_slow(0.1, 0.0, 0.0, 1.0, 1.0)
