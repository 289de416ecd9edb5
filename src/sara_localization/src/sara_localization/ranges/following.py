"""Frames of the dead reckoning in the map, (x, y, yaw; m, rad), and how one follows another no faster than a rider can
bear.
"""

from __future__ import annotations

import math

from sara_common.planar import compose, wrap_exact

Frame = tuple[float, float, float]


def frame_of(pose: Frame, here: Frame) -> Frame:
    """The frame in which `here`, the robot by dead reckoning, is a pose in the map."""
    yaw = wrap_exact(pose[2] - here[2])
    c, s = math.cos(yaw), math.sin(yaw)
    return pose[0] - c * here[0] + s * here[1], pose[1] - s * here[0] - c * here[1], yaw


def lag(shown: Frame, wanted: Frame, here: Frame) -> Frame:
    """How far (m, m, rad) the robot, at `here` by dead reckoning, is in one frame from where it is in another."""
    a, b = compose(shown, here), compose(wanted, here)
    return b[0] - a[0], b[1] - a[1], wrap_exact(b[2] - a[2])


def followed(shown: Frame, wanted: Frame, here: Frame, most: tuple[float, float]) -> Frame:
    """The frame `shown` moved towards another so far that the robot moves by `most` (m, rad) at the most."""
    dx, dy, turn = lag(shown, wanted, here)
    share = min(1.0, most[0] / max(math.hypot(dx, dy), 1e-12), most[1] / max(abs(turn), 1e-12))
    if share == 1.0:
        return wanted
    x, y, yaw = compose(shown, here)
    return frame_of((x + share * dx, y + share * dy, wrap_exact(yaw + share * turn)), here)
