"""Speeds whose acceleration changes gently and that still keep to what lies ahead: planned so, not limited afterwards.

Braking from a speed v at an acceleration a goes in three parts: the acceleration falls at the jerk limit to -b, stays
there, and rises to zero as the speed is reached that is braked to; b is the braking limit, or less where the speed does
not last for it. (The double-S profile of Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and
Robots, 2008, section 3.4.) What is behind a limiter of jerk needs nothing else to follow exactly.
"""

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel

HALVINGS = 14
"""Steps of the search for the acceleration: it is found to a share of 1/16384 of what one step may change."""


class SpeedLimits(NamedTuple):
    """Acceleration and braking (m/s2) and jerk (m/s3), all > 0; of a turn in rad."""

    acceleration: float
    braking: float
    jerk: float


class Motion(NamedTuple):
    """speed (m/s, >= 0) and acceleration (m/s2) now."""

    speed: float
    acceleration: float


class Caps(NamedTuple):
    """Within the distances ``ahead`` (n,) m the speed must have come down to ``speed`` (n,) m/s, >= 0."""

    ahead: np.ndarray
    speed: np.ndarray


NO_CAPS = Caps(np.empty(0), np.empty(0))


@kernel
def braking_to_rest(v: float, a: float, braking: float, jerk: float) -> tuple[float, float]:
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
def way_to_slow(v: float, a: float, end: float, braking: float, jerk: float) -> float:
    """Return the way (m) from a speed v at an acceleration a until the speed is ``end`` (both >= 0) and stays there."""
    above = v - end
    if above <= 0.0 and (a <= 0.0 or above + 0.5 * a * a / jerk <= 0.0):
        return 0.0
    way, time = braking_to_rest(above, a, braking, jerk)
    return way + end * time


@kernel
def _left(now, distance, cap, limits):
    """Return how much of a distance (m) is left over by which the speed is to be ``cap``; +Inf where that does not ask
    for slowing.
    """
    needed = way_to_slow(now.speed, now.acceleration, cap, limits.braking, limits.jerk)
    return distance - needed if needed > 0.0 else np.inf


@kernel
def _driven(now, chosen, dt):
    """Return (Motion, m) after dt at the acceleration ``chosen``, and how far it went."""
    after = max(now.speed + chosen * dt, 0.0)
    return Motion(after, chosen), 0.5 * (now.speed + after) * dt


@kernel
def _closest(now, chosen, caps, limits, dt):
    """Return the least distance (m) that is left over, driving dt at the acceleration ``chosen``, and at which cap that
    is; +Inf, -1 where no cap asks for slowing.
    """
    after, moved = _driven(now, chosen, dt)
    ahead, speed = caps
    least, at = np.inf, -1
    for i in range(len(ahead)):
        left = _left(after, ahead[i] - moved, speed[i], limits)
        if left < least:
            least, at = left, i
    return least, at


@kernel
def _keeps(now, chosen, caps, limits, dt):
    """Return whether every cap is kept, driving dt at the acceleration ``chosen``."""
    after, moved = _driven(now, chosen, dt)
    ahead, speed = caps
    for i in range(len(ahead)):  # noqa: SIM110 (numba compiles no generators)
        if _left(after, ahead[i] - moved, speed[i], limits) < 0.0:
            return False
    return True


@kernel
def _choose(now, highest, caps, limits, dt):
    """Return (acceleration m/s2, index of the cap that slows or -1) for the next dt; see next_speed."""
    a, jerk = now.acceleration, limits.jerk
    least, most = max(a - jerk * dt, -limits.braking), min(a + jerk * dt, limits.acceleration)
    least = min(max(least, a - jerk * dt), most)
    gap = highest - now.speed
    # The acceleration that can be brought to zero just as ``highest`` is reached: a dt + a^2 / (2 jerk) = gap.
    wanted = 2.0 * jerk * gap / (jerk * dt + math.sqrt((jerk * dt) ** 2 + 2.0 * jerk * abs(gap)))
    most = max(min(most, wanted), least)
    over, at = _closest(now, most, caps, limits, dt)
    if over >= 0.0:
        return most, -1
    if not _keeps(now, least, caps, limits, dt):
        return least, at
    low, high = least, most
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _keeps(now, middle, caps, limits, dt):
            low = middle
        else:
            high = middle
    return low, at


@kernel
def following(now: Motion, highest: float, caps: Caps, limits: SpeedLimits, dt: float) -> tuple[float, float, int]:
    """See next_speed; for kernels."""
    chosen, at = _choose(now, highest, caps, limits, dt)
    after = now.speed + chosen * dt
    return (after, chosen, at) if after > 0.0 else (0.0, 0.0, at)


def next_speed(now: Motion, highest: float, caps: Caps, limits: SpeedLimits, dt: float) -> tuple[float, float, int]:
    """Return (speed, acceleration, index) after dt (s): as fast as keeps ``highest`` (m/s) and the Caps.

    index: of the cap that slows, -1 when none does. Where the jerk limit no longer allows a cap to be kept, it brakes
    as hard as it does allow.
    """
    return following(
        Motion(*map(float, now)),
        float(highest),
        Caps(np.asarray(caps.ahead, np.float64), np.asarray(caps.speed, np.float64)),
        limits,
        float(dt),
    )


def approach(v: float, a: float, target: float, acceleration: float, jerk: float, dt: float) -> tuple[float, float]:
    """Return (speed, acceleration) after dt (s) on the way to a target, either sign, within acceleration and jerk.

    The acceleration can be brought to zero by the jerk limit when the target is reached: a resting one is not overshot.
    """
    gap = target - v
    size = abs(gap)
    wanted = 2.0 * jerk * gap / (jerk * dt + math.sqrt((jerk * dt) ** 2 + 2.0 * jerk * size))
    chosen = min(max(wanted, -acceleration, a - jerk * dt), acceleration, a + jerk * dt)
    return v + chosen * dt, chosen


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    next_speed(Motion(0.1, 0.0), 0.5, Caps(np.ones(1), np.zeros(1)), SpeedLimits(1.0, 1.0, 1.0), 0.05)
    way_to_slow(0.1, 0.0, 0.0, 1.0, 1.0)
