"""Tables 4.1 to 4.5 on the simulated SARA: the sensor node with its chips at rest, before and after its own
calibration.
"""

import math
from functools import cache

import numpy as np
import pytest

from sara_common.platforms import load
from sara_lowlevel.config import SensorConfig
from sara_sim.chair import SimulatedChair
from sara_sim.config import ChairConfig
from sara_sim.world.world import World

SECONDS = 60
G = 9.80665
SARA = load('sara')
UNCALIBRATED = SensorConfig.of(SARA, calibrate=False)
TABLE_4_1 = (-0.9498, -0.0752, 9.5638)
TABLE_4_4 = (-0.4924, -0.9131, -0.6456)
TABLE_4_5_SIGMA = (0.0841, 0.0971, 0.0734)


@cache
def at_rest(seed, calibrate):
    """(n, 6) samples of a minute at rest: m/s2 and deg/s, each sample as the node finds it in the chip."""
    chair = SimulatedChair(World.empty(), seed, sensors=None if calibrate else UNCALIBRATED, platform=SARA)
    samples = []
    for _ in range(SECONDS * 100):
        chair.step()
        samples.append(chair.box.imu.counts)
    assert chair.sensors.state == 'running'
    return np.array(samples) / ([16384.0 / G] * 3 + [131.0] * 3)


def test_before_calibration_the_means_are_those_of_tables_4_1_and_4_4():
    """Of the chairs together: a single one's gyro biases are drawn with a sigma of 0.02 deg/s, 4 % of the table's x."""
    means = np.mean([at_rest(seed, False).mean(0) for seed in range(6)], axis=0)
    np.testing.assert_allclose(means, TABLE_4_1 + TABLE_4_4, rtol=0.05)


@pytest.mark.parametrize('seed', (0, 1, 2))
def test_before_calibration_each_chair_is_as_it_was_drawn(seed):
    chair = SimulatedChair(World.empty(), seed, power_up=True, platform=SARA).chair
    mean = at_rest(seed, False).mean(0)
    np.testing.assert_allclose(mean[:3], TABLE_4_1, rtol=0.05, atol=0.006)
    np.testing.assert_allclose(mean[3:], chair.gyro_bias, atol=0.03)


@pytest.mark.parametrize('seed', (0, 1, 2))
def test_after_calibration_the_means_are_within_the_registers_steps(seed):
    samples = at_rest(seed, True)
    mean, sigma = samples.mean(0), samples.std(0)
    assert np.all(np.abs(mean[:3] - (0.0, 0.0, G)) <= 0.02)
    # What the 20 s of the calibration could know: half a step, and three times the error of their mean.
    assert np.all(np.abs(mean[3:]) <= 0.0153 + 3.0 * sigma[3:] / math.sqrt(2000))


@pytest.mark.parametrize('seed', (0, 1, 2))
def test_sigmas_stay_those_of_the_chip(seed):
    """The thesis's rise of the accelerometer's sigma after calibration is not reproduced: an offset register adds a
    constant.
    """
    before, after = at_rest(seed, False).std(0), at_rest(seed, True).std(0)
    np.testing.assert_allclose(after, before, rtol=0.05)
    config = ChairConfig.of(SARA)
    assert np.all(before[:3] > 0.95 * np.array(config.accel_sigma_low)) and np.all(
        before[:3] < 1.05 * np.array(config.accel_sigma_high)
    )
    turns = at_rest(seed, True)[:, 3:].reshape(-1, 20, 3).mean(1)
    np.testing.assert_allclose(turns.std(0), TABLE_4_5_SIGMA, rtol=0.15)


def test_a_payload_or_a_moved_chair_is_calibrated_by_the_push_button():
    chair = SimulatedChair(World.empty(), 4)
    before = chair.sensors.offsets
    chair.calibrate()
    assert chair.sensors.state != 'running'
    for _ in range(3200):
        chair.step()
    assert chair.sensors.state == 'running' and chair.sensors.offsets is not None
    np.testing.assert_allclose(chair.sensors.offsets, before, atol=3)


def test_power_up_takes_half_a_minute_and_the_default_none():
    chair = SimulatedChair(World.empty(), 0, power_up=True)
    assert chair.sensors.state == 'starting'
    while chair.sensors.state != 'running':
        chair.step()
    assert chair.time == pytest.approx(30.3, abs=0.5)
    assert SimulatedChair(World.empty(), 0).time == 0.0
