"""Speeds whose acceleration changes gently and that still come to rest where they are to: the profile is planned, not limited afterwards.

Braking from a speed v at an acceleration a goes in three parts: the acceleration falls at the jerk limit to -b, stays there, and
rises to zero as the speed does; b is the braking limit, or less where the speed does not last for it. (The double-S profile of
Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, section 3.4.) What is behind a limiter
of jerk needs nothing else to follow exactly.
"""
import math
from dataclasses import dataclass

HALVINGS = 14
"""Steps of the search for the acceleration: it is found to a share of 1/16384 of what one step may change."""


@dataclass(frozen=True)
class SpeedLimits:
    """Acceleration and braking (m/s2) and jerk (m/s3), all > 0; of a turn in rad."""

    acceleration: float
    braking: float
    jerk: float


def way_to_rest(v, a, braking, jerk):
    """Return the way (m) from a speed v >= 0 at an acceleration a until rest, braking as hard as the limits allow.

    A braking so hard that the jerk limit carries it past rest ends there: the way is that of easing off.
    """
    b = min(braking, math.sqrt(max(jerk * v + 0.5 * a * a, 0.0)))
    if a < -b:  # easing off is all there is to do
        b = -a
    turning = max((a + b) / jerk, 0.0)
    v1 = v + (a - 0.5 * jerk * turning) * turning
    way = (v + (0.5 * a - jerk * turning / 6.0) * turning) * turning
    if v1 <= 0.0:
        return max(way, 0.0)
    if b <= 0.0:
        return way
    easing = b / jerk
    v2 = 0.5 * b * easing
    if v1 > v2:
        way += (v1 * v1 - v2 * v2) / (2.0 * b)
        v1 = v2
    # From v1 <= v2 the easing is over when the speed is; of a smaller speed, earlier.
    ends = (b - math.sqrt(max(b * b - 2.0 * jerk * v1, 0.0))) / jerk
    return way + v1 * ends - 0.5 * b * ends * ends + jerk * ends ** 3 / 6.0


def next_speed(v, a, left, highest, limits, dt):
    """Return (speed, acceleration) after dt (s): as fast as lets the robot keep ``highest`` (m/s) and rest within ``left`` (m).

    v >= 0, a: speed and acceleration now. Where the jerk limit no longer allows that, it brakes as hard as it does allow.
    """
    jerk = limits.jerk
    least, most = max(a - jerk * dt, -limits.braking), min(a + jerk * dt, limits.acceleration)
    least = min(least, most)
    gap = highest - v
    # The acceleration that can be brought to zero just as ``highest`` is reached: a dt + a^2 / (2 jerk) = gap.
    wanted = 2.0 * jerk * gap / (jerk * dt + math.sqrt((jerk * dt) ** 2 + 2.0 * jerk * abs(gap)))
    most = max(min(most, wanted), least)

    def rests_in_time(new):
        after = max(v + new * dt, 0.0)
        return 0.5 * (v + after) * dt + way_to_rest(after, new, limits.braking, jerk) <= left
    if rests_in_time(most):
        chosen = most
    elif not rests_in_time(least):
        chosen = least
    else:
        low, high = least, most
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if rests_in_time(middle) else (low, middle)
        chosen = low
    after = v + chosen * dt
    return (after, chosen) if after > 0.0 else (0.0, 0.0)
