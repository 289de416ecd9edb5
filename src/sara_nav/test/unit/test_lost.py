"""Goals while the robot may be lost: the verdict, waiting, going on, giving up; no command, no recovery."""

import math
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_nav.goals.move_base_config import MoveBaseConfig
from sara_nav.move_base.lost import HELP, SILENCE, LostWatch
from sara_nav.recovery.behaviours import RecoveryStep

sys.path.append(str(Path(__file__).parent))
from test_move_base import GOAL, ZERO, Perfect, make, room  # noqa: E402  pylint: disable=wrong-import-position

CONFIG = MoveBaseConfig(lost_topic='lost_probability')


class Lost(Perfect):
    """A Perfect robot whose localization says each step how probably it is lost; None: it is silent."""

    def __init__(self, probability=0.0, **config):
        super().__init__(make(**{'lost_topic': 'lost_probability', **config}))
        self.probability, self.texts, self.helps = probability, set(), set()

    def go(self, steps, until=None):
        for _ in range(steps):
            if self.probability is not None:
                c = self.move_base.config
                self.move_base.lost.hear(self.probability, self.t, c.lost_limit, c.found_limit)
            result = super().go(1)
            self.texts.add(result.text)
            self.helps.add(result.help)
            if result.status == until:
                break
        return result


class Turning:
    """A recovery behaviour that moves the robot and never ends; counts how often it began."""

    name, begun = 'turning', 0

    def start(self, situation):
        self.begun += 1

    def update(self, situation):
        return RecoveryStep(command=(0.0, 0.3), done=False)


def test_the_verdict_has_hysteresis():
    watch, said = LostWatch(), []
    for k, probability in enumerate((0.3, 0.49, 0.5, 0.3, 0.21, 0.2, 0.3)):
        assert watch.hear(probability, 0.1 * k, 0.5, 0.2) == ''
        said.append(watch.lost)
    assert said == [False, False, True, True, True, False, False]


@given(st.floats(allow_nan=True).filter(lambda p: not 0.0 <= p <= 1.0))
def test_what_is_no_probability_is_dropped_and_does_not_end_the_silence(probability):
    watch = LostWatch()
    watch.hear(0.1, 0.0, 0.5, 0.2)
    assert 'allowed is 0 to 1' in watch.hear(probability, 5.0, 0.5, 0.2)
    assert watch.probability == 0.1 and not watch.lost and watch.silent(5.0)


def test_the_silence_begins_after_three_seconds():
    watch = LostWatch()
    assert 'silent' in watch.doubt(0.0, CONFIG)
    watch.hear(0.0, 1.0, 0.5, 0.2)
    assert watch.doubt(1.0 + SILENCE, CONFIG) == '' and 'silent' in watch.doubt(1.1 + SILENCE, CONFIG)
    watch.forget()
    assert 'silent' in watch.doubt(1.0, CONFIG)


def test_without_a_topic_nothing_is_doubted():
    watch = LostWatch()
    watch.hear(1.0, 0.0, 0.5, 0.2)
    assert watch.doubt(0.0, MoveBaseConfig()) == '' and 'lost' in watch.doubt(0.0, CONFIG)
    robot = Lost(1.0, lost_topic='')
    robot.move_base.set_goal(GOAL, 0.0)
    assert robot.go(600, 'succeeded').status == 'succeeded'


@pytest.mark.parametrize('probability', [0.9, None])
def test_on_its_way_it_stands_at_once_waits_and_goes_on(probability):
    robot = Lost()
    robot.move_base.set_goal(GOAL, 0.0)
    assert robot.go(40).command[0] > 0.3
    robot.probability = probability
    if probability is None:
        assert robot.go(int(SILENCE / 0.05) - 1).command != ZERO
        robot.go(2)
    stood = robot.go(1)
    assert (stood.status, stood.command) == ('active', ZERO) and 'lost' in stood.text
    where = robot.pose
    assert robot.go(200).command == ZERO and robot.pose.distance(where) == 0.0
    assert robot.helps == ({'', HELP} if probability else {''})
    robot.probability = 0.1
    assert robot.go(600, 'succeeded').status == 'succeeded' and robot.pose.distance(GOAL) < 0.05


def test_a_new_goal_waits_and_is_given_up_after_the_patience_of_its_own():
    robot = Lost(0.9, lost_patience=5.0)
    robot.go(200)
    assert robot.move_base.set_goal(GOAL, robot.t) == ''
    began = robot.t
    end = robot.go(400, 'aborted')
    assert (end.status, end.command) == ('aborted', ZERO)
    assert end.text == (
        'Goal aborted: the robot is probably lost (0.90 on lost_probability), for lost_patience (5.0 s).'
    )
    assert robot.t - began == pytest.approx(5.05, abs=0.06) and robot.move_base.counters.plans == 0
    assert robot.go(1).status == 'idle'


def test_a_goal_on_which_it_was_found_has_its_whole_patience_again():
    robot = Lost(0.9, lost_patience=5.0)
    robot.move_base.set_goal(GOAL, 0.0)
    for probability in (0.9, 0.0, 0.9):
        robot.probability = probability
        assert robot.go(80 if probability else 5).status == 'active'


def test_being_lost_is_no_reason_to_recover_and_ends_a_recovery():
    behaviour = Turning()
    walled = {'grid_map': room(walled=True), 'recoveries': (behaviour,)}
    robot = Lost(0.9, planner_patience=1.0, oscillation_timeout=2.0, **walled)
    robot.move_base.set_goal(GOAL, 0.0)
    assert robot.go(200).command == ZERO and behaviour.begun == 0
    robot.probability = 0.0
    assert robot.go(60).command == (0.0, 0.3) and behaviour.begun == 1
    robot.probability = 0.9
    assert robot.go(200).command == ZERO
    assert (robot.move_base.counters.recoveries, behaviour.begun) == (1, 1)


def test_a_goal_that_waits_is_cancelled():
    robot = Lost(0.9)
    robot.move_base.set_goal(GOAL, 0.0)
    robot.go(10)
    robot.move_base.cancel(robot.t)
    assert robot.go(1).status == 'preempted'


@pytest.mark.parametrize(
    'values, name',
    [
        ({'lost_limit': 1.5}, 'lost_limit'),
        ({'found_limit': math.nan}, 'found_limit'),
        ({'lost_limit': 0.1}, 'found_limit'),
        ({'lost_patience': -1.0}, 'lost_patience'),
    ],
)
def test_bad_limits_are_named(values, name):
    assert [fault for fault in MoveBaseConfig(**values).faults() if name in fault]
