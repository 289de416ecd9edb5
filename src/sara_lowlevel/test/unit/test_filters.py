"""Both filters settle on gravity, agree with their references, and integrate what turns."""

import math

import ahrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_lowlevel.sensor.complementary import ComplementaryFilter
from sara_lowlevel.sensor.madgwick import MadgwickFilter

angle = st.floats(-60, 60)


def gravity(roll, pitch):
    r, p = math.radians(roll), math.radians(pitch)
    return -math.sin(p), math.cos(p) * math.sin(r), math.cos(p) * math.cos(r)


@given(st.floats(-30, 30), st.floats(-30, 30), st.floats(0.5, 0.98))
def test_complementary_filter_settles_on_gravity(roll, pitch, weight):
    force = gravity(roll, pitch)
    angles = ComplementaryFilter(weight, 0.01)
    angles.update((0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    for _ in range(1000):
        angles.update(force, (0.0, 0.0, 0.0))
    # eq. 2.11 is the tilt of the y axis, not the roll of a Tait-Bryan rotation
    expected = math.degrees(math.atan2(force[1], math.hypot(force[0], force[2])))
    assert angles.roll == pytest.approx(expected, abs=1e-3)
    assert angles.pitch == pytest.approx(pitch, abs=1e-3)
    assert angles.yaw == 0.0


@given(st.floats(-30, 30), st.floats(0.001, 0.02))
def test_complementary_yaw_is_the_integral_over_real_time(rate, dt):
    angles = ComplementaryFilter(0.9, 0.01)
    for _ in range(101):
        angles.update((0.0, 0.0, 1.0), (0.0, 0.0, rate), dt)
    assert angles.yaw == pytest.approx(100 * rate * dt)


@given(angle, angle)
def test_madgwick_starts_at_the_tilt_and_holds_it(roll, pitch):
    angles = MadgwickFilter(0.033)
    for _ in range(200):
        angles.update(gravity(roll, pitch), (0.0, 0.0, 0.0), 0.01)
    # normalised, the gradient step does not fade: it hovers within beta dt of the minimum
    assert (angles.roll, angles.pitch) == (pytest.approx(roll, abs=0.1), pytest.approx(pitch, abs=0.1))
    assert angles.yaw == pytest.approx(0.0, abs=0.1)


@settings(max_examples=20)
@given(angle, angle)
def test_madgwick_comes_to_gravity_from_elsewhere(roll, pitch):
    angles = MadgwickFilter(0.5, q=(1.0, 0.0, 0.0, 0.0))
    for _ in range(1500):
        angles.update(gravity(roll, pitch), (0.0, 0.0, 0.0), 0.01)
    assert (angles.roll, angles.pitch) == (pytest.approx(roll, abs=0.8), pytest.approx(pitch, abs=0.8))


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.floats(0.001, 1.0))
def test_madgwick_is_that_of_the_ahrs_library(seed, beta):
    luck = np.random.default_rng(seed)
    q = luck.standard_normal(4)
    q /= np.linalg.norm(q)
    ours, reference = MadgwickFilter(beta, q=tuple(q)), ahrs.filters.Madgwick(frequency=100.0, gain_imu=beta)
    for _ in range(20):
        gyro, accel = luck.standard_normal(3), luck.standard_normal(3) * 10.0
        ours.update(accel, gyro, 0.01)
        q = reference.updateIMU(q, gyr=gyro, acc=accel, dt=0.01)
        assert ours.q == pytest.approx(tuple(q), abs=1e-9)


def test_madgwick_integrates_a_turn_and_a_restart_keeps_the_yaw():
    angles = MadgwickFilter(0.033)
    for _ in range(101):
        angles.update((0.0, 0.0, 1.0), (0.0, 0.0, math.radians(30.0)), 0.01)
    assert angles.yaw == pytest.approx(30.0, abs=0.01)
    angles.restart()
    angles.update(gravity(10.0, 5.0), (0.0, 0.0, 0.0), 0.01)
    assert (angles.roll, angles.pitch, angles.yaw) == pytest.approx((10.0, 5.0, 30.0), abs=0.01)


def test_without_a_force_only_the_rates_count():
    angles = MadgwickFilter(0.5, q=(1.0, 0.0, 0.0, 0.0))
    for _ in range(100):
        angles.update((0.0, 0.0, 0.0), (math.radians(20.0), 0.0, 0.0), 0.01)
    assert angles.roll == pytest.approx(20.0, abs=0.01)
    MadgwickFilter(0.1).update((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.01)
