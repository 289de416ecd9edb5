"""A box in the only door to the goal: how it is placed, and what the chair makes of it."""

import pytest

from sara_common.platforms import chosen
from sara_lab.journeys.blocked_doors import DOOR, Attempt, attempt, placed


@pytest.mark.parametrize('number', range(20))
def test_the_box_bars_the_door_to_the_body(number):
    box, start = placed(number)
    assert (box, start) == placed(number)
    free = 0.40 + abs(box.at[0] - DOOR[0]) - 0.5 * min(box.size)  # of the door's 0.80 m, on the wider side
    assert free < chosen().body.width
    assert start[0] > DOOR[0] + 1.5, 'it comes along the corridor'


def outcome(**what):
    fine = dict(fate='stays', reached=False, late=False, text='No way.', contacts=())
    return Attempt(mode='true', number=0, recoveries=5, judgement=None, **{**fine, **what})


def test_what_is_asked_of_the_chair():
    assert outcome().faults == [] and outcome(fate='taken_away', reached=True).faults == []
    assert outcome(fate='taken_away').faults == ['not reached: No way.']
    assert outcome(late=True).faults == ['the goal does not end']
    assert outcome(contacts=('front',)).faults == ['contact: front']


@pytest.mark.parametrize('number', [4, 7])
def test_a_box_that_was_seen_is_not_forgotten_while_it_may_stand_where_no_sensor_hears_it(number):
    assert attempt('true', 'stays', number).faults == []


def test_once_the_box_is_taken_away_it_drives_through():
    assert attempt('true', 'taken_away', 0).faults == []
