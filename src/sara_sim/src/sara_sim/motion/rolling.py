"""A step of two driven wheels on a level floor with nothing about, compiled: what `Drive` does a hundred times a
second, nearly always.

The equations are those of `drive`, which steps by itself where anything else moves, tilts or stops the chair; the tests
hold the two together.
"""

from math import cos, sin

import numpy as np

from ahead_of_time import kernel
from sara_sim.world.rays import is_clear


@kernel
def wheel(target, speed, dead_band, limit, dt, lag, decay):
    """(angle turned in dt, speed after it) of a wheel that follows a target (rad/s) with a lag; within the dead band it
    rests.
    """
    if abs(target) < dead_band:
        if abs(speed) < 1e-6:
            return 0.0, 0.0
        target = 0.0
    elif not -limit <= target <= limit:
        target = limit if target > 0.0 else -limit
    error = speed - target
    return target * dt + error * lag * (1.0 - decay), target + error * decay


@kernel
def moved(x, y, yaw, distance, turn):
    """The pose after an arc: its chord points along the middle heading and is shorter by sin(turn/2) / (turn/2)."""
    half = 0.5 * turn
    middle = yaw + half
    shorter = sin(half) / half if half > 1e-9 or half < -1e-9 else 1.0
    c, s = shorter * cos(middle), shorter * sin(middle)
    return x + distance * c, y + distance * s, yaw + turn


@kernel
def roll(pose, speeds, targets, radii, slip, track, motor, dt, lag, decay, before, clear, place):
    """((x, y, yaw), (right, left) angles turned, their speeds after it, (speed, yaw rate, acceleration, yaw
    acceleration), whether it moves where a wall may be near).

    `pose`: m, m, rad. `speeds`, `targets`: right, left, rad/s. `radii`: m, grip included. `motor`: dead band and limit,
    rad/s. `before`: speed, yaw rate.
    `clear`: World.clear_of the body, `place`: (x, y) of its corner and m per cell.
    """
    right, right_speed = wheel(targets[0], speeds[0], motor[0], motor[1], dt, lag, decay)
    left, left_speed = wheel(targets[1], speeds[1], motor[0], motor[1], dt, lag, decay)
    distance = 0.5 * (radii[0] * right + radii[1] * left)
    turn = slip * (radii[0] * right - radii[1] * left) / track
    speed = 0.5 * (radii[0] * right_speed + radii[1] * left_speed)
    rate = slip * (radii[0] * right_speed - radii[1] * left_speed) / track
    after = moved(pose[0], pose[1], pose[2], distance, turn)
    near = (distance != 0.0 or turn != 0.0) and not is_clear(
        clear, (after[0] - place[0]) / place[2], (after[1] - place[1]) / place[2]
    )
    return (
        after,
        (right, left),
        (right_speed, left_speed),
        (speed, rate, (speed - before[0]) / dt, (rate - before[1]) / dt),
        near,
    )


def warm():
    """Compile, or load from the cache, the kernel for the types it is called with."""
    roll(
        (0.0, 0.0, 0.0),
        (0.0, 0.0),
        (1.0, 1.0),
        (0.1, 0.1),
        1.0,
        1.0,
        (0.0, 1.0),
        0.01,
        1.0,
        0.5,
        (0.0, 0.0),
        np.zeros((1, 1), np.bool_),
        (0.0, 0.0, 1.0),
    )
