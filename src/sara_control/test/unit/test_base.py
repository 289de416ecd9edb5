"""Other robots: the example drives, and what is no base is refused with a sentence."""

import importlib
import sys
from pathlib import Path

import pytest

from sara_control.wheels.base import BaseError, WheelBase, WheelPositions, load_base
from sara_control.wheels.config import ControllerConfig
from sara_control.wheels.controller import DiffDriveController

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples'
PARAMS = {
    'wheel_separation': 0.5,
    'wheel_radius': 0.1,
    'left_wheel': 'left_wheel',
    'right_wheel': 'right_wheel',
    'pose_covariance_diagonal': [0.0] * 6,
    'twist_covariance_diagonal': [0.0] * 6,
    'ticks_per_turn': 100000,
}
CONFIG = ControllerConfig.from_params(PARAMS)


@pytest.fixture
def robots(monkeypatch):
    """The example's module, and a few robots that are none."""
    monkeypatch.syspath_prepend(EXAMPLES)
    module = importlib.import_module('my_robot')
    module.NotABase = object
    module.Broken = type(
        'Broken', (WheelBase,), {'__init__': lambda self, config, params: 1 / 0, 'read': None, 'write': None}
    )
    yield module
    del sys.modules['my_robot']


def test_the_example_drives_a_metre(robots):
    base, controller = load_base('my_robot:MyRobot', CONFIG, PARAMS), DiffDriveController(CONFIG)
    t = 0.0
    for k in range(501):
        t = 0.01 * k
        for positions in base.read(t):
            state = controller.on_wheels(*positions)
        controller.on_command(0.2, 0.1, t)
        base.write(*controller.update(t, base.may_drive), t)
    assert base.may_drive and base.state
    assert state.heading == pytest.approx(0.5, abs=0.005)
    assert state.linear == pytest.approx(0.2, abs=0.01)
    base.stop(t)
    assert base.left.speed == base.right.speed == 0.0
    assert base.read(t + 0.02)[0].left == pytest.approx(positions.left, abs=0.1), 'no leap by the last stop'


@pytest.mark.parametrize(
    'name, sentence',
    [
        ('sonar', "base is 'sonar', allowed are can and MODULE:CLASS"),
        (3, 'base is 3'),
        ('a:b:c', "base is 'a:b:c'"),
        ('no_such_module:Class', 'cannot be loaded'),
        ('my_robot:Nobody', 'cannot be loaded'),
        (':', 'cannot be loaded'),
        ('my_robot:NotABase', 'is no sara_control.wheels.base.WheelBase'),
        ('my_robot:Broken', "'my_robot:Broken' did not start: division by zero"),
    ],
)
def test_what_is_no_base_is_refused(robots, name, sentence):
    with pytest.raises(BaseError, match=sentence):
        load_base(name, CONFIG, PARAMS)


def test_joints_the_robot_does_not_have_are_refused(robots):
    config = ControllerConfig.from_params({**PARAMS, 'left_wheel': 'somewhere_else'})
    with pytest.raises(BaseError, match='name somewhere_else, but the joints of .* are left_wheel, right_wheel'):
        load_base('my_robot:MyRobot', config, PARAMS)


def test_positions_need_no_clock_of_their_own():
    controller = DiffDriveController(CONFIG)
    controller.on_wheels(*WheelPositions(0.0, 0.0, 1.0))
    assert controller.on_wheels(*WheelPositions(1.0, 1.0, 1.5)).linear == pytest.approx(0.2)
