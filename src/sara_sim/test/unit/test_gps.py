"""The simulated GPS receiver: its errors' statistics, its sentences read by the driver, and its place on the earth."""

import math
from itertools import islice

import numpy as np
import pyproj
import pytest

from nmea_navsat_driver.config import DriverConfig
from nmea_navsat_driver.receiver import DIAGONAL, FIX, NO_FIX, Fix, Receiver, Velocity
from nmea_navsat_driver.sentences import Lines
from sara_common.config import ConfigError
from sara_common.planar import Pose2D
from sara_common.platforms import chosen
from sara_sim.chair import SimulatedChair
from sara_sim.chips.gps_config import GpsConfig
from sara_sim.chips.gps_errors import GpsErrors
from sara_sim.chips.gps_receiver import GpsReceiver, Place, on_earth
from sara_sim.world.world import World

CLEAN = GpsConfig(jump_interval=0.0)
BRIEF = GpsConfig(jump_interval=0.0, correlation_time=4.0)
PERFECT = GpsConfig(jump_interval=0.0, sigma=1e-6, speed_sigma=0.0)
ALCALA = Place(40.51, -3.35)
DATE = 2026, 1, 1


def errors(config, seconds, seed=0):
    """(n, 7): east, north, up, has_fix, jumped, velocity east, north."""
    of = GpsErrors(config, seed)
    steps = [of.step() for _ in range(round(seconds * config.rate))]
    return np.array([(*step[:5], *step.velocity) for step in steps], dtype=float)


def heard(receiver, pose, velocity, seconds):
    """What the driver makes of what a receiver sends, standing there."""
    lines, driver, found = Lines(), Receiver(DriverConfig()), []
    for k in range(round(seconds * 100)):
        receiver.step(pose, velocity, 0.01 * k)
        for line in lines.feed(receiver.sent):
            found += driver.on_line(line, 1.0 + 0.01 * k)
    assert not driver.problems
    return found


def test_slow_error_has_its_deviation_and_its_correlation():
    table = errors(BRIEF, 8000.0)[:, :2]
    assert table.std() == pytest.approx(1.5, rel=0.05)
    lag = round(4.0 * BRIEF.rate)
    correlation = np.mean(table[lag:] * table[:-lag]) / table.var()
    assert correlation == pytest.approx(math.exp(-1.0), abs=0.08)
    assert np.diff(table, axis=0).std() == pytest.approx(1.5 * math.sqrt(2.0 * (1.0 - math.exp(-0.4 / 4.0))), rel=0.02)


def test_the_velocity_errs_on_its_own():
    velocity = errors(CLEAN, 4000.0)[:, 5:]
    assert velocity.std() == pytest.approx(0.05, rel=0.05)
    correlation = np.mean(velocity[1:] * velocity[:-1]) / velocity.var()
    assert correlation == pytest.approx(math.exp(-0.4), abs=0.03)
    means = velocity.reshape(-1, 25, 2).mean(axis=1)  # of 10 s
    assert means.std() == pytest.approx(0.021, rel=0.1)
    white = errors(GpsConfig(speed_correlation_time=0.0, jump_interval=0.0), 4000.0)[:, 5:]
    assert np.mean(white[1:] * white[:-1]) / white.var() == pytest.approx(0.0, abs=0.03)


def test_multipath_throws_the_velocity():
    table = errors(GpsConfig(speed_sigma=0.0), 1000.0)
    jumped = table[:, 4].astype(bool)
    assert np.hypot(*table[:, 5:].T)[jumped] == pytest.approx(0.5) and not table[~jumped, 5:].any()


def test_multipath_jumps_come_last_and_are_as_far_as_asked():
    plain, jumping = errors(CLEAN, 8000.0), errors(GpsConfig(), 8000.0)
    off = np.hypot(*(jumping - plain)[:, :2].T)
    jumped = jumping[:, 4].astype(bool)
    assert off[jumped] == pytest.approx(10.0) and not off[~jumped].any()
    began = np.flatnonzero(np.diff(jumped.astype(int)) == 1)
    assert len(began) == pytest.approx(8000.0 / 65.0, rel=0.25)
    assert jumped.sum() / CLEAN.rate / len(began) == pytest.approx(5.0, rel=0.25)


