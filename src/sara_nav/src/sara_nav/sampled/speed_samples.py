"""The speeds (v, w) that the sampling planners try in a cycle, evenly spaced over what can be reached: those of
base_local_planner (Gerkey and Konolige 2008) and of dwa_local_planner (Fox, Burgard and Thrun 1997). Speeds in m/s and
rad/s.
"""

import math

import numpy as np

from ahead_of_time import kernel


@kernel
def evenly(low: float, high: float, count: int) -> np.ndarray:
    """Return ``count`` values evenly from low to high, both among them; low alone when one is asked for."""
    result = np.empty(count)
    step = (high - low) / max(count - 1, 1)
    for i in range(count):
        result[i] = low + i * step
    if count > 1:
        result[count - 1] = high
    return result


@kernel
def velocities(low: float, high: float, count: int) -> np.ndarray:
    """Return ``count`` speeds evenly from low to high (at least the two ends, one when they are equal), and 0 among
    them when they lie on both sides of it."""
    if low == high:
        return np.full(1, low)
    speeds = evenly(low, high, max(count, 2))
    result = np.empty(len(speeds) + 1)
    n = 0
    for i in range(len(speeds)):
        if low < 0.0 < speeds[i] and speeds[i - 1] < 0.0:
            result[n] = 0.0
            n += 1
        result[n] = speeds[i]
        n += 1
    return result[:n].copy()


@kernel
def window_samples(
    v_range: tuple[float, float],
    w_range: tuple[float, float],
    count: tuple[int, int],
    slowest: tuple[float, float],
    fastest: float,
) -> np.ndarray:
    """Return the samples (n, 2) of the dynamic window: v_range, w_range (low, high), count of each.

    slowest: speed and turn rate, samples slower than both are left out. Where the window is too small to reach either
    from rest, it is sampled too (no speed above ``fastest``): slower speeds are not driven, so nothing else could
    begin.
    """
    (v_low, v_high), (w_low, w_high) = v_range, w_range
    v, w = velocities(v_low, v_high, count[0]), velocities(w_low, w_high, count[1])
    samples = np.empty((len(v) * len(w) + 3, 2))
    n = 0
    for i in range(len(v)):
        for j in range(len(w)):
            too_slow = abs(v[i]) + 1e-4 < slowest[0] and abs(w[j]) + 1e-4 < slowest[1]
            if not too_slow and (v[i] != 0.0 or w[j] != 0.0):
                samples[n] = v[i], w[j]
                n += 1
    if v_low <= 0.0 <= v_high:
        if v_high < slowest[0] <= fastest:
            samples[n] = slowest[0], 0.0
            n += 1
        for rate in (slowest[1], -slowest[1]):
            if slowest[1] > 0.0 and not w_low <= rate <= w_high and w_low <= 0.0 <= w_high:
                samples[n] = 0.0, rate
                n += 1
    return samples[:n].copy()


@kernel
def rollout_samples(
    v_range: tuple[float, float], w_range: tuple[float, float], count: tuple[int, int], least_turn: float
) -> tuple[np.ndarray, int]:
    """Return (samples (n, 2) of the trajectory rollout, how many of them drive forward): v_range, w_range (low, high),
    count of each.

    Those forward come first, then turns in place, no slower than ``least_turn``, last standing still.
    """
    (slow, fast), (right, left) = v_range, w_range
    v = evenly(slow, fast, count[0]) if count[0] > 1 else np.full(1, fast)
    w = evenly(right, left, max(count[1] - 1, 0))
    samples = np.empty((len(v) * (len(w) + 1) + count[1] + 1, 2))
    n = 0
    for i in range(len(v)):
        if v[i] != 0.0:  # turns in place come below, standing still is judged apart
            samples[n] = v[i], 0.0
            n += 1
            for j in range(len(w)):
                samples[n] = v[i], w[j]
                n += 1
    forward = n
    turns = evenly(right, left, count[1])
    slowest = (left - right) / max(count[1] - 1, 1) if len(turns) > 2 else 0.0
    for i in range(len(turns)):
        if abs(turns[i]) > slowest:
            samples[n] = 0.0, math.copysign(max(abs(turns[i]), least_turn), turns[i])
            n += 1
    samples[n] = 0.0, 0.0
    return samples[: n + 1].copy(), forward


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    window_samples((0.0, 1.0), (0.0, 1.0), (3, 3), (0.1, 0.1), 1.0)
    rollout_samples((0.0, 1.0), (0.0, 1.0), (3, 3), 0.1)
    velocities(0.0, 1.0, 2)
