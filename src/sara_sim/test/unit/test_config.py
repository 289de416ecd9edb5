"""The numbers that published figures rest on, and that one seed means one chair."""

import dataclasses
import math

import numpy as np
import pytest

from canserial.dbc.bus import BusDescription
from sara_common.config import ConfigError
from sara_common.platforms import folders, load
from sara_sim.chair import SimulatedChair
from sara_sim.config import ChairConfig, DrawnChair
from sara_sim.world.world import World

SARA = load('sara')
REFERENCE = {
    'length': 1.08,
    'width': 0.58,
    'wheel_radius': 0.155,
    'wheel_radius_sigma': 0.005,
    'track': 0.525,
    'steps_per_turn': 64000,
    'slip_range': (1.25, 1.30),
    'motor_lag': 0.10,
    'dead_band': 0.02,
    'max_wheel_speed': 7.0,
    'gyro_scale_range': (0.920, 0.927),
    'gyro_bias': (-0.49, -0.91, -0.65),
    'gyro_bias_sigma': 0.02,
    'gyro_drift': 0.003,
    'gyro_frame_sigma': (0.0841, 0.0971, 0.0734),
    'accel_offset': (-0.9498, -0.0752, 9.5638 - 9.80665),
    'accel_sigma_low': (0.0576, 0.0365, 0.0476),
    'accel_sigma_high': (0.1097, 0.0594, 0.0628),
    'samples_per_frame': 20,
    'tilt_sigma': 1.0,
    'frame_jitter': 0.010,
    'frame_loss': 1e-4,
    'sonar_sigma': 0.01,
    'sonar_lost': 0.02,
    'sonar_steepest': 60.0,
    'sonar_cone': 60.0,
    'sonar_rays': 13,
    'sonar_limit': 6.0,
    'battery': 25.4,
    'gravity': 9.80665,
}


def test_the_reference_chair_is_pinned():
    assert dataclasses.asdict(ChairConfig.of(SARA)) == REFERENCE


def test_a_changed_chair_says_so():
    usual = ChairConfig.of()
    assert usual.changes(usual) == {}
    assert ChairConfig.of(motor_lag=0.2).changes(usual) == {'motor_lag': (0.2, usual.motor_lag)}


def test_impossible_chairs_are_named():
    with pytest.raises(ConfigError) as error:
        ChairConfig.of(
            slip_range=(1.3, 1.2), motor_lag=0.0, gyro_bias=(0.0, math.nan, 0.0), frame_jitter=-1.0, track='wide'
        )
    assert all(
        f'{name} is' in str(error.value) for name in ('slip_range', 'motor_lag', 'gyro_bias', 'frame_jitter', 'track')
    )


@pytest.mark.parametrize('robot', folders())
def test_draws_follow_the_distributions(robot):
    config = ChairConfig.of(load(robot))
    chairs = [DrawnChair.draw(config, np.random.default_rng(seed)) for seed in range(400)]
    slips = np.array([1 / chair.slip for chair in chairs])
    low, high = config.slip_range
    assert slips.min() >= low and slips.max() <= high and abs(slips.mean() - (low + high) / 2) < 0.003
    scales = np.array([chair.gyro_scale for chair in chairs])
    low, high = config.gyro_scale_range
    assert scales.min() >= low and scales.max() <= high
    biases = np.array([chair.gyro_bias for chair in chairs])
    np.testing.assert_allclose(biases.mean(0), config.gyro_bias, atol=0.004)
    np.testing.assert_allclose(biases.std(0), config.gyro_bias_sigma, rtol=0.15)
    radii = np.array([(chair.right_radius, chair.left_radius) for chair in chairs]) / config.wheel_radius
    np.testing.assert_allclose(radii.std(0), config.wheel_radius_sigma, rtol=0.15)
    assert abs(np.std([chair.roll for chair in chairs]) - config.tilt_sigma) < 0.15


def test_a_platform_that_leaves_a_number_out_is_refused():
    platform = SARA
    simulated = {name: value for name, value in platform.simulated.items() if name != 'motor_lag'} | {'motor_lug': 0.1}
    with pytest.raises(
        ConfigError, match='simulated/motor_lag is missing.*simulated/motor_lug is 0.1, but there is no'
    ):
        ChairConfig.of(dataclasses.replace(platform, simulated=simulated))


def test_another_platform_is_another_robot():
    sara, kate = (SimulatedChair(World.empty(), 0, platform=load(name)) for name in ('sara', 'kate'))
    assert (sara.config.length, sara.config.width) == (1.08, 0.58) and kate.config.steps_per_turn == 8192
    assert set(kate.box.sonars) == set(load('kate').sonars) and kate.sensors.config.imu_address == 0x69
    assert kate.motor.config.max_wheel_speed > sara.motor.config.max_wheel_speed
    heard = {name: set() for name in ('sara', 'kate')}
    for name, chair in (('sara', sara), ('kate', kate)):
        for _ in range(150):
            heard[name] |= {frame.id for frame in chair.step()}
    assert heard['sara'] & heard['kate'] == set() and BusDescription.of(load('kate')).id_of('RANGES_2') in heard['kate']
