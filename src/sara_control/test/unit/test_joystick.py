"""Axes to commands."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_control.mux.joystick import Joystick, JoystickConfig


@given(st.floats(-2, 2), st.floats(-2, 2))
def test_bounded_odd_and_silent_at_the_centre(left, forward):
    one, other = Joystick(JoystickConfig()), Joystick(JoystickConfig())
    command, mirrored = one.on_axes((left, forward), ()), other.on_axes((-left, -forward), ())
    if abs(left) <= 0.05 and abs(forward) <= 0.05:
        assert command is None
        return
    v, w = command
    assert abs(v) <= 0.4 and abs(w) <= 0.6 and mirrored == (-v, -w)
    assert v * forward >= 0.0 and w * left >= 0.0


def test_full_and_let_go():
    one = Joystick(JoystickConfig())
    assert one.on_axes((1.0, 1.0), ()) == (0.4, 0.6)
    assert one.on_axes((0.0, 0.0), ()) == (0.0, 0.0)
    assert one.on_axes((0.0, 0.0), ()) is None


def test_dead_mans_button():
    one = Joystick(JoystickConfig(deadman_button=1))
    assert one.on_axes((0.0, 1.0), (1, 0)) is None
    assert one.on_axes((0.0, 1.0), (0, 1)) == (0.4, 0.0)
    assert one.on_axes((0.0, 1.0), (0, 0)) == (0.0, 0.0)
    assert one.on_axes((0.0, 1.0), (0,)) is None and one.dropped == 1


def test_what_cannot_be_read_lets_go():
    one = Joystick(JoystickConfig())
    one.on_axes((0.0, 1.0), ())
    assert one.on_axes((0.0, math.nan), ()) == (0.0, 0.0)
    assert one.on_axes((0.0,), ()) is None and one.dropped == 2


def test_config():
    with pytest.raises(ConfigError) as error:
        JoystickConfig.from_params(
            {'max_linear': 0, 'deadzone': 1.0, 'axis_left': -1, 'deadman_button': -2, 'enabled': 1}
        )
    for part in ('max_linear is 0', 'deadzone is 1.0', 'axis_left is -1', 'deadman_button is -2', 'enabled is 1'):
        assert part in str(error.value)
    with pytest.raises(ConfigError, match='joystick/speed is 1'):
        JoystickConfig.from_params({'speed': 1})
    with pytest.raises(ConfigError, match='joystick is 3'):
        JoystickConfig.from_params(3)
