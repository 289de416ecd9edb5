"""The laws of two driven wheels on a floor, compiled, and a whole step where nothing but walls could stop the chair.

Wheel speed follows its target with a first-order lag, integrated exactly over a step:
    angle = target dt + (w0 - target) tau (1 - exp(-dt / tau)).
The body moves along the arc that the wheels describe, with the turn shortened by the slip:
    ds = (Rr dr + Rl dl) / 2,    dyaw = slip (Rr dr - Rl dl) / track.
`Drive` makes each of its steps of these functions; `roll` joins them to one call for the step that is nearly every one.
"""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_sim.world.rays import is_clear

# On a ramp the motor's brake holds a wheel that is asked to stand and is this slow, rad/s.
BRAKE_SPEED = 0.8


class Motor(NamedTuple):
    """What moves a wheel in a step: dead band and limit, rad/s; the step dt and the lag tau, s; exp(-dt / tau)."""

    dead_band: float
    limit: float
    dt: float
    lag: float
    decay: float


class Contact(NamedTuple):
    """What the wheels roll on: their radii, grip included, and the track, m; by how much slip shortens a turn."""

    right_radius: float
    left_radius: float
    slip: float
    track: float


class Surroundings(NamedTuple):
    """World.clear_of the body, (x, y) of its corner, m, and m per cell."""

    clear: np.ndarray
    x: float
    y: float
    resolution: float


@kernel
def wheel(target: float, speed: float, droop: float, motor: Motor) -> tuple[float, float]:
    """(angle turned in a step, speed after it) of a wheel that follows a target (rad/s) with a lag; within the dead
    band it rests. `droop`: by how much gravity on a slope slows it, rad/s.
    """
    if abs(target) < motor.dead_band:
        if abs(speed) < 1e-6 or droop != 0.0 and abs(speed) < BRAKE_SPEED:
            return 0.0, 0.0
        target = 0.0
    elif not -motor.limit <= target <= motor.limit:
        target = motor.limit if target > 0.0 else -motor.limit
    target -= droop
    error = speed - target
    return target * motor.dt + error * motor.lag * (1.0 - motor.decay), target + error * motor.decay


@kernel
def body(right: float, left: float, contact: Contact) -> tuple[float, float]:
    """(forward, turn) of the body for what the wheels turn (rad, giving m and rad) or their speeds (rad/s, giving m/s
    and rad/s).
    """
    right, left = contact.right_radius * right, contact.left_radius * left
    return 0.5 * (right + left), contact.slip * (right - left) / contact.track


@kernel
def moved(pose: tuple[float, float, float], distance: float, side: float, turn: float) -> tuple[float, float, float]:
    """The pose after an arc: its chord points along the middle heading and is shorter by sin(turn/2) / (turn/2).

    `pose`: x, y, yaw. `side`: what pushes the body to its left besides, m.
    """
    half = 0.5 * turn
    middle = pose[2] + half
    shorter = sin(half) / half if half > 1e-9 or half < -1e-9 else 1.0
    c, s = shorter * cos(middle), shorter * sin(middle)
    return pose[0] + distance * c - side * s, pose[1] + distance * s + side * c, pose[2] + turn


@kernel
def roll(
    pose: tuple[float, float, float],
    wheels: tuple[tuple[float, float], tuple[float, float]],
    before: tuple[float, float],
    contact: Contact,
    motor: Motor,
    surroundings: Surroundings,
) -> tuple:
    """((x, y, yaw), (right, left) angles turned, their speeds after it, (speed, yaw rate, acceleration, yaw
    acceleration), whether it moves where a wall may be near).

    `pose`: m, m, rad. `wheels`: of the right and the left one its target and its speed, rad/s. `before`: speed, yaw
    rate.
    """
    right, right_speed = wheel(wheels[0][0], wheels[0][1], 0.0, motor)
    left, left_speed = wheel(wheels[1][0], wheels[1][1], 0.0, motor)
    distance, turn = body(right, left, contact)
    speed, rate = body(right_speed, left_speed, contact)
    after = moved(pose, distance, 0.0, turn)
    size = surroundings.resolution
    near = (distance != 0.0 or turn != 0.0) and not is_clear(
        surroundings.clear, (after[0] - surroundings.x) / size, (after[1] - surroundings.y) / size
    )
    return (
        after,
        (right, left),
        (right_speed, left_speed),
        (speed, rate, (speed - before[0]) / motor.dt, (rate - before[1]) / motor.dt),
        near,
    )


def warm() -> None:
    """Compile, or load from the cache, the kernels for the types they are called with."""
    pose, pair, motor, contact = (
        (0.0, 0.0, 0.0),
        (0.1, 0.1),
        Motor(0.0, 1.0, 0.01, 1.0, 0.5),
        Contact(0.1, 0.1, 1.0, 1.0),
    )
    wheel(1.0, 0.0, 0.0, motor)
    body(0.0, 0.0, contact)
    moved(pose, 0.0, 0.0, 0.0)
    roll(pose, (pair, pair), pair, contact, motor, Surroundings(np.zeros((1, 1), np.bool_), 0.0, 0.0, 1.0))
