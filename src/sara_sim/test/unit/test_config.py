"""The numbers that published figures rest on, and that one seed means one chair."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from sara_common.config import ConfigError
from sara_sim.chips.mounting import IMU, SONARS
from sara_sim.config import ChairConfig, DrawnChair

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
    assert dataclasses.asdict(ChairConfig()) == REFERENCE


def test_a_changed_chair_says_so():
    assert ChairConfig().changes() == {}
    assert ChairConfig(motor_lag=0.2).changes() == {'motor_lag': (0.2, 0.10)}


def test_impossible_chairs_are_named():
    with pytest.raises(ConfigError) as error:
        ChairConfig(
            slip_range=(1.3, 1.2), motor_lag=0.0, gyro_bias=(0.0, math.nan, 0.0), frame_jitter=-1.0, track='wide'
        )
    assert all(
        f'{name} is' in str(error.value) for name in ('slip_range', 'motor_lag', 'gyro_bias', 'frame_jitter', 'track')
    )


def test_draws_follow_the_distributions():
    chairs = [DrawnChair.draw(ChairConfig(), np.random.default_rng(seed)) for seed in range(400)]
    slips = np.array([1 / chair.slip for chair in chairs])
    assert slips.min() >= 1.25 and slips.max() <= 1.30 and abs(slips.mean() - 1.275) < 0.003
    scales = np.array([chair.gyro_scale for chair in chairs])
    assert scales.min() >= 0.920 and scales.max() <= 0.927
    biases = np.array([chair.gyro_bias for chair in chairs])
    np.testing.assert_allclose(biases.mean(0), (-0.49, -0.91, -0.65), atol=0.004)
    np.testing.assert_allclose(biases.std(0), 0.02, rtol=0.15)
    radii = np.array([(chair.right_radius, chair.left_radius) for chair in chairs]) / 0.155
    np.testing.assert_allclose(radii.std(0), 0.005, rtol=0.15)
    assert abs(np.std([chair.roll for chair in chairs]) - 1.0) < 0.15


def test_sensors_sit_in_mirrored_pairs():
    assert len(SONARS) == 9
    for left, right in (('SDI', 'SDD'), ('SLID', 'SLDD'), ('SLIT', 'SLDT'), ('STI', 'STD')):
        a, b = SONARS[left], SONARS[right]
        assert (a.x, a.y, a.z, a.yaw) == (b.x, -b.y, b.z, -b.yaw)
    assert (IMU.x, IMU.y, IMU.z) == (0.0, -0.25, 0.40)


def test_mounts_are_those_of_the_description():
    path = Path(__file__).resolve().parents[3] / 'sara_description' / 'config' / 'geometry.yaml'
    if not path.exists():
        pytest.skip(f'{path} is absent')
    geometry = yaml.safe_load(path.read_text())
    config = ChairConfig()
    assert (config.length, config.width) == (geometry['body']['length'], geometry['body']['width'])
    assert (config.wheel_radius, config.track) == (geometry['wheel']['radius'], geometry['wheel']['track'])
    for name, mount in {**SONARS, 'imu_link': IMU}.items():
        place = geometry['ranges'].get(name) or geometry[name]
        assert (mount.x, mount.y, mount.z, math.degrees(mount.yaw)) == pytest.approx(
            [place[key] for key in ('x', 'y', 'z', 'yaw_deg')]
        )
