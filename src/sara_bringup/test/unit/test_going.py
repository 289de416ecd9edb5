"""What is said on the way, and a patrol: every stop in its order, and what a place that is not reached changes."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_bringup.missions.patrol import Patrol, Progress, ended
from sara_nav.maps.places import Place

A, B, C = (Place(name, float(k), 0.0, 0.0) for k, name in enumerate('abc'))


def test_progress_says_how_far_how_fast_and_what_holds_the_chair():
    progress = Progress(Place('sofa', 3.0, 4.0, math.pi / 2), period=2.0)
    assert progress.at(10.0, 0.0, 0.0, 0.0) == '5.00 m away, at (0.00, 0.00) facing 0 deg'
    assert progress.at(11.9, 0.4, 0.0, 0.0) is None
    assert progress.at(12.0, 0.5, 0.0, -0.1).endswith('at (0.50, 0.00) facing 354 deg, 0.25 m/s')
    assert progress.at(14.0, 0.5, 0.0, -0.1, 'The chair stands still because something is close in front.').endswith(
        'standing. The chair stands still because something is close in front.'
    )
    assert progress.at(16.0, 2.95, 4.0, math.pi).startswith('there; 90 deg left to turn to the right')
    assert progress.at(18.0, 2.95, 4.0, 0.0).startswith('there; 90 deg left to turn to the left')
    assert progress.at(3.0, 2.95, 4.0, 0.0) is not None, 'a clock that was set back does not silence it'


def test_the_end_is_said_in_words():
    assert ended(A, True, '', 12.3) == 'reached a (0.00 m, 0.00 m, 0 deg) after 12 s'
    assert 'did NOT reach a' in ended(A, False, 'no way', 3.0) and ended(A, False, 'no way', 3.0).endswith('no way')
    assert 'did not say why' in ended(A, False, '', 3.0)


def drive(patrol, reached):
    """Names of the places driven to; `reached` decides of each. Ends after 50."""
    names = []
    while not patrol.done and len(names) < 50:
        names.append(patrol.visit.place.name)
        patrol.ended(reached(patrol.visit))
    return ''.join(names)


@given(st.integers(1, 4), st.integers(1, 3), st.booleans())
def test_every_stop_in_its_order_as_often_as_asked(loops, count, stop):
    patrol = Patrol((A, B, C)[:count], loops, stop)
    assert drive(patrol, lambda _: True) == 'abc'[:count] * loops
    assert patrol.done == 'finished' and patrol.all_reached and patrol.visit is None


def test_a_place_that_is_not_reached_is_passed_over_or_ends_it():
    missed = lambda visit: visit.place is not B
    going_on, stopping = Patrol((A, B, C), 2), Patrol((A, B, C), 2, stop_on_failure=True)
    assert drive(going_on, missed) == 'abcabc' and going_on.done == 'finished' and not going_on.all_reached
    assert drive(stopping, missed) == 'ab' and stopping.done.startswith('stopped: b ') and not stopping.all_reached
    assert (
        '4 of 6 stops' in going_on.summary() and 'b (1.00 m, 0.00 m, 0 deg): reached 0, missed 2' in going_on.summary()
    )


def test_for_ever_ends_with_a_round_in_vain_alone():
    patrol = Patrol((A, B), loops=0)
    assert drive(patrol, lambda visit: visit.round < 4 or visit.place is B and visit.round == 4) == 'ab' * 5
    assert 'no place was reached in round 5' in patrol.done
    assert len(drive(Patrol((A, B), loops=0), lambda _: True)) == 50


def test_a_place_may_come_twice_and_an_empty_patrol_is_none():
    patrol = Patrol((A, B, A))
    assert drive(patrol, lambda _: True) == 'aba' and 'a (0.00 m, 0.00 m, 0 deg): reached 2' in patrol.summary()
    for arguments in ((), 1), ((A,), -1):
        with pytest.raises(ValueError):
            Patrol(*arguments)
