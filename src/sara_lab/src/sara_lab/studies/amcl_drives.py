"""The tests of the C++ amcl as simulated drives: its starts, targets, tolerances, times and parameters. Nine differ in
what the robot does; three of these are there once more with the `-corrected` motion models.

Source: amcl/test/*.xml and basic_localization.py of ros-planning/navigation 1.17.3. Its bags are not to be had, so the
way between start and target is chosen here, and its robots are replaced by Stage's erratic. In three tests the filter
is told of a place 0.5 m and 0.5 rad beside the robot, as there. texas_greenroom_loop_corrected.xml gives the alphas of
`diff-corrected` to `diff`; here it has the model of its name.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import pi
from pathlib import Path
from typing import Any

from sara_bringup.paths import share
from sara_sim.robot.recording import Moment, recorded
from sara_sim.robot.robot import SimulatedRobot
from sara_sim.robot.robot_config import RobotConfig, ScannerConfig
from sara_sim.robot.script import Along, Face, Go, Motion, Script
from sara_sim.world.world import World

Pose = tuple[float, float, float]
"""x, y (m), yaw (rad)."""

BESIDE: Pose = (47.443, 21.421, -1.003)
COVARIANCE = (0.25, 0.25, (pi / 12.0) ** 2)
"""Variances of x, y (m2) and yaw (rad2) that amcl takes where it is told none."""

LASER = ScannerConfig(x=0.05, z=0.25, fov=4.7168, samples=541, range_min=0.0)
ERRATIC = RobotConfig(size=(0.35, 0.35), centre=(-0.05, 0.0), scanners=(LASER,))
REAR = ScannerConfig(x=-0.2, z=0.25, yaw=pi, fov=4.7168, samples=541, range_min=0.0)
TWO_LASERS = RobotConfig(size=(0.35, 0.35), centre=(-0.05, 0.0), scanners=(LASER, REAR))

EVERY_TEST = {
    'laser_max_beams': 30,
    'min_particles': 500,
    'max_particles': 5000,
    'kld_err': 0.05,
    'kld_z': 0.99,
    'laser_z_hit': 0.5,
    'laser_z_rand': 0.5,
    'laser_model_type': 'likelihood_field',
    'laser_likelihood_max_dist': 2.0,
    'update_min_d': 0.2,
    'update_min_a': 0.5,
    'resample_interval': 1,
}
OMNI = {
    **EVERY_TEST,
    'odom_model_type': 'omni',
    'odom_alpha1': 0.2,
    'odom_alpha2': 0.2,
    'odom_alpha3': 0.8,
    'odom_alpha4': 0.2,
    'odom_alpha5': 0.1,
    'laser_z_short': 0.05,
    'laser_z_max': 0.05,
    'laser_sigma_hit': 0.2,
    'laser_lambda_short': 0.1,
    'recovery_alpha_slow': 0.0,
    'recovery_alpha_fast': 0.0,
}
DIFF = {
    **EVERY_TEST,
    'odom_model_type': 'diff',
    'odom_alpha1': 0.1,
    'odom_alpha2': 0.3,
    'odom_alpha3': 0.8,
    'odom_alpha4': 0.1,
    'laser_sigma_hit': 0.25,
    'laser_max_range': 5.0,
}
OMNI_CORRECTED = {
    **OMNI,
    'odom_model_type': 'omni-corrected',
    'odom_alpha1': 0.005,
    'odom_alpha2': 0.005,
    'odom_alpha3': 0.01,
    'odom_alpha4': 0.005,
    'odom_alpha5': 0.003,
}
DIFF_CORRECTED = {
    **DIFF,
    'odom_model_type': 'diff-corrected',
    'odom_alpha1': 0.04,
    'odom_alpha2': 0.6,
    'odom_alpha3': 0.3,
    'odom_alpha4': 0.04,
}
CORRECTED = {
    'small_loop_crazy_driving_prg': OMNI_CORRECTED,
    'texas_greenroom_loop': DIFF_CORRECTED,
    'texas_willow_hallway_loop': DIFF_CORRECTED,
}
"""Parameters of the tests that are there once more, by their names."""


def map_file() -> Path:
    """The YAML file of the tests' map."""
    return share('sara_lab') / 'data' / 'maps' / 'willow.yaml'


@dataclass(frozen=True)
class Told:
    """A pose that the filter is told at `at` s: where the robot was at `stamp` s, or is now where that is 0."""

    pose: Pose
    at: float = 0.0
    stamp: float = 0.0
    variances: tuple[float, float, float] = COVARIANCE


