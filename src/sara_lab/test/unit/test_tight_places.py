"""Tight places: the body fits into each, and what a visit tells; the campaign drives them all."""

import pytest

from sara_lab.journeys import tight_places
from sara_lab.journeys.tight_places import places, visit


@pytest.mark.parametrize('name', places())
def test_the_body_fits_in_and_out_either_way_round(name):
    assert places()[name].fits() and places()[name].mirrored().fits()


def test_a_bend_of_95_cm_is_too_tight():
    assert not tight_places._junction(0.95, 0.0).fits()


def test_a_junction_of_110_cm_is_entered_and_left():
    seen = visit('t_junction_1.10', 'true', 3)
    assert seen.faults == [] and seen.came_out and seen.recoveries == 0
    assert seen.judgement.seconds < 90.0


def test_where_it_does_not_get_in_it_says_why(monkeypatch):
    monkeypatch.setitem(places(), 'bend_0.95', tight_places._junction(0.70, 0.0))
    seen = visit('bend_0.95', 'true', 0, navigation={'ask_for_help': {'patience': 5.0}})
    assert not seen.went_in and not seen.came_out and seen.contacts == ()
    assert [fault.split(':')[0] for fault in seen.faults] == ['went not in']
    assert seen.to_json()['faults'] == seen.faults
