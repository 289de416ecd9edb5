"""Parked or not, and what a parked robot tells about its sensors."""

import math

import numpy as np
import pytest
from steady import whole

from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.filters.state import VX, VYAW, YAW
from sara_localization.geometry.rigid import quaternion_from_rpy
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import ImuData, OdometryData

BIAS = -0.011  # rad/s: 0.65 deg/s, a cheap gyro


class Chair:
    """Wheels at 20 Hz, an IMU at 50 Hz with bias and noise whose yaw is integrated from its biased rate."""

    def __init__(self, seed=0, bias=BIAS, noise=0.002, imu_config=(YAW, VYAW), wheel_config=(VX,), **parameters):
        self.rng = np.random.default_rng(seed)
        params = {
            'frequency': 50,
            'two_d_mode': True,
            'odom0': '/odom',
            'odom0_config': [i in wheel_config for i in range(15)],
            'imu0': '/imu',
            'imu0_config': [i in imu_config for i in range(15)],
            **parameters,
        }
        self.engine = FilterEngine(FilterConfig.from_params(params), TransformBuffer())
        self.bias, self.noise = bias, noise
        self.step, self.yaw, self.imu_yaw, self.odometer = 0, 0.0, 0.3, 0.0
        self.output = None

    @property
    def now(self):
        return 1000.0 + 0.02 * self.step

    def run(self, seconds, v=0.0, turning=0.0, wheels=None, shaking=0.05):
        """turning: the true rate (rad/s); wheels: what the wheels say of it, if not the truth."""
        for _ in range(round(seconds * 50)):
            self.step += 1
            measured = turning + self.bias + self.rng.normal() * self.noise
            self.yaw += turning * 0.02
            self.imu_yaw += measured * 0.02
            self.odometer += v * 0.02
            said = turning if wheels is None else wheels
            if self.step % 3 == 0:
                self.engine.add_odometry(
                    'odom0',
                    OdometryData(
                        self.now,
                        'odom',
                        'base_link',
                        (self.odometer, 0.0, 0.0),
                        (0, 0, 0, 1),
                        np.eye(6) * 1e-3,
                        (v, 0.0, 0.0),
                        (0.0, 0.0, said),
                        np.eye(6) * 1e-4,
                    ),
                )
            self.engine.add_imu(
                'imu0',
                ImuData(
                    self.now,
                    'base_link',
                    quaternion_from_rpy(0.0, 0.0, self.imu_yaw),
                    np.eye(3) * 1e-3,
                    (self.rng.normal() * self.noise, self.rng.normal() * self.noise, measured),
                    np.eye(3) * self.noise**2,
                    tuple(self.rng.normal(size=3) * shaking + (0.0, 0.0, 9.8)),
                    np.eye(3) * 0.01,
                ),
            )
            self.output = self.engine.tick(self.now) or self.output
        return self.output.state


def test_off_by_default_a_parked_robot_drifts_with_its_imu():
    chair = Chair()
    start = chair.run(2.0)[YAW]
    assert abs(chair.run(60.0)[YAW] - start) > 0.5
    assert not chair.engine.parked


@pytest.mark.parametrize('imu_config, parked', [((YAW, VYAW), whole(600.0, 150.0)), ((VYAW,), 100.0)])
def test_parked_for_minutes_it_stays_and_then_follows_a_turn_by_hand(imu_config, parked):
    chair = Chair(imu_config=imu_config, standstill_update=True, imu0_gyro_bias='standstill')
    start = chair.run(5.0)[YAW]
    state = chair.run(parked)
    assert chair.engine.parked
    assert abs(math.degrees(state[YAW] - start)) < parked / 1200.0 and np.abs(state[:2]).max() < 0.01
    turned = math.radians(30.0)
    state = chair.run(3.0, turning=turned / 3.0, wheels=0.0)
    state = chair.run(2.0)
    assert abs(math.degrees(state[YAW] - start - turned)) < 2.0


