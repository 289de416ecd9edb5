"""Is amcl as sure as it may be? NEES of amcl_pose (consistency.py) for robots that err as amcl's parameters say.

A filter is consistent where the world is as its models have it: e' P^-1 e of its pose is chi-square distributed with
three degrees of freedom. So each step of a robot is drawn here by amcl's motion model about the step of its odometry,
with amcl's own alphas; its ranges by amcl's laser_z_*, laser_sigma_hit and laser_lambda_short; its start by the
covariance that amcl is told. What is off then, is off because of how amcl weighs scans and draws particles.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_common.planar import compose, wrap
from sara_common.repeatable import cos_sin
from sara_common.scans import Sweep
from sara_lab.journeys.travel_cases import map_file, random_of
from sara_lab.studies.carried import MOUNT, SCANNER, TOLD, Case, Wanderer, drive, world_map
from sara_lab.studies.carrying import Pose
from sara_lab.studies.consistency import nees
from sara_localization.geometry.rigid import Transform
from sara_localization.particles import scan_kernels
from sara_localization.particles.amcl import Amcl
from sara_localization.particles.amcl_config import AmclConfig
from sara_localization.particles.motion import MotionNoise, moved
from sara_localization.particles.scan_input import ScanInput
from sara_localization.particles.scan_models import ScanModel
from sara_sim.chips.scanner import Scan, sweep_of
from sara_sim.world.world import World

STEP, STEPS = 0.25, 40  # m from scan to scan, a little more than update_min_d; steps of a drive
RANGE_STEP = 0.02  # m between the ranges of which one is drawn by the likelihood field
MOST = 1000.0
"""NEES is counted as this where it is greater: all particles are at one place, and the robot is not there."""


class Kind(NamedTuple):
    """How a group of robots is localized. parameters: of amcl that differ from its defaults. by_field: ranges are drawn
    by the likelihood field along the ray, as if that were how scanners err, not about the wall that the ray meets.
    """

    parameters: dict
    by_field: bool = False


KINDS = {
    **{name: Kind({'laser_model_type': name}) for name in ('likelihood_field', 'beam', 'likelihood_field_prob')},
    'likelihood_field_power': Kind(
        {'laser_model_type': 'likelihood_field', 'laser_likelihood_power': 5.0, 'min_particles': 500}
    ),
    'likelihood_field_prob_power': Kind(
        {'laser_model_type': 'likelihood_field_prob', 'laser_likelihood_power': 0.1, 'min_particles': 500}
    ),
    'drawn_by_field': Kind(
        {'laser_model_type': 'likelihood_field_prob', 'min_particles': 20_000, 'max_particles': 40_000}, by_field=True
    ),
}
"""`..._power`: the powers, found with other seeds, at which the covariance is as large as the errors.
`drawn_by_field`: the law that multiplies the beams' probabilities, scans drawn by it, and particles enough. It is as
near as a likelihood field comes to being consistent: its probabilities are no density, their integral along a ray
depends on the pose.
"""
SIMULATED = ('likelihood_field', 'likelihood_field_power', 'likelihood_field_prob')
"""Of KINDS those that are given the simulated robot of carried.py as well, which errs less than amcl's parameters say:
its ranges by 0.01 m, not by laser_sigma_hit.
"""


def fair(kind: Kind, name: str, number: int, steps: int = STEPS) -> list[float]:
    """NEES (up to MOST) of each amcl_pose of a drive on a map by a robot that errs as amcl's parameters say.

    number: its seed. `lost_recovery` is off: it would take ranges that err by laser_sigma_hit's 0.2 m for those of a
    lost robot.
    """
    config = AmclConfig.from_params({'seed': number, 'lost_recovery': False, **kind.parameters})
    robot, amcl = FairRobot(name, number, config, kind.by_field), Amcl(config)
    amcl.set_map(world_map(name))
    amcl.set_pose(robot.told, np.diag(np.square(TOLD)))
    found = []
    for step in range(steps):
        if step:
            robot.move()
        x, y, yaw = robot.odometry
        placed = Transform.from_xyz_rpy(x, y, 0.0, 0.0, 0.0, yaw)
        result = amcl.on_scan(ScanInput('laser', robot.sweep(float(step)), MOUNT, placed))
        if result is not None and result.pose is not None:
            error = np.array(result.pose.pose) - robot.pose
            error[2] = wrap(error[2])
            found.append(min(nees(error, result.pose.covariance), MOST))
    return found


def simulated(kind: Kind, name: str, number: int) -> list[float]:
    """The same of a drive of the simulated robot, which nobody carries away."""
    steps = drive(Case(name, number, carried=False), kind.parameters)
    return [min(step.nees, MOST) for step in steps if step.nees is not None]


class FairRobot:
    """A robot without a body that goes from scan to scan along ways between random places of a map.

    `told`: where amcl is told that it starts; `pose`: (3,) where it is; `odometry`: what it measures of that; each x,
    y, yaw, m, rad.
    """

    def __init__(self, name: str, number: int, config: AmclConfig, by_field: bool) -> None:
        self._world, self._random = World.from_yaml(map_file(name)), random_of(name, 'consistency', number)
        self._wanderer = Wanderer(name, self._world, self._random)
        self._config, self._noise = config, MotionNoise.of(config)
        self._field = ScanModel(config, world_map(name)) if by_field else None
        self.told: Pose = self._wanderer.pose()
        self.pose = np.array(self.told) + self._random.normal(size=3) * TOLD
        self.odometry: Pose = (0.0, 0.0, 0.0)
        self._way, self._passed = np.array([self.told[:2]]), 0

    def move(self) -> None:
        """The odometry turns to a point of the way and goes STEP; the robot as the motion model draws it from that."""
        x, y = self._ahead() - self.pose[:2]
        turn = float(wrap(math.atan2(y, x) - self.pose[2]))
        after = compose(self.odometry, (STEP * math.cos(turn), STEP * math.sin(turn), turn))
        self.pose = moved(self.pose[None], self.odometry, after, self._noise, self._random)[0]
        self.odometry = after

    def _ahead(self):
        """The next point of the way that is STEP or more away; where it ends, it goes on to another place."""
        while True:
            away = np.hypot(*(self._way[self._passed :] - self.pose[:2]).T)
            nearest = int(away.argmin())
            far = np.flatnonzero(away[nearest:] >= STEP)
            self._passed += nearest
            if len(far):
                return self._way[self._passed + far[0]]
            end = (*self._way[-1].tolist(), 0.0)
            found = self._wanderer.way(end, self._wanderer.pose())
            if found is not None:
                self._way = np.concatenate((self._way, found[0]))

    def sweep(self, stamp: float) -> Sweep:
        """A scan from where it is, all rays at once."""
        optics = SCANNER.optics
        x, y, yaw = compose(tuple(self.pose), (SCANNER.x, SCANNER.y, 0.0))
        rays = np.column_stack((np.full(optics.rays, x), np.full(optics.rays, y), yaw + optics.angles))
        ranges = self._about_walls(rays) if self._field is None else self._by_field(rays)
        ranges[ranges < optics.range_min], ranges[ranges > optics.range_max] = -math.inf, math.inf
        return sweep_of(Scan(stamp, ranges), optics._replace(time_increment=0.0))

    def _about_walls(self, rays):
        """(n,) each about the wall that the ray meets, short of it, without an echo or anything, by their shares."""
        c, random, count, most = self._config, self._random, len(rays), SCANNER.range_max
        walls = self._world.laser(rays, most)
        beam = c.laser_model_type == 'beam'  # the likelihood field knows of hits and of anything
        shares = np.array((c.laser_z_hit, c.laser_z_short * beam, c.laser_z_max * beam, c.laser_z_rand))
        seen = 1.0 - np.exp(-c.laser_lambda_short * np.minimum(walls, most))
        ranges = (
            walls + c.laser_sigma_hit * random.standard_normal(count),
            -np.log(1.0 - random.random(count) * seen) / c.laser_lambda_short,
            np.full(count, math.inf),
            most * random.random(count),
        )
        return np.choose(random.choice(4, count, p=shares / shares.sum()), ranges)

    def _by_field(self, rays):
        """(n,) each drawn by the likelihood field's probabilities along its ray."""
        field, most = self._field, SCANNER.range_max
        ranges = np.arange(SCANNER.range_min, most, RANGE_STEP) + RANGE_STEP * self._random.random()
        c, s = cos_sin(rays[:, 2:])
        ends = np.stack((rays[:, :1] + c * ranges, rays[:, 1:2] + s * ranges, np.zeros((len(rays), len(ranges)))), 2)
        table = field.hits + self._config.laser_z_rand / most
        here = np.zeros((1, 2))
        sums = scan_kernels.field_sums(field.place, field.squares, ends.reshape(-1, 3), here, table) - 1.0
        cumulative = np.cumsum(sums.reshape(len(rays), -1), 1)
        at = self._random.random((len(rays), 1)) * cumulative[:, -1:]
        return ranges[np.minimum((cumulative < at).sum(1), len(ranges) - 1)]
