"""How particles move with the odometry: S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, section 5.4.

A step of the odometry is split into a turn, a way and a turn (diff), or a way, a sideways slip and a turn (omni); each
particle makes it with errors of its own. The four models are those of the C++ amcl. `diff` and `omni` take what the
book calls a variance for the standard deviation, as that node always did, so that tuned alphas keep their meaning; the
`-corrected` ones follow the book:

    diff   sigma_rot1^2  = a1 rot1^2 + a2 trans^2          omni   sigma_trans^2  = a3 trans^2 + a1 rot^2
           sigma_trans^2 = a3 trans^2 + a4 (rot1^2 + rot2^2)       sigma_rot^2    = a4 rot^2 + a2 trans^2
           sigma_rot2^2  = a1 rot2^2 + a2 trans^2                  sigma_strafe^2 = a1 rot^2 + a5 trans^2

A turn of pi before a way backward counts as none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sara_common.planar import wrap

SHORTEST_WAY = 0.01
"""m below which the direction of a step is noise: the robot turned on the spot."""


class MotionNoise(NamedTuple):
    """The model ("diff", "omni", "diff-corrected", "omni-corrected") and its five alphas."""

    model: str
    alpha1: float
    alpha2: float
    alpha3: float
    alpha4: float
    alpha5: float

    @classmethod
    def of(cls, config: object) -> MotionNoise:
        """From what has odom_model_type and odom_alpha1 to odom_alpha5."""
        return cls(config.odom_model_type, *(getattr(config, f'odom_alpha{k}') for k in range(1, 6)))

    def deviation(self, spread: float) -> float:
        """The standard deviation that the model makes of a sum of alphas times squares."""
        return math.sqrt(spread) if self.model.endswith('-corrected') else spread


def moved(
    poses: np.ndarray, before: Sequence[float], after: Sequence[float], noise: MotionNoise, rng: np.random.Generator
) -> np.ndarray:
    """(n, 3) poses (x, y, yaw; m, rad) in the map after a step of the odometry from `before` to `after`, both (x, y,
    yaw) in the odometry's frame.
    """
    dx, dy, turn = after[0] - before[0], after[1] - before[1], float(wrap(after[2] - before[2]))
    way, direction = math.hypot(dx, dy), math.atan2(dy, dx) - before[2]
    step = _omni if noise.model.startswith('omni') else _diff
    return step(poses, (way, direction, turn), noise, rng)


def _diff(poses, step, noise, rng):
    way, direction, turn = step
    first = float(wrap(direction)) if way >= SHORTEST_WAY else 0.0
    second = float(wrap(turn - first))
    square1, square2 = (min(abs(a), abs(float(wrap(a - math.pi)))) ** 2 for a in (first, second))
    errors = rng.standard_normal((3, len(poses)))
    heading = poses[:, 2] + first - errors[0] * noise.deviation(noise.alpha1 * square1 + noise.alpha2 * way**2)
    ways = way - errors[1] * noise.deviation(noise.alpha3 * way**2 + noise.alpha4 * (square1 + square2))
    yaw = heading + second - errors[2] * noise.deviation(noise.alpha1 * square2 + noise.alpha2 * way**2)
    return np.stack((poses[:, 0] + ways * np.cos(heading), poses[:, 1] + ways * np.sin(heading), wrap(yaw)), 1)


def _omni(poses, step, noise, rng):
    way, direction, turn = step
    errors = rng.standard_normal((3, len(poses)))
    ways = way + errors[0] * noise.deviation(noise.alpha3 * way**2 + noise.alpha1 * turn**2)
    slips = errors[1] * noise.deviation(noise.alpha1 * turn**2 + noise.alpha5 * way**2)
    yaw = poses[:, 2] + turn + errors[2] * noise.deviation(noise.alpha4 * turn**2 + noise.alpha2 * way**2)
    bearing = poses[:, 2] + direction
    c, s = np.cos(bearing), np.sin(bearing)
    return np.stack((poses[:, 0] + ways * c + slips * s, poses[:, 1] + ways * s - slips * c, wrap(yaw)), 1)
