"""A Case of an experiment over ROS: a course that is driven, or the chair on the bench."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from sara_lab.experiments import drives
from sara_lab.ros.experiments import bench_over_ros
from sara_lab.ros.experiments.course_over_ros import course_over_ros

if TYPE_CHECKING:
    from sara_lab.experiments.core import Case


def run_case(case: Case, gain: float | None, speed: float, say: Callable[[str], None]) -> dict:
    """A Case over ROS; what its function gives in lockstep, as far as its experiment's `figures` need it. Raises
    OverRosError.
    """
    if case.function is not drives.course_driven:
        return bench_over_ros.run_case(case, speed, say)
    return course_over_ros(case.seed, gain=gain, speed=speed, say=say, **{**case.options, 'trace': False})
