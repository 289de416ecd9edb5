"""The laws of two driven wheels on a floor, compiled, and a whole step where nothing but walls could stop the chair.

Wheel speed follows its target with a first-order lag, integrated exactly over a step:
    angle = target dt + (w0 - target) tau (1 - exp(-dt / tau)).
The body moves along the arc that the wheels describe, with the turn shortened by the slip:
    ds = (Rr dr + Rl dl) / 2,    dyaw = slip (Rr dr - Rl dl) / track.
`Drive` makes each of its steps of these functions; `roll` joins them to one call for the step that is nearly every one.
"""

from math import cos, sin

import numpy as np

from ahead_of_time import kernel
from sara_sim.world.rays import is_clear

# On a ramp the motor's brake holds a wheel that is asked to stand and is this slow, rad/s.
BRAKE_SPEED = 0.8


@kernel
def wheel(target, speed, motor, droop, dt, lag, decay):
    """(angle turned in dt, speed after it) of a wheel that follows a target (rad/s) with a lag; within the dead band it
    rests.

    `motor`: dead band and limit, rad/s. `droop`: by how much gravity on a slope slows it, rad/s. `lag`: tau, s.
    `decay`: exp(-dt / tau).
    """
    if abs(target) < motor[0]:
        if abs(speed) < 1e-6 or droop != 0.0 and abs(speed) < BRAKE_SPEED:
            return 0.0, 0.0
        target = 0.0
    elif not -motor[1] <= target <= motor[1]:
        target = motor[1] if target > 0.0 else -motor[1]
    target -= droop
    error = speed - target
    return target * dt + error * lag * (1.0 - decay), target + error * decay


@kernel
def body(right, left, radii, slip, track):
    """(forward, turn) of the body for what the wheels turn (rad, giving m and rad) or their speeds (rad/s, giving m/s
    and rad/s). `radii`: right, left, m, grip included.
    """
    return 0.5 * (radii[0] * right + radii[1] * left), slip * (radii[0] * right - radii[1] * left) / track


@kernel
def moved(pose, distance, side, turn):
    """The pose after an arc: its chord points along the middle heading and is shorter by sin(turn/2) / (turn/2).

    `pose`: x, y, yaw. `side`: what pushes the body to its left besides, m.
    """
    half = 0.5 * turn
    middle = pose[2] + half
    shorter = sin(half) / half if half > 1e-9 or half < -1e-9 else 1.0
    c, s = shorter * cos(middle), shorter * sin(middle)
    return pose[0] + distance * c - side * s, pose[1] + distance * s + side * c, pose[2] + turn


@kernel
def roll(pose, speeds, targets, radii, slip, track, motor, dt, lag, decay, before, clear, place):
    """((x, y, yaw), (right, left) angles turned, their speeds after it, (speed, yaw rate, acceleration, yaw
    acceleration), whether it moves where a wall may be near).

    `pose`: m, m, rad. `speeds`, `targets`: right, left, rad/s. `before`: speed, yaw rate. `clear`: World.clear_of the
    body, `place`: (x, y) of its corner and m per cell. The others are those of `wheel` and `body`.
    """
    right, right_speed = wheel(targets[0], speeds[0], motor, 0.0, dt, lag, decay)
    left, left_speed = wheel(targets[1], speeds[1], motor, 0.0, dt, lag, decay)
    distance, turn = body(right, left, radii, slip, track)
    speed, rate = body(right_speed, left_speed, radii, slip, track)
    after = moved(pose, distance, 0.0, turn)
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


def warm() -> None:
    """Compile, or load from the cache, the kernels for the types they are called with."""
    pose, pair, motor = (0.0, 0.0, 0.0), (0.1, 0.1), (0.0, 1.0)
    wheel(1.0, 0.0, motor, 0.0, 0.01, 1.0, 0.5)
    body(0.0, 0.0, pair, 1.0, 1.0)
    moved(pose, 0.0, 0.0, 0.0)
    clear = np.zeros((1, 1), np.bool_)
    roll(pose, pair, pair, pair, 1.0, 1.0, motor, 0.01, 1.0, 0.5, pair, clear, (0.0, 0.0, 1.0))