def test_the_bias_is_learnt_while_parked_and_taken_off_while_driving():
    chair = Chair(imu_config=(VYAW,), imu0_gyro_bias='standstill')
    chair.run(20.0)
    assert chair.engine.gyro_bias('imu0')[2] == pytest.approx(BIAS, abs=5e-4)
    state = chair.run(20.0, v=0.5, turning=0.1)
    assert state[VYAW] == pytest.approx(0.1, abs=2e-3)


def test_the_bias_as_a_state_is_found_in_motion_from_wheels_that_turn_right():
    chair = Chair(imu_config=(VYAW,), wheel_config=(VX, VYAW), imu0_gyro_bias='state')
    state = chair.run(60.0, v=0.5, turning=0.2)
    assert chair.engine.gyro_bias('imu0')[2] == pytest.approx(BIAS, abs=2e-3)
    assert state[VYAW] == pytest.approx(0.2, abs=3e-3)
    assert chair.output.state.shape == (15,) and chair.output.covariance.shape == (15, 15)


def test_the_bias_as_a_state_is_found_at_standstill_without_the_wheels_turning_rate():
    chair = Chair(imu_config=(VYAW,), imu0_gyro_bias='state')
    chair.run(10.0)
    assert chair.engine.gyro_bias('imu0')[2] == pytest.approx(BIAS, abs=1e-3)


@pytest.mark.parametrize(
    'motion',
    [dict(v=0.1), dict(turning=0.1), dict(turning=0.1, wheels=0.0), dict(shaking=2.0)],
    ids=['drives', 'turns', 'is turned by hand', 'dead encoder, shaking'],
)
def test_who_moves_is_not_parked(motion):
    chair = Chair(standstill_update=True)
    chair.run(3.0)
    assert chair.engine.parked
    chair.run(1.0, **motion)
    assert not chair.engine.parked


def test_without_wheels_nobody_is_parked():
    chair = Chair(standstill_update=True)
    chair.engine.add_odometry = lambda name, data: None
    chair.engine.preprocessor._last_stamps.clear()
    for _ in range(200):
        chair.step += 1
        chair.engine.add_imu(
            'imu0', ImuData(chair.now, 'base_link', (0, 0, 0, 1), np.eye(3), (0, 0, 0), np.eye(3) * 1e-4)
        )
    assert not chair.engine.parked


def test_the_beginning_of_a_motion_is_no_bias():
    chair = Chair(imu_config=(VYAW,), imu0_gyro_bias='standstill', bias=0.0, noise=1e-4)
    chair.run(10.0)
    before = chair.engine.gyro_bias('imu0')
    chair.run(5.0, turning=0.3, wheels=0.0)
    np.testing.assert_allclose(chair.engine.gyro_bias('imu0'), before, atol=1e-4)


def test_a_yaw_that_is_set_is_no_drift():
    chair = Chair(standstill_update=True)
    chair.run(10.0)
    chair.imu_yaw += 1.0
    state = chair.run(5.0)
    assert abs(state[YAW] - chair.imu_yaw) < 0.1


def test_where_the_clock_begins_anew_so_does_the_standstill():
    """It is not waited for the old time; and a wheel sensor that has fallen silent parks nobody."""
    chair = Chair(imu0_gyro_bias='standstill', reset_on_time_jump=True)
    chair.run(5.0, v=0.5)
    chair.step -= 40_000
    chair.run(20.0)
    assert chair.engine.parked and chair.engine.gyro_bias('imu0')[2] == pytest.approx(BIAS, abs=1e-3)
    chair.step -= 40_000
    chair.engine.add_odometry = lambda *_: None
    chair.run(3.0)
    assert not chair.engine.parked


def test_an_imu_whose_clock_stands_fills_no_memory():
    chair = Chair(standstill_update=True)
    gyro = chair.engine.preprocessor.standstill.gyros['imu0']
    for _ in range(500):
        gyro.add(1.0, np.zeros(3), None, None, 0.0)
    assert len(gyro._window) == 1
