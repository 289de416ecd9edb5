"""A Case of an experiment over ROS: a course that is driven, or the chair on the bench."""

from sara_lab.experiments import drives
from sara_lab.ros.experiments import bench_over_ros
from sara_lab.ros.experiments.course_over_ros import course_over_ros


def run_case(case, gain, speed, say):
    """A Case over ROS; what its function gives in lockstep, as far as its experiment's `figures` need it. Raises
    OverRosError.
    """
    if case.function is not drives.course_driven:
        return bench_over_ros.run_case(case, speed, say)
    return course_over_ros(case.seed, gain=gain, speed=speed, say=say, **{**case.options, 'trace': False})
