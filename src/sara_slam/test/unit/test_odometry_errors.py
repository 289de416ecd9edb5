"""What slam_gmapping learns of the odometry: scale and delay of its ways."""

import math

import numpy as np
import pytest

from sara_common.scans import Sweep
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.scan_input import ScanInput
from sara_slam.mapping.odometry_errors import CERTAIN, Motion, OdometryErrors, along, speed_of

SCALE, DELAY = 1.02, 0.06
SIGMAS = (0.03, 0.1)


def drives(errors, count=40, sigma=0.01, scale=SCALE, delay=DELAY, seed=3):
    """From rest to rest, each in 16 motions of 0.25 m, as a robot with these errors hears them."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        speeds = 0.8 * np.minimum(1.0, np.minimum(np.arange(17), np.arange(16, -1, -1)) / 3.0)
        off = rng.normal(0.0, 0.005, 17)
        for k in range(16):
            faster = speeds[k + 1] - speeds[k]
            motion = Motion(((0.25 - delay * faster) / scale, 0.0, 0.0), faster)
            errors.heard(motion, (0.25 + off[k + 1] - off[k], 0.0, 0.0), sigma)
        errors.end_stretch()


def test_scale_and_delay_are_learned():
    errors = OdometryErrors(SIGMAS)
    drives(errors)
    assert errors.scale == pytest.approx(SCALE, abs=0.001)
    assert errors.delay == pytest.approx(DELAY, abs=0.005)
    x, y, yaw = errors.without(Motion((1.0, 0.1, 0.3), 0.5))
    assert (x, y, yaw) == pytest.approx((SCALE + 0.5 * DELAY, 0.1 * SCALE, 0.3), abs=0.004)


def test_without_uncertainty_the_odometry_is_taken_as_it_is():
    errors = OdometryErrors((0.0, 0.0))
    drives(errors)
    assert (errors.scale, errors.delay) == (1.0, 0.0)


def test_what_is_not_certain_or_turns_tells_nothing():
    errors = OdometryErrors(SIGMAS)
    drives(errors, sigma=1.1 * CERTAIN)
    for _ in range(100):
        errors.heard(Motion((0.2, 0.0, 0.25), 0.0), (0.4, 0.0, 0.25), 0.01)
    assert (errors.scale, errors.delay) == (1.0, 0.0)


def test_somebody_who_walks_along_does_not_spoil_it():
    errors = OdometryErrors(SIGMAS)
    drives(errors)
    before = errors.scale
    for _ in range(12):
        errors.heard(Motion((0.25, 0.0, 0.0), 0.0), (0.20, 0.0, 0.0), 0.01)
    assert errors.scale == before


def test_the_speed_at_a_scan():
    sweep = Sweep(1.0, -1.0, 1.0, 0.5, 0.02, 0.1, 10.0, np.ones(5))
    here, there = (Transform.from_xyz_rpy(x, 0.0, 0.0, yaw=0.0) for x in (1.0, 1.04))
    scan = ScanInput('laser', sweep, here, here, there)
    assert speed_of(scan) == pytest.approx(0.04 / sweep.duration)
    assert speed_of(scan._replace(ended=None)) == 0.0
    far = Transform.from_xyz_rpy(900.0, 0.0, 0.0, yaw=0.0)
    assert speed_of(scan._replace(ended=far)) == 0.0


def test_deviation_along_a_yaw():
    assert along(np.diag((0.04, 0.01, 1.0)), 0.0) == pytest.approx(0.2)
    assert along(np.diag((0.04, 0.01, 1.0)), 0.5 * math.pi) == pytest.approx(0.1)
