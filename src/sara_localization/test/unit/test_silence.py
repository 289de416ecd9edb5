"""A robot that loses its sensors stands: the estimate does not run off with the last speed, and finds the wheels' way
afterwards.
"""

import numpy as np
import pytest

from sara_common.config import ConfigError
from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.filters.state import VX, VYAW, YAW, X, Y
from sara_localization.geometry.rigid import Transform, quaternion_from_rpy
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import ImuData, OdometryData, PoseData

SPEED, SILENT_S, UNHEARD_M = 0.5, 4.0, 0.15
EYE = np.eye(6)


class Drive:
    """A robot on a line: wheels at 10 Hz (vx), an IMU at 5 Hz (yaw, vyaw), filter at 50 Hz, map -> odom given out."""

    def __init__(self, **parameters):
        params = {
            'frequency': 50,
            'two_d_mode': True,
            'world_frame': 'map',
            'predict_to_current_time': True,
            'odom0': '/odom',
            'odom0_config': [i == VX for i in range(15)],
            'imu0': '/imu',
            'imu0_config': [i in (YAW, VYAW) for i in range(15)],
            'initial_state': [2.0, 1.0] + [0.0] * 13,
            **parameters,
        }
        self.transforms, self.said = TransformBuffer(), []
        self.engine = FilterEngine(FilterConfig.from_params(params), self.transforms, self.said.append)
        self.step, self.x, self.yaw, self.output = 0, 0.0, 0.0, None

    def run(self, seconds, v=0.0, wheels=True, imu=True, rate=0.0):
        for _ in range(round(50 * seconds)):
            self.step += 1
            now = 100.0 + 0.02 * self.step
            self.x, self.yaw = self.x + 0.02 * v, self.yaw + 0.02 * rate
            if wheels and self.step % 5 == 0:
                self.transforms.set_transform('odom', 'base_link', Transform.from_xyz_rpy(x=self.x, yaw=self.yaw), now)
                self.engine.add_odometry(
                    'odom0',
                    OdometryData(
                        now,
                        'odom',
                        'base_link',
                        (self.x, 0.0, 0.0),
                        (0, 0, 0, 1),
                        EYE * 0.01,
                        (v, 0.0, 0.0),
                        (0.0, 0.0, rate),
                        EYE * 1e-4,
                    ),
                )
            if imu and self.step % 10 == 0:
                self.engine.add_imu(
                    'imu0',
                    ImuData(
                        now,
                        'base_link',
                        quaternion_from_rpy(0.0, 0.0, self.yaw),
                        np.eye(3) * 1e-4,
                        (0.0, 0.0, rate),
                        np.eye(3) * 1e-6,
                        (0.0, 0.0, 9.8),
                        np.eye(3),
                    ),
                )
            self.output = self.engine.tick(now) or self.output
            assert np.linalg.eigvalsh(self.engine.filter.P).min() > 0.0
        return self.output.state


def lost_for_a_while(**parameters):
    """State after a drive, a silence in which the robot rolled on for UNHEARD_M, and a while at rest; and where it is
    in truth.
    """
    drive = Drive(**parameters)
    drive.run(1.0)
    drive.run(4.0, SPEED)
    drive.run(SILENT_S, wheels=False, imu=False)
    drive.x += UNHEARD_M
    return drive.run(2.0), 2.0 + drive.x


def test_the_way_that_nobody_heard_is_found_again():
    state, truth = lost_for_a_while(hold_after=0.5)
    assert abs(state[X] - truth) < 0.03 and abs(state[Y] - 1.0) < 1e-3


@pytest.mark.parametrize('silent_s', (1.0, 4.0, 30.0))
def test_who_drives_on_unheard_is_not_pushed_on_by_the_first_speed_heard_again(silent_s):
    drive = Drive(hold_after=0.5)
    drive.run(4.0, SPEED)
    drive.run(silent_s, SPEED, wheels=False, imu=False)
    state = drive.run(2.0, SPEED)
    assert abs(state[X] - 2.0 - drive.x) < 0.05 and abs(state[Y] - 1.0) < 1e-3


@pytest.mark.parametrize('turned', (0.0, 1.0))
def test_odometry_that_begins_anew_after_a_silence_does_not_move_who_stood(turned):
    drive = Drive(hold_after=0.5)
    drive.run(1.0)
    drive.run(8.0, SPEED)
    drive.run(1.0, rate=turned)
    before = drive.run(1.0)
    drive.run(3.0, wheels=False)
    drive.x, imu_yaw, drive.yaw = 0.0, drive.yaw, 0.0
    drive.run(0.1, imu=False)
    drive.yaw = imu_yaw  # the IMU goes on with its own
    state = drive.run(1.0)
    assert np.abs(state[[X, Y, YAW]] - before[[X, Y, YAW]]).max() < 0.05
    assert drive.said == ['the odometry begins anew: the robot is taken to have stood meanwhile']


def test_off_by_default_the_estimate_runs_off_as_the_peer_s():
    state, truth = lost_for_a_while()
    assert abs(state[X] - truth) > 0.3


def test_it_stands_while_nothing_is_heard():
    drive = Drive(hold_after=0.5)
    before = drive.run(4.0, SPEED)[X]
    during = drive.run(10.0, wheels=False, imu=False)
    assert abs(during[X] - before) < 0.1 and during[VX] == 0.0 and during[VYAW] == 0.0


def test_wheels_alone_being_silent_hold_the_speed_and_not_the_turn():
    drive = Drive(hold_after=0.5)
    drive.run(4.0, SPEED)
    state = drive.run(3.0, wheels=False, rate=0.2)
    assert state[VX] == 0.0 and state[VYAW] == pytest.approx(0.2, abs=0.01)
    assert state[YAW] == pytest.approx(drive.yaw, abs=0.05)


def test_a_single_lost_message_holds_nothing():
    held, free = Drive(hold_after=0.5), Drive()
    for drive in (held, free):
        drive.run(4.0, SPEED)
        drive.run(0.3, SPEED, wheels=False)
        drive.run(1.0, SPEED)
    assert (held.output.state == free.output.state).all()


def test_a_position_that_comes_late_does_not_stop_who_is_heard_driving():
    drive = Drive(hold_after=0.5, pose0='/fix', pose0_config=[i in (X, Y) for i in range(15)])
    drive.run(2.0, SPEED)
    for _ in range(50):  # a fix is as late as 0.7 s
        drive.engine.add_pose('pose0', PoseData(99.3 + 0.02 * drive.step, 'map', (2.0, 1.0, 0.0), covariance=EYE * 9.0))
        assert drive.run(0.02, SPEED)[VX] == pytest.approx(SPEED, abs=0.05)


@pytest.mark.parametrize('value', (-1.0, 'soon', float('nan')))
def test_a_wrong_time_is_refused_by_name(value):
    with pytest.raises(ConfigError, match='hold_after'):
        FilterConfig.from_params({'hold_after': value})
