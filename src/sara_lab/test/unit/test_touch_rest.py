"""A chair without its driver is at rest as soon as the safety gate says so."""

import math

import numpy as np
import pytest

from sara_control.gate.comfort import Comfort, Profile
from sara_lab.fuzz.touch.rest import REST, WHEELS_S, gentle_stop_s, rest_after

PROFILE = Profile()


def drive(profile, wanted, seconds):
    """[(t, m/s)] of the gate's own Comfort: towards `wanted`, and from 0 on towards rest, for so long each."""
    comfort, rows = Comfort(profile), []
    for t in np.arange(-seconds, 6.0, 0.02):
        rows.append((float(t), comfort.step(wanted if t < 0.0 else 0.0, 0.0, 0.02)[0]))
    return rows


@pytest.mark.parametrize('wanted, seconds', [(0.8, 4.0), (0.5, 1.0), (-0.4, 0.8), (-0.3, 3.0), (0.6, 0.4)])
def test_the_gate_needs_as_long_as_its_own_rules(wanted, seconds):
    commanded = drive(PROFILE, wanted, seconds)
    rest = rest_after(0.0, commanded, commanded, PROFILE)
    assert rest.allowed - WHEELS_S - 0.2 < rest.took < rest.allowed - WHEELS_S + 0.06 and rest.wrong == ''


def test_from_full_speed_it_takes_what_the_profile_says():
    assert gentle_stop_s(PROFILE, 0.8, 0.0) == pytest.approx(2.0 * math.sqrt(0.8 / 0.8), abs=0.4)
    assert gentle_stop_s(PROFILE, 0.8, 0.4) > gentle_stop_s(PROFILE, 0.8, 0.0) > gentle_stop_s(PROFILE, 0.8, -0.4)
    assert gentle_stop_s(PROFILE, 0.04, 0.0) == 0.0
    assert gentle_stop_s(PROFILE, -0.4, -0.3) == pytest.approx(gentle_stop_s(PROFILE, 0.4, 0.3))


def test_a_chair_that_goes_on_is_wrong():
    commanded = drive(PROFILE, 0.5, 3.0)
    late = [(t + 0.5, v) for t, v in commanded]
    assert 'at rest after' in rest_after(0.0, commanded, late, PROFILE).wrong
    on = [(t, max(v, 2 * REST)) for t, v in commanded]
    assert rest_after(0.0, commanded, on, PROFILE).took == math.inf
    assert rest_after(0.0, commanded, commanded[:100], PROFILE).took == math.inf


def test_a_chair_that_rests_and_moves_again_is_not_at_rest():
    commanded = drive(PROFILE, 0.5, 3.0)
    again = [(t, 0.2 if 4.0 < t < 4.1 else v) for t, v in commanded]
    assert rest_after(0.0, commanded, again, PROFILE).took == pytest.approx(4.1, abs=0.03)
