"""What is right and wrong on /cmd_vel/touch when a page fails while it drives."""

import math

import pytest

from sara_lab.fuzz.touch.rest import Rest
from sara_lab.fuzz.touch.verdict import AGAIN, Limits, Trial, repeat, wrongs

SENT = {0.1: 1.0, 0.2: 1.05, 0.3: 1.10}
RIGHT = [(1.01, 0.1), (1.06, 0.2), (1.11, 0.2), (1.185, 0.0)]


def judged(heard, fault=1.07):
    return Trial(SENT, heard, fault)


def test_what_the_server_does_is_right():
    trial = judged(RIGHT)
    assert wrongs(trial) == [] and not trial.disturbed
    assert trial.oldest == pytest.approx(0.06) and trial.zero_after == pytest.approx(0.125)


@pytest.mark.parametrize(
    'heard, said',
    [
        ([*RIGHT[:2], (1.26, 0.2), (1.2, 0.0)], 'a command was published whose frame was 210 ms old'),
        ([*RIGHT[:2], (1.22, 0.0)], 'the zero came after 160 ms'),
        (RIGHT[:3], 'the zero came never'),
        ([*RIGHT, (1.2, 0.0)], '2 zeros were published'),
        ([*RIGHT, (1.2, 0.3)], '1 commands were published after the zero'),
        ([(1.06, 0.2), (1.10, 0.25), (1.12, 0.0)], 'a command was published whose frame was inf ms old'),
    ],
)
def test_each_wrong_is_said(heard, said):
    assert said in wrongs(judged(heard))


def test_limits_are_those_that_are_given():
    late = [*RIGHT[:2], (1.22, 0.0)]
    assert wrongs(judged(late), Limits(zero=0.2)) == []
    assert wrongs(judged(RIGHT), Limits(age=0.05)) and wrongs(judged(RIGHT), Limits(zero=0.1))


def test_a_zero_before_the_fault_says_nothing():
    assert judged([(1.01, 0.1), (1.02, 0.0), *RIGHT[1:]]).disturbed and judged([]).disturbed
    assert judged([]).zero_after == math.inf


def test_a_chair_that_rests_too_late_is_wrong():
    trial = judged(RIGHT)._replace(rest=Rest(0.5, 1.2, 1.1))
    assert wrongs(trial) == ['from 0.50 m/s at rest after 1.20 s, allowed are 1.10 s']
    assert wrongs(trial._replace(rest=Rest(0.5, 1.0, 1.1))) == []


def test_trials_that_say_nothing_are_made_again():
    made = iter([judged([]), judged(RIGHT), judged([*RIGHT, (1.2, 0.0)])])
    result = repeat('cut', lambda number: next(made), 2, Limits())
    assert (len(result.trials), result.disturbed, result.wrong) == (2, 1, [(3, '2 zeros were published')])
    assert 'cut: 2 times, 1 wrong; oldest command 60 ms' in result.line() and 'rest' not in result.line()
    chair = result._replace(trials=[trial._replace(rest=Rest(0.5, 1.0, 1.25)) for trial in result.trials])
    assert 'at least 0.25 s before the gate must be' in chair.line()


def test_a_machine_that_always_pauses_ends_it():
    with pytest.raises(RuntimeError, match=f'paused in {AGAIN + 1} of {AGAIN + 1}'):
        repeat('cut', lambda number: judged([]), 1, Limits())