def test_outages_come_when_asked():
    has_fix = errors(GpsConfig(outage_interval=100.0, outage_duration=60.0), 320.0)[:, 3]
    assert has_fix.reshape(-1, 400).mean(axis=1) == pytest.approx([100.0 / 160.0] * 2)
    assert not has_fix[250:400].any() and has_fix[:250].all()


def test_the_same_seed_gives_the_same_errors():
    one, other, another = (errors(GpsConfig(), 100.0, seed) for seed in (1, 1, 2))
    assert (one == other).all() and (one != another).any()


def test_the_driver_reads_place_and_velocity_of_the_antenna():
    receiver = GpsReceiver(PERFECT, 0, ALCALA, Pose2D(-0.45, 0.20, 0.0), DATE)
    found = heard(receiver, (30.0, 20.0, 0.5 * math.pi), (0.5, 0.2), 2.0)
    fixes, velocities = ([m for m in found if isinstance(m, kind)] for kind in (Fix, Velocity))
    assert len(fixes) == 5 and {fix.status for fix in fixes} == {FIX}
    assert receiver.antenna == pytest.approx((29.8, 19.55))
    place = on_earth(ALCALA, *receiver.antenna)
    assert fixes[-1][2:4] == pytest.approx(place, abs=2e-8)
    # facing north: the antenna, left of the middle, is slower ahead; behind it, it swings to the right of the turn
    assert velocities[-1][1:] == pytest.approx((0.09, 0.5 - 0.2 * 0.2), abs=2e-3)


def test_it_tells_its_deviation_and_nothing_of_multipath():
    receiver = GpsReceiver(GpsConfig(jump_interval=5.0), 0, ALCALA, Pose2D(0.0, 0.0, 0.0), DATE)
    fixes = [m for m in heard(receiver, (0.0, 0.0, 0.0), (0.0, 0.0), 60.0) if isinstance(m, Fix)]
    assert {fix.variances for fix in fixes if fix.covariance_type == DIAGONAL} == {(2.25, 2.25, 9.0)}
    assert sum(fix.covariance_type == DIAGONAL for fix in fixes) == len(fixes) - 1  # GST comes behind the first GGA


def test_without_a_fix_it_says_so():
    receiver = GpsReceiver(GpsConfig(outage_interval=1.0), 0, ALCALA, Pose2D(0.0, 0.0, 0.0), DATE)
    found = heard(receiver, (0.0, 0.0, 0.0), (0.0, 0.0), 4.0)
    assert [m.status for m in found if isinstance(m, Fix)] == [FIX] * 3 + [NO_FIX] * 7
    assert sum(isinstance(m, Velocity) for m in found) == 3


def test_the_map_is_a_plane_that_touches_the_earth():
    for latitude in (-60.0, 0.0, 40.51, 75.0):
        origin = Place(latitude, -3.35)
        plane = pyproj.Transformer.from_pipeline(
            f'+proj=pipeline +step +proj=cart +ellps=WGS84 +step +proj=topocentric +ellps=WGS84 +lat_0={latitude} '
            '+lon_0=-3.35 +h_0=0'
        )
        for x, y in ((150.0, 60.0), (-150.0, -60.0)):
            there = on_earth(origin, x, y)
            assert plane.transform(there.longitude, there.latitude, 0.0)[:2] == pytest.approx((x, y), abs=1e-3)


def test_a_chair_carries_one_and_drives_the_same_with_it():
    chairs = [SimulatedChair(World.empty(), 3, gps=gps) for gps in (None, GpsConfig())]
    frames = [list(islice((chair.step() for _ in iter(int, 1)), 100)) for chair in chairs]
    assert chairs[0].gps is None and frames[0] == frames[1]
    assert chairs[1].gps.antenna == pytest.approx(chosen().gps[:2])


@pytest.mark.parametrize(
    'wrong',
    [{'rate': 3.0}, {'rate': 0.0}, {'sigma': -1.0}, {'jump': math.nan}, {'outage_duration': 0}, {'jump_speed': -1}],
)
def test_wrong_numbers_are_named(wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        GpsConfig(**wrong)
