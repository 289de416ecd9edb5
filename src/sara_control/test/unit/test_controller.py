"""The controller: kinematics there and back, and everything that must stop the wheels."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sara_control.config import ConfigError, ControllerConfig, not_available
from sara_control.controller import DiffDriveController

PARAMS = {'wheel_separation': 0.525, 'wheel_radius': 0.155, 'left_wheel': 'left', 'right_wheel': ['right'],
          'pose_covariance_diagonal': [0.0] * 6, 'twist_covariance_diagonal': [1.0] * 6, 'velocity_rolling_window_size': 1}
CONFIG = ControllerConfig.from_params(PARAMS)


def driving(v=0.5, w=0.2, t=10.0, config=CONFIG):
    controller = DiffDriveController(config)
    controller.on_wheels(0.0, 0.0, t)
    controller.on_command(v, w, t)
    return controller


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_wheels_that_obey_give_back_the_command(v, w):
    controller = driving(v, w)
    left, right = controller.update(10.0)
    state = controller.on_wheels(left * 0.1, right * 0.1, 10.1)
    assert (state.linear, state.angular) == pytest.approx((v, w), abs=1e-9)


def test_the_interval_of_the_wheels_own_clock_makes_the_speed():
    controller = driving()
    state = controller.on_wheels(1.0, 1.0, 10.107, 0.1)
    assert state.linear == pytest.approx(1.55) and state.stamp == 10.107


def test_a_command_is_obeyed_for_its_timeout_and_no_longer():
    controller = driving()
    controller.on_wheels(0.0, 0.0, 10.4)
    assert controller.update(10.5) != (0.0, 0.0)
    assert controller.update(10.51) == (0.0, 0.0)
    assert controller.update(10.4) == (0.0, 0.0), 'an old command came back'


def test_without_encoders_the_wheels_stop_until_a_fresh_command_after_they_came_back():
    controller = driving()
    for k in range(1, 10):
        controller.on_command(0.5, 0.0, 10.0 + 0.1 * k)
    assert controller.update(10.5) != (0.0, 0.0)
    controller.on_command(0.5, 0.0, 10.6)
    assert controller.update(10.6) == (0.0, 0.0)
    controller.on_wheels(0.0, 0.0, 10.7)
    assert controller.update(10.7) == (0.0, 0.0)
    controller.on_command(0.5, 0.0, 10.8)
    assert controller.update(10.8) != (0.0, 0.0)


def test_before_any_encoder_nothing_moves():
    controller = DiffDriveController(CONFIG)
    controller.on_command(1.0, 0.0, 0.0)
    assert controller.update(0.0) == (0.0, 0.0)


@pytest.mark.parametrize('bad', [(math.nan, 0.0), (0.0, math.inf)])
def test_commands_that_are_not_finite_are_dropped_and_counted(bad):
    controller = driving()
    before = controller.update(10.0)
    controller.on_command(*bad, 10.0)
    assert controller.update(10.0) == before
    assert controller.counters['command_not_finite'] == 1


def test_a_clock_set_back_stops_the_wheels():
    controller = driving()
    controller.on_wheels(0.0, 0.0, 1.0)
    assert controller.update(1.0) == (0.0, 0.0)
    assert controller.on_wheels(0.0, 0.0, 1.1) is not None


@given(st.lists(st.tuples(st.sampled_from('cwu'), st.floats(), st.floats(), st.floats(0.0, 100.0)), max_size=30))
def test_no_input_makes_a_wheel_speed_that_is_not_finite(events):
    controller = DiffDriveController(CONFIG)
    for kind, a, b, t in events:
        if kind == 'c' and not (abs(a) > 1e300 or abs(b) > 1e300):
            controller.on_command(a, b, t)
        elif kind == 'w' and not (abs(a) > 1e100 or abs(b) > 1e100):
            controller.on_wheels(a, b, t)
        else:
            assert all(map(math.isfinite, controller.update(t)))


def test_repeated_positions_are_counted():
    controller = driving()
    assert controller.on_wheels(1.0, 1.0, 10.0) is None
    assert controller.counters['wheels_not_newer'] == 1


def test_multipliers_scale_the_geometry():
    config = ControllerConfig.from_params({**PARAMS, 'wheel_separation_multiplier': 2.0, 'wheel_radius_multiplier': 0.5})
    assert config.separation == 1.05 and config.radii == (0.0775, 0.0775)


def test_configuration_faults_are_named_all_at_once():
    with pytest.raises(ConfigError, match='wheel_radius is -1.*twist_covariance_diagonal is .*six.*right_wheel is'):
        ControllerConfig.from_params({**PARAMS, 'wheel_radius': -1, 'twist_covariance_diagonal': [1.0],
                                      'right_wheel': ['a', 'b']})
    with pytest.raises(ConfigError, match='wheel_separation is missing, and taking it from the URDF is not available'):
        ControllerConfig.from_params({})


def test_what_the_peer_has_and_this_has_not_is_named():
    sentences = not_available({**PARAMS, 'open_loop': True, 'linear': {'x': {'has_velocity_limits': True}}})
    assert [sentence.split()[0] for sentence in sentences] == ['open_loop', 'linear/x/has_velocity_limits']
