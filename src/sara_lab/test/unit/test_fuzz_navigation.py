"""Thousands of inputs at random against move_base; and the fuzz itself notices what it looks for."""

import pytest
from steady import whole

from sara_lab.fuzz.navigation.fuzz import FuzzFailure, fuzz_move_base
from sara_lab.fuzz.navigation.fuzz_command import main
from sara_nav.goals.move_base_config import StepResult
from sara_nav.move_base import state_machine as mb
from sara_nav.move_base.robot_state import RobotState


def test_random_inputs_are_refused_or_driven_and_never_more():
    count = whole(10000, 4000)
    tally = fuzz_move_base(count, 0)
    for what in (
        'idle',
        'active',
        'aborted',
        'preempted',
        'succeeded',
        'taken',
        'refused',
        'unreadable',
        'maps',
        'bad maps',
        'bad map updates',
        'masks',
        'bad masks',
        'bad observations',
        'bad footprints',
        'bad configurations',
        'plans',
        'plans refused',
        'moving while controlling',
        'moving while clearing',
    ):
        assert tally.get(what, 0) > 0, f'never: {what}'
    assert tally['moving while controlling'] > count / 5


def test_the_same_seed_gives_the_same_commands():
    def commands():
        found = []
        fuzz_move_base(800, 3, lambda result: found.append((result.command, result.status, result.text)))
        return found

    first, second = commands(), commands()
    assert first == second and any(command != (0.0, 0.0) for command, _, _ in first)


def test_goals_that_are_not_looked_at_would_be_found(monkeypatch):
    monkeypatch.setattr(mb.MoveBase, 'refusal', lambda self, pose, t: '')
    with pytest.raises(FuzzFailure, match='was taken for a goal'):
        fuzz_move_base(3000, 0)


def test_driving_blind_would_be_found(monkeypatch):
    monkeypatch.setattr(
        RobotState, 'pose_age', lambda self, t, pose, pose_time, tolerance: None if pose is None else 0.0
    )
    with pytest.raises((FuzzFailure, ValueError, OverflowError)):
        fuzz_move_base(10000, 0)


def test_driving_with_a_silent_sensor_would_be_found(monkeypatch):
    monkeypatch.setattr(mb, 'out_of_date', lambda goal, t, stale, means: StepResult((0.1, 0.0), 'active'))
    with pytest.raises(FuzzFailure, match='it moves though .* silent'):
        fuzz_move_base(10000, 0)


def test_a_cancel_that_is_not_heard_would_be_found(monkeypatch):
    monkeypatch.setattr(mb.MoveBase, 'cancel', lambda self, t: None)
    with pytest.raises(FuzzFailure, match='should have said preempted'):
        fuzz_move_base(10000, 0)


def test_the_command_says_what_came_of_it(capsys):
    main(['--count', '300', '--seed', '2'])
    assert '300 inputs to move_base, no failure' in capsys.readouterr().out
    with pytest.raises(SystemExit):
        main(['--count', '0'])
