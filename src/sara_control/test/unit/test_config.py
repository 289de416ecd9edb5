"""Settings: the peer's names and defaults, faults named all at once, geometry from the URDF."""

import pytest

from sara_common.config import ConfigError
from sara_control.wheels.config import ControllerConfig, unknown
from sara_control.wheels.urdf import UrdfError, WheelGeometry

PARAMS = {
    'wheel_separation': 0.525,
    'wheel_radius': 0.155,
    'left_wheel': 'left_wheel',
    'right_wheel': ['right_wheel'],
    'pose_covariance_diagonal': [0.0] * 6,
    'twist_covariance_diagonal': [1] * 6,
}
WHEEL = '<link name="{0}"><collision><geometry>{1}</geometry></collision></link>'
JOINT = '<joint name="{0}_wheel"><parent link="{3}"/><child link="{0}"/><origin xyz="{1} {2} 0.1"/></joint>'


def urdf(left='<cylinder radius="0.11" length="0.05"/>', right_parent='base', y=0.25):
    return (
        '<robot name="r"><link name="base"/>'
        + WHEEL.format('left', left)
        + WHEEL.format('right', '<box size="1 1 1"/>')
        + JOINT.format('left', 0, y, 'base')
        + JOINT.format('right', 0, -y, right_parent)
        + '</robot>'
    )


def without(*names, **changes):
    return {name: value for name, value in {**PARAMS, **changes}.items() if name not in names}


def test_defaults_are_the_peers():
    config = ControllerConfig.from_params(PARAMS)
    names = {
        'publish_rate': 50.0,
        'open_loop': False,
        'wheel_separation_multiplier': 1.0,
        'left_wheel_radius_multiplier': 1.0,
        'right_wheel_radius_multiplier': 1.0,
        'velocity_rolling_window_size': 10,
        'cmd_vel_timeout': 0.5,
        'allow_multiple_cmd_vel_publishers': True,
        'base_frame_id': 'base_link',
        'odom_frame_id': 'odom',
        'enable_odom_tf': True,
        'publish_cmd': False,
        'publish_wheel_joint_controller_state': False,
    }
    assert {name: getattr(config, name) for name in names} == names
    assert config.left_joints == ('left_wheel',) and config.right_joints == ('right_wheel',)
    limits = config.linear_limits
    assert (limits.velocity, limits.acceleration, limits.jerk) == (None, None, None) and config.angular_limits == limits


def test_multipliers_scale_the_geometry_and_the_common_one_wins():
    config = ControllerConfig.from_params(
        {
            **PARAMS,
            'wheel_separation_multiplier': 2.0,
            'wheel_radius_multiplier': 0.5,
            'left_wheel_radius_multiplier': 3.0,
        }
    )
    assert config.separation == 1.05 and config.radii == (0.0775, 0.0775)


def test_faults_are_named_all_at_once():
    with pytest.raises(ConfigError, match='wheel_radius is -1.*twist_covariance_diagonal is .*six.*right_wheel is'):
        ControllerConfig.from_params(
            {**PARAMS, 'wheel_radius': -1, 'twist_covariance_diagonal': [1.0], 'right_wheel': []}
        )
    with pytest.raises(ConfigError, match='pose_covariance_diagonal is missing.*publish_rate is -5'):
        ControllerConfig.from_params(without('pose_covariance_diagonal', publish_rate=-5))


@pytest.mark.parametrize(
    'changes, sentence',
    [
        ({'left_wheel': ['a', 'b']}, 'left_wheel has 2 joints and right_wheel 1'),
        ({'left_wheel': []}, r"left_wheel is \[\], allowed is a joint's name"),
        ({'left_wheel': 'right_wheel'}, 'name a joint twice'),
        ({'left_wheel': 3}, 'left_wheel is 3'),
        ({'wheel_radius': 0}, 'wheel_radius is 0, allowed are numbers above 0'),
        ({'wheel_separation': 'wide'}, "wheel_separation is 'wide'"),
        ({'wheel_separation': True}, 'wheel_separation is True'),
        ({'pose_covariance_diagonal': [-1, 0, 0, 0, 0, 0]}, 'six numbers of 0 or more'),
        ({'velocity_rolling_window_size': 0}, 'whole numbers of 1 or more'),
        ({'cmd_vel_timeout': 0.0}, 'cmd_vel_timeout is 0.0'),
        ({'open_loop': 'yes'}, "open_loop is 'yes', allowed are true and false"),
        ({'stop_deceleration': 0.0}, 'stop_deceleration is 0.0'),
        ({'odom_frame_id': ''}, 'odom_frame_id'),
    ],
)
def test_bad_values_are_named(changes, sentence):
    with pytest.raises(ConfigError, match=sentence):
        ControllerConfig.from_params({**PARAMS, **changes})


@pytest.mark.parametrize('side', ['left_wheel', 'right_wheel'])
def test_wheels_must_be_named(side):
    with pytest.raises(ConfigError, match=f'^{side} is missing$'):
        ControllerConfig.from_params(without(side))


@pytest.mark.parametrize('shape', ['<cylinder radius="0.11" length="0.05"/>', '<sphere radius="0.11"/>'])
def test_the_urdf_tells_what_the_parameters_do_not(shape):
    config = ControllerConfig.from_params(without('wheel_separation', 'wheel_radius'), urdf(shape))
    assert config.separation == pytest.approx(0.5) and config.radii == (0.11, 0.11)
    assert ControllerConfig.from_params(without('wheel_radius'), urdf(shape)).separation == 0.525
    assert ControllerConfig.from_params(without('wheel_separation'), urdf(shape)).radii == (0.155, 0.155)
    assert ControllerConfig.from_params(PARAMS, 'nonsense').separation == 0.525, 'nobody asked the URDF'


@pytest.mark.parametrize(
    'text, sentence',
    [
        (None, 'no robot_description'),
        ('<robot', 'not XML'),
        ('<sdf/>', 'is a <sdf>'),
        ('<robot/>', 'has no joint left_wheel'),
        (urdf('<box size="1 1 1"/>'), 'neither cylinder nor sphere'),
        (urdf('<cylinder radius="big"/>'), "radius of left is 'big'"),
        (urdf(right_parent='arm'), 'hang on two links'),
        (urdf(y=float('nan')), "origin of left_wheel is '0 nan 0.1'"),
        (urdf(y=0), 'at one place'),
    ],
)
def test_a_urdf_that_does_not_tell_is_refused(text, sentence):
    with pytest.raises(ConfigError, match=sentence):
        ControllerConfig.from_params(without('wheel_separation', 'wheel_radius'), text)


def test_separation_is_the_distance_in_space():
    text = (
        '<robot name="r">'
        + JOINT.format('left', 0.3, 0.2, 'base')
        + JOINT.format('right', 0.0, -0.2, 'base')
        + '</robot>'
    )
    assert WheelGeometry(text).separation('left_wheel', 'right_wheel') == pytest.approx(0.5)
    with pytest.raises(UrdfError, match='left'):
        WheelGeometry(text).radius('left_wheel')


def test_what_nothing_reads_is_named():
    assert unknown({**PARAMS, 'base': 'can', 'linear': {'x': {'max_jerk': 1.0}}}) == []
    assert unknown({**PARAMS, 'cmd_vel_time_out': 0.1, 'linear': {'y': {'max_velocity': 1.0}}}) == [
        'cmd_vel_time_out',
        'linear/y/max_velocity',
    ]
