"""Turns in place: gentle, onto the heading, and over where what follows takes up the rest."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import wrap
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_turn import REACHED, SmoothTurn

CONFIG, DT = RotateThenPursueConfig(), 0.05


def turned(angle, pushed=0.0, enough=0.0, seconds=60.0):
    """Headings (rad) and rates (rad/s) of a turn from 0 that does what it is told, and is pushed on by so much (rad,
    with the turn) when it has come to rest.
    """
    turn, heading, rate, left = SmoothTurn(angle, enough), 0.0, 0.0, pushed
    headings, rates = [], []
    for _ in range(round(seconds / DT)):
        rate_before, rate = rate, turn.rate(wrap(angle - heading), rate, 1.0, CONFIG.max_vel_theta, CONFIG, DT)
        heading += rate * DT
        headings.append(heading)
        rates.append(rate)
        if rate == 0.0 and rate_before != 0.0 and left:
            heading, left = heading + math.copysign(1.0, angle) * left, 0.0
        elif rate == rate_before == 0.0:
            return headings, rates
    raise AssertionError('a turn that never ends')


@given(st.floats(0.05, 3.1), st.sampled_from((-1.0, 1.0)))
@settings(max_examples=100)
def test_it_ends_on_the_heading_within_its_limits(angle, sense):
    headings, rates = turned(sense * angle)
    assert headings[-1] == pytest.approx(sense * angle, abs=2.0 * REACHED)
    assert all(
        abs(b - a) <= max(CONFIG.acc_lim_theta, CONFIG.comfort_dec_theta) * DT + 0.021 for a, b in zip(rates, rates[1:])
    )
    assert all(sense * rate >= 0.0 for rate in rates)


@given(st.floats(0.3, 3.0), st.sampled_from((-1.0, 1.0)), st.floats(0.015, 0.07))
@settings(max_examples=100)
def test_one_that_went_too_far_is_turned_back_unless_that_is_near_enough(angle, sense, too_far):
    headings, rates = turned(sense * angle, too_far)
    assert headings[-1] == pytest.approx(sense * angle, abs=2.0 * REACHED) and min(sense * rate for rate in rates) < 0.0
    headings, rates = turned(sense * angle, too_far, enough=0.08)
    assert abs(headings[-1] - sense * angle) < 0.08 and min(sense * rate for rate in rates) >= 0.0
    headings, rates = turned(sense * angle, too_far + 0.1, enough=0.08)
    assert (
        headings[-1] == pytest.approx(sense * angle, abs=0.08 + REACHED) and min(sense * rate for rate in rates) < 0.0
    )


@pytest.mark.parametrize('enough, near', ((0.0, REACHED), (0.0175, REACHED), (0.08, 0.016)))
def test_one_that_stops_short_goes_on(enough, near):
    """To the heading, and where what follows takes up more, to a fifth of that."""
    headings, _ = turned(1.0, -0.05, enough=enough)
    assert headings[-1] == pytest.approx(1.0, abs=near + REACHED)
