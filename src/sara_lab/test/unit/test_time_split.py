"""Each step of a drive belongs to one kind, and the kinds together make its time."""

import numpy as np
import pytest

from sara_control.gate.comfort import Profile
from sara_lab.judge.judgement import SPLIT_NAMES, Goal, Track
from sara_lab.judge.recorded_split import recorded_steps
from sara_lab.judge.time_split import KINDS, Steps, kinds_of, split

PROFILE = Profile()
CASES = {  # (true v, w), (asked), (passed), slowed, recovering
    'driving': ((0.8, 0.0), (0.8, 0.0), (0.8, 0.0), False, False),
    'planner': ((0.5, 0.0), (0.5, 0.0), (0.5, 0.0), False, False),
    'turning': ((0.01, 0.5), (0.0, 0.5), (0.0, 0.5), False, False),
    'gate': ((0.0, 0.2), (0.0, 0.5), (0.0, 0.2), True, False),
    'held': ((0.0, 0.0), (0.3, 0.0), (0.0, 0.0), True, False),
    'standing': ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0), True, False),
    'recovering': ((-0.2, 0.0), (-0.2, 0.0), (-0.1, 0.0), True, True),
}


def steps_of(*cases):
    moved, asked, passed, slowed, recovering = (np.array(column) for column in zip(*cases))
    return Steps(0.01, moved, asked, passed, slowed, recovering)


@pytest.mark.parametrize('kind', KINDS)
def test_a_steady_step_is_of_its_kind(kind):
    assert [KINDS[k] for k in kinds_of(steps_of(*[CASES[kind]] * 5), PROFILE)] == [kind] * 5


def test_a_bend_as_fast_as_across_is_allowed_is_driving_and_a_slower_one_is_the_planners():
    fast, slow = (((v, v / 0.5), (v, v / 0.5), (v, v / 0.5), False, False) for v in (0.39, 0.3))
    assert [KINDS[k] for k in kinds_of(steps_of(fast, slow), PROFILE)] == ['driving', 'planner']


@pytest.mark.parametrize('rate, kind', ((0.4, 'driving'), (0.3, 'planner'), (-0.8, 'driving'), (-0.25, 'planner')))
def test_speeding_up_and_braking_as_hard_as_allowed_is_driving(rate, kind):
    v = 0.4 + rate * 0.01 * np.arange(-20, 21)
    along = np.column_stack([v, np.zeros(41)])
    steps = Steps(0.01, along, along, along, np.zeros(41, bool), np.zeros(41, bool))
    assert KINDS[kinds_of(steps, PROFILE)[20]] == kind


def test_the_kinds_together_make_the_time():
    random = np.random.default_rng(3)
    rows = [CASES[kind] for kind in random.choice(KINDS, 500)]
    parts = split(steps_of(*rows), PROFILE)
    assert sum(parts.values()) == pytest.approx(5.0) and set(parts) == set(KINDS)
    assert tuple(SPLIT_NAMES) == KINDS


def test_a_recorded_drive_is_split_by_what_the_gate_said():
    t = 0.02 * np.arange(501)
    track = Track(t, np.column_stack([0.5 * t, 0.0 * t, 0.0 * t]), goals=(Goal((4.0, 0.0, 0.0), 1.0, 9.0, True),))
    commands = [(when, 0.5, 0.0) for when in np.arange(0.0, 10.0, 0.1)]
    said = [
        (2.0, 'The chair goes slowly because something is close in front.'),
        (5.0, 'The chair follows its commands.'),
    ]
    parts = split(recorded_steps(track, commands, commands, said), PROFILE)
    assert parts['gate'] == pytest.approx(3.0, abs=0.05) and parts['planner'] == pytest.approx(5.0, abs=0.05)
    unheard = split(recorded_steps(track, commands[:40], commands[:40], said), PROFILE)  # silent after 4.2 s
    assert unheard['gate'] == pytest.approx(2.2, abs=0.1) and sum(unheard.values()) == pytest.approx(8.0)
