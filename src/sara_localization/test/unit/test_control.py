"""What a command does before the wheels have measured it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.engine.history import MOST_COMMANDS
from sara_localization.filters.control import Control, ControlConfig
from sara_localization.filters.ekf import Ekf
from sara_localization.filters.state import AX, VX, VYAW
from sara_localization.filters.ukf import Ukf
from sara_localization.geometry.transforms import TransformBuffer

SPEEDS = st.floats(-3, 3)
CONFIG = ControlConfig((True, False, False, False, False, True), 0.2, (1.3,) * 6, (2.0,) * 6, (0.8,) * 6, (1.5,) * 6)


def control(command, stamp=1.0, config=CONFIG):
    made = Control(config)
    made.set(command, stamp)
    return made


@given(SPEEDS, SPEEDS)
def test_it_accelerates_towards_the_command_within_the_limits(speed, command):
    (a, *rest) = control([command] + [5.0] * 5).accelerations([speed] + [0.0] * 5, 1.0)
    assert a * (command - speed) >= 0.0 and rest[:4] == [0.0] * 4
    faster = abs(command) >= abs(speed) and command * speed >= 0.0
    assert abs(a) <= (1.3 if faster else 2.0)


@pytest.mark.parametrize(
    'speed, command, expected',
    [(0.0, 1.0, 0.8), (0.0, 5.0, 1.3), (1.0, 0.5, -0.75), (1.0, -1.0, -2.0), (0.5, 0.5, 0.0), (-1.0, -0.5, 0.75)],
)
def test_gains_and_limits_of_speeding_up_and_slowing_down(speed, command, expected):
    assert control([command] * 6).accelerations([speed] * 6, 1.0)[0] == pytest.approx(expected)


def test_a_command_as_old_as_the_timeout_counts_as_zero():
    moving = [1.0, 0, 0, 0, 0, 0]
    assert control([2.0] * 6).accelerations(moving, 1.19)[0] > 0.0
    assert control([2.0] * 6).accelerations(moving, 1.25)[0] == pytest.approx(-1.5)
    assert control([math.nan] * 6, 0.0).accelerations(moving, 1.2)[0] == pytest.approx(-1.5)


@pytest.mark.parametrize('make', [Ekf, Ukf])
def test_both_filters_move_with_a_command(make):
    """robot_localization's UKF computes the control and never applies it."""
    kf = make(np.eye(15) * 0.01, np.eye(15) * 0.01, control=control([1.0, 0, 0, 0, 0, 0.5]))
    for k in range(10):
        kf.predict(0.01, 1.01 + 0.01 * k)
    assert kf.x[AX] == pytest.approx(0.8, rel=0.1)
    assert kf.x[VX] == pytest.approx(0.08, rel=0.1) and kf.x[VYAW] == pytest.approx(0.04, rel=0.1)


def test_commands_without_measurements_fill_no_memory_and_bad_ones_no_log():
    said = []
    params = dict(smooth_lagged_data=True, history_length=1.0, use_control=True, control_config=[True] * 6)
    params |= {'odom0': '/odom', 'odom0_config': [i == VX for i in range(15)]}
    engine = FilterEngine(FilterConfig.from_params(params), TransformBuffer(), said.append)
    for k in range(MOST_COMMANDS + 500):
        engine.add_control(np.full(6, math.nan if k % 2 else 0.1), 100.0 + 0.01 * k)
        engine.add_control(np.full(6, 0.1), 100.0 + 0.01 * k)
    assert len(engine.history._commands) == MOST_COMMANDS
    assert said == ['a command that is not a number is ignored']
