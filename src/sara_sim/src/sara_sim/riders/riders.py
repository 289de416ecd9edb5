"""All simulated riders by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sara_sim.riders.driving import BlindDriver, WayDriver
from sara_sim.riders.impairments import FourDirections, Jerks, Late, OneSided, Tremor
from sara_sim.riders.stick import Rider

Place = tuple[float, float]
"""x, y, m."""


class Task(NamedTuple):
    """What a rider is to drive. way: points of the way, as somebody knows it who sees all of it. goals: places on the
    way that somebody heads for who sees nothing. narrow: places where one goes slowly.
    """

    way: Sequence[Place]
    goals: Sequence[Place]
    narrow: Sequence[Place] = ()


RIDERS = {
    'expert': lambda task, seed: _knowing(task),
    'tremor': lambda task, seed: Tremor(_knowing(task), seed),
    'jerks': lambda task, seed: Jerks(_knowing(task), seed),
    'late': lambda task, seed: Late(_knowing(task)),
    'one_sided': lambda task, seed: OneSided(_knowing(task), seed),
    'four_directions': lambda task, seed: FourDirections(_knowing(task)),
    'blind': lambda task, seed: BlindDriver(task.goals),
}


def rider(name: str, task: Task, seed: int) -> Rider:
    """The rider of that name (of RIDERS) with a Task. Raises KeyError."""
    return RIDERS[name](task, seed)


def _knowing(task):
    return WayDriver(task.way, task.narrow)
