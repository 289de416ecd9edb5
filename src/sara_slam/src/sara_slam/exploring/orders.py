"""What exploring does, and what it orders."""

from __future__ import annotations

import enum
from typing import NamedTuple

from sara_common.planar import Pose2D


class State(enum.Enum):
    """What is going on."""

    EXPLORING = 'exploring'
    RETURNING = 'returning'
    PAUSED = 'paused'
    DONE = 'done'


class Drive(NamedTuple):
    """The order to drive to a pose (m, rad) instead of wherever else."""

    pose: Pose2D


class Stop(NamedTuple):
    """The order to give up the goal under way."""
