"""A simulated robot that drives a script in lockstep: what a localiser would be given, beside the truth."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from sara_common.config import is_whole
from sara_common.scans import Sweep
from sara_sim.chips.scanner import sweep_of
from sara_sim.robot.robot import SimulatedRobot
from sara_sim.robot.robot_config import STEPS_PER_S
from sara_sim.robot.script import Script


class Moment(NamedTuple):
    """t: s. odometry, truth: (x, y, yaw) of base_link in the frames odom and map, m, rad; measured, velocity: (m/s,
    rad/s) that belong to them. scans: ((number of the scanner, Sweep), ...) that have ended since the moment before.
    """

    t: float
    odometry: tuple[float, float, float]
    truth: tuple[float, float, float]
    measured: tuple[float, float]
    velocity: tuple[float, float]
    scans: tuple[tuple[int, Sweep], ...]


def recorded(robot: SimulatedRobot, script: Script, seconds: float, rate: int = 20) -> Iterator[Moment]:
    """The Moments of a drive of so many s, `rate` in each, a divisor of STEPS_PER_S. Raises ValueError."""
    if not is_whole(rate, 1) or STEPS_PER_S % rate:
        raise ValueError(f'rate is {rate!r}, allowed are whole numbers that divide {STEPS_PER_S}')
    every, scans = STEPS_PER_S // rate, []
    for tick in range(1, round(seconds * STEPS_PER_S) + 1):
        robot.command(*script.command(robot.time, robot.pose))
        robot.step()
        for number, scan in robot.scans:
            sweep = sweep_of(scan, robot.scanners[number].optics)
            scans.append((number, sweep._replace(stamp=round(scan.stamp, 6))))  # as exact as robot.time
        if tick % every == 0:
            yield Moment(robot.time, robot.odometry.pose, robot.pose, robot.measured, robot.velocity, tuple(scans))
            scans = []
