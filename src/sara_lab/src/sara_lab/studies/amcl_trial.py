"""Our amcl put to the C++ node's tests, in lockstep: where it says that the robot is when each test ends."""

from __future__ import annotations

import math
from bisect import bisect_right
from functools import cache
from typing import Any

import numpy as np

from sara_bringup.lockstep.corrected import range_map
from sara_common.planar import between, compose, inverse
from sara_lab.studies.amcl_drives import AmclTest, Pose, Told, map_file
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.amcl import Amcl
from sara_localization.particles.amcl_config import AmclConfig
from sara_localization.particles.scan_input import ScanInput
from sara_localization.ranges.range_data import RangeMap
from sara_nav.maps.map_io import load_map
from sara_sim.robot.recording import Moment
from sara_sim.world.world import World


@cache
def maps() -> tuple[World, RangeMap]:
    """What the tests' robot meets, and what the filter knows."""
    return World.from_yaml(map_file()), range_map(load_map(map_file()), AmclConfig.map_occupied_above)


class Track:
    """Poses (x, y, yaw; m, rad) by their times (s), which only grow. start: the pose at 0 s."""

    def __init__(self, start: Pose = (0.0, 0.0, 0.0)) -> None:
        self._times, self._poses = [0.0], [start]

    def add(self, t: float, pose: Pose) -> None:
        """The pose at t."""
        self._times.append(t)
        self._poses.append(pose)

    def at(self, t: float) -> Pose:
        """Between the poses before and after t; the last one from its time on."""
        after = bisect_right(self._times, t)
        if after == len(self._times):
            return self._poses[-1]
        (t0, t1), (a, b) = self._times[after - 1 : after + 1], self._poses[after - 1 : after + 1]
        return between(a, b, (t - t0) / (t1 - t0))


class Localised:
    """An Amcl that is given what a test's robot measures, as its node gives it: each scan with the odometry of its
    time. seed: of the particles.
    """

    def __init__(self, test: AmclTest, world_map: RangeMap, seed: int) -> None:
        self._track, self._told = Track(), list(test.told)
        self._amcl = Amcl(AmclConfig.from_params({**test.parameters, 'seed': seed}))
        self._amcl.set_map(world_map)
        if not test.told:
            self._amcl.start_anywhere()
        self._mounts = [Transform.from_xyz_rpy(s.x, s.y, s.z, 0.0, 0.0, s.yaw) for s in test.robot.scanners]
        self._correction: Pose | None = None
        self._tell(0.0)

    def on_moment(self, moment: Moment) -> list[ScanInput]:
        """What has come since the moment before; returns the scans that counted."""
        counted = []
        self._track.add(moment.t, moment.odometry)
        self._tell(moment.t)
        for number, sweep in moment.scans:
            odometry = self._track.at(sweep.stamp)
            placed = Transform.from_xyz_rpy(*odometry[:2], 0.0, 0.0, 0.0, odometry[2])
            scan = ScanInput(f'laser_{number}', sweep, self._mounts[number], placed)
            result = self._amcl.on_scan(scan)
            if result is not None and result.counted:
                counted.append(scan)
            if result is not None and result.map_from_odom is not None:
                found = result.map_from_odom
                self._correction = (*found.translation[:2], found.yaw)
        return counted

    @property
    def particles(self) -> np.ndarray:
        """(n, 3) their x, y (m) and yaw (rad) in the map."""
        return self._amcl.filter.poses

    def estimate(self) -> Pose | None:
        """map -> base_link now: the last correction after the odometry; None before there is any."""
        return None if self._correction is None else compose(self._correction, self._track.at(math.inf))

    def _tell(self, now):
        while self._told and self._told[0].at <= now + 1e-9:
            told = self._told.pop(0)
            self._amcl.set_pose(self._since(told), np.diag(told.variances))

    def _since(self, told: Told) -> Pose:
        """Where a robot has come that was at a pose at its stamp, by the odometry since."""
        if not told.stamp:
            return told.pose
        return compose(told.pose, compose(inverse(self._track.at(told.stamp)), self._track.at(math.inf)))


def trial(test: AmclTest, world: World, world_map: RangeMap, seed: int) -> dict[str, Any]:
    """{test, seed; x, y: how far the estimate is from the target along each axis, m; yaw: likewise, rad; true: its
    distance from the robot, m; known_from: s from which on it stayed within the test's tolerance of the robot, None
    where it never did; faults: what the C++ node's test would not accept}.
    """
    localised, known_from, moment = Localised(test, world_map, seed), None, None
    for moment in test.drive(world, seed):
        localised.on_moment(moment)
        known = _within(localised.estimate(), moment.truth, test.tolerance)
        known_from = (moment.t if known_from is None else known_from) if known else None
    estimate = localised.estimate()
    if estimate is None:
        return {'test': test.name, 'seed': seed, 'known_from': None, 'faults': ['there is no estimate']}
    x, y, yaw = _off(estimate, test.target)
    d, a = test.tolerance
    return {
        'test': test.name,
        'seed': seed,
        'x': x,
        'y': y,
        'yaw': yaw,
        'true': math.dist(estimate[:2], moment.truth[:2]),
        'known_from': known_from,
        'faults': [
            f'{name} is {value:.2f} {unit} off, allowed is {limit:g}'
            for name, value, unit, limit in (('x', x, 'm', d), ('y', y, 'm', d), ('yaw', yaw, 'rad', a))
            if not value <= limit
        ],
    }


def _off(estimate, pose):
    return (
        abs(estimate[0] - pose[0]),
        abs(estimate[1] - pose[1]),
        abs(math.remainder(estimate[2] - pose[2], 2.0 * math.pi)),
    )


def _within(estimate, pose, tolerance):
    if estimate is None:
        return False
    x, y, yaw = _off(estimate, pose)
    return max(x, y) <= tolerance[0] and yaw <= tolerance[1]