@dataclass(frozen=True)
class AmclTest:
    """One test. start: the robot's true pose; told: what the filter is told of it, nothing where it must search
    everywhere; target and tolerance (m, rad): where its estimate must be after so many s; motions: the way there.
    """

    name: str
    start: Pose
    told: tuple[Told, ...]
    target: Pose
    seconds: float
    motions: tuple[Motion, ...]
    tolerance: tuple[float, float] = (0.75, 0.75)
    parameters: dict[str, Any] = field(default_factory=lambda: dict(OMNI))
    robot: RobotConfig = ERRATIC

    def script(self) -> Script:
        """What the robot does: it ends at the target."""
        return Script((Go(1.0), *self.motions, Face(self.target[2])))

    def drive(self, world: World, seed: int) -> Iterator[Moment]:
        """Its Moments on a World of `map_file`."""
        return recorded(SimulatedRobot(world, self.robot, seed, self.start), self.script(), self.seconds)


HALLWAY = ((50.9, 19.2), (50.9, 29.0), (45.7, 34.2), (40.8, 33.7), (33.6, 33.4))
LOOP = ((14.8, 17.0), (15.3, 16.8), (21.5, 17.5), (21.5, 20.1), (20.9, 22.2), (21.5, 26.5), (17.7, 28.1), (15.2, 27.0))
TO_THE_KITCHEN = (Along(((49.2, 18.7), *HALLWAY, (30.9, 34.7), (30.329, 34.644)), 0.8),)
STAGE: dict[str, Any] = {
    'start': (47.943, 21.421, -0.503),
    'target': (30.329, 34.644, 3.142),
    'seconds': 90.0,
    'motions': TO_THE_KITCHEN,
}


def _told_truly(
    name: str, start: Pose, target: Pose, seconds: float, *motions: Motion, variances=COVARIANCE, **more: Any
) -> AmclTest:
    """A test whose filter is told the truth."""
    return AmclTest(name, start, (Told(start, variances=variances),), target, seconds, motions, **more)


SOUTH = ((44.9, 18.6), (26.0, 17.6), (21.8, 17.5), (21.5, 20.1), (20.9, 22.2), (21.5, 26.5), (21.0, 29.2))
BACK = ((21.3, 29.7), (21.8, 30.0), (24.2, 30.2), (26.2, 30.1), (28.8, 31.0), (32.36, 31.44))
CRAZY = (
    Go(6.0, w=1.2),
    Along(((17.2, 28.2),), 0.9),
    Go(5.0, w=-1.5),
    Along(((20.5, 27.0),), 0.9),
    Go(2.0, v=-0.4),
    Go(6.0, v=0.3, w=1.3),
    Along(((17.7, 28.1),), 0.9),
    Go(5.0, w=1.5),
    Along(((15.2, 27.0), (14.4, 25.0)), 0.9),
    Go(3.0, v=-0.3, w=0.5),
    Go(4.0, w=-1.5),
    Along(((14.05, 27.6), (14.05, 28.91)), 0.9),
)
_TESTS = (
    AmclTest('basic_localization_stage', told=(Told(BESIDE),), **STAGE),
    AmclTest('set_initial_pose', told=(Told(BESIDE, at=0.5),), **STAGE),
    AmclTest('set_initial_pose_delayed', told=(Told(BESIDE, at=0.5), Told(BESIDE, at=5.0, stamp=0.2)), **STAGE),
    AmclTest(
        'global_localization_stage',
        start=(23.5, 17.6, -3.0),
        told=(),
        target=(10.00, 9.67, 6.21),
        seconds=28.0,
        motions=(Along(((18.1, 16.9), (11.0, 16.2), (10.7, 15.6), (10.0, 9.67)), 0.95),),
        tolerance=(0.25, 0.25),
    ),
    _told_truly(
        'small_loop_prf',
        (14.099, 21.063, -0.006),
        (13.94, 23.02, 4.72),
        66.0,
        Along((*LOOP, (14.2, 23.8), (13.94, 23.02)), 0.7),
    ),
    _told_truly(
        'small_loop_crazy_driving_prg',
        (14.016, 25.75, -3.0),
        (14.05, 28.91, 4.28),
        90.0,
        *CRAZY,
        variances=(0.1, 0.1, 0.1),
    ),
    _told_truly(
        'texas_greenroom_loop',
        (14.049, 24.234, -1.517),
        (13.87, 24.07, 4.65),
        89.0,
        Along(((14.7, 20.1), *LOOP, (13.87, 24.07)), 0.7),
        parameters=DIFF,
    ),
    _told_truly(
        'texas_willow_hallway_loop',
        (31.872, 31.557, 0.0),
        (32.36, 31.44, 6.18),
        250.0,
        Along((*reversed(HALLWAY), *SOUTH, *BACK), 0.5),
        parameters=DIFF,
    ),
    _told_truly(
        'rosie_multilaser',
        (42.378, 17.730, 1.583),
        (33.12, 34.53, -0.52),
        103.5,
        Along(((44.9, 18.6), *HALLWAY, (33.12, 34.53)), 0.7),
        tolerance=(0.75, 0.4),
        robot=TWO_LASERS,
    ),
)
_AGAIN = tuple(
    replace(test, name=f'{test.name}_corrected', parameters=CORRECTED[test.name])
    for test in _TESTS
    if test.name in CORRECTED
)
AMCL_TESTS = {test.name: test for test in (*_TESTS, *_AGAIN)}
