"""Where things may stand about the chair, place by place, compiled: what Zones asks at every command and after every
echo, nearly always to no effect.

The plain form of what `matters` leaves out is in zones, which looks closely at the rest; the tests hold the two
together.
"""

import math

import numpy as np

from ahead_of_time import kernel


@kernel
def put(x, y, outside, radius, way, directions, way_out, first, last, sensor_x, sensor_y, distance, half_x, half_y):
    """Put what a sensor at (sensor_x, sensor_y) hears at `distance` (m, +Inf: nothing) on its rays, first to last - 1
    of all. Returns (how far outside the body the nearest of all is, how far from base_link the farthest), m.

    x, y, outside, radius, way (n,), m: of zones._Places, changed. directions (2, n) and way_out (n,), m: of the rays.
    half_x, half_y: of the body, m.
    """
    for i in range(first, last):
        if distance == math.inf:
            outside[i], radius[i] = math.inf, 0.0
            continue
        along = max(distance, way_out[i])
        x[i], y[i] = sensor_x + along * directions[0, i], sensor_y + along * directions[1, i]
        outside[i], radius[i] = max(abs(x[i]) - half_x, abs(y[i]) - half_y), math.hypot(x[i], y[i])
        way[i] = along - way_out[i]
    nearest, farthest = math.inf, 0.0
    for i in range(len(x)):
        nearest, farthest = min(nearest, outside[i]), max(farthest, radius[i])
    return nearest, farthest


@kernel
def matters(x, y, outside, radius, v, w, half_y, side_squared, corner_squared, stop_distance, reaction, braking):
    """Whether the body meets any of the places (n,) on its curve (Zones._swept) and one of those is nearer than it
    takes to rest from the speed at which it is approached. side_squared, corner_squared: squares of the body's least
    and greatest radius, m2.
    """
    turn, sense = abs(w), math.copysign(1.0, w)
    most, least = turn * corner_squared + 2.0 * half_y * abs(v), turn * side_squared - 2.0 * half_y * abs(v)
    bounded = abs(v) > half_y * turn
    for i in range(len(x)):
        if outside[i] == math.inf:
            continue
        reach = turn * (radius[i] * radius[i]) - 2.0 * v * sense * y[i]
        if reach > most or (bounded and reach < least):
            continue
        u = math.hypot(v - w * y[i], w * x[i])
        if u > 1e-9 and outside[i] < stop_distance + u * reaction + u * u / (2.0 * braking):
            return True
    return False


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    x, y, outside, radius, way, way_out = np.zeros((6, 3))
    put(x, y, outside, radius, way, np.zeros((2, 3)), way_out, 0, 3, 0.0, 0.0, 1.0, 0.5, 0.3)
    matters(x, y, outside, radius, 0.1, 0.1, 0.3, 0.1, 0.4, 0.1, 0.2, 0.5)
