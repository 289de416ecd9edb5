"""From what a client sends as a pose to a goal in the global frame, or the sentence that says what is wrong with it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from sara_common.planar import Pose2D, yaw_from_quaternion

BAD_QUATERNION = 'Aborting on goal because it was sent with an invalid quaternion'
"""The peer's words."""
MIN_SQUARED_LENGTH = 1e-6
"""Of a quaternion that stands for a direction; the peer's."""


class GoalError(ValueError):
    """A pose that cannot be used; the message says why."""


def _of_unit_length(quaternion):
    """Return (x, y, z, w) scaled to length 1, as the peer takes a goal; as it is where it is shorter than the peer's
    limit.
    """
    squared = sum(q * q for q in quaternion)
    if not MIN_SQUARED_LENGTH <= squared < math.inf:
        return quaternion
    return tuple(q / math.sqrt(squared) for q in quaternion)


def planar_pose(position: Sequence[float], orientation: Sequence[float]) -> Pose2D:
    """Return the Pose2D of a position (x, y, z) and a quaternion (x, y, z, w) of any length but nearly 0; raises
    GoalError.
    """
    try:
        yaw = yaw_from_quaternion(*_of_unit_length(orientation))
    except ValueError as error:
        raise GoalError(f'{BAD_QUATERNION}: {error}') from None
    if not all(math.isfinite(v) for v in position):
        raise GoalError('Goal refused: its position holds a NaN or an infinity')
    return Pose2D(float(position[0]), float(position[1]), yaw)


def global_pose(
    frame: str,
    position: Sequence[float],
    orientation: Sequence[float],
    global_frame: str,
    find: Callable[[str], Pose2D],
) -> Pose2D:
    """Return the Pose2D in ``global_frame`` of a pose given in ``frame``; raises GoalError.

    find: called with another frame than the global one; returns its Pose2D in the global frame, or raises LookupError
    or ValueError with the reason why there is none.
    """
    frame = frame.lstrip('/')
    if not frame:
        raise GoalError('Goal refused: its frame_id is empty')
    pose = planar_pose(position, orientation)
    if frame == global_frame:
        return pose
    try:
        there = find(frame)
    except (LookupError, ValueError) as error:
        raise GoalError(
            f'Goal refused: Failed to transform the goal pose from {frame} into the {global_frame} frame: {error}'
        ) from None
    return there.compose(pose)
