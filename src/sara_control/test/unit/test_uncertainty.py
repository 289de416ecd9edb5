"""Variances of what was lost: more is worse, directions are right, and they cover what wheels can really do."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_control.wheels.odometry import Odometry
from sara_control.wheels.uncertainty import LossUncertainty

SEPARATION, A = 0.5, 1.5


def lost(window=1):
    return LossUncertainty(SEPARATION, A, window)


@given(
    st.floats(-math.pi, math.pi), st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.01, 2.0), st.floats(0.01, 2.0)
)
def test_more_is_worse_and_it_never_gets_better(heading, left, right, one, other):
    short, long = lost(), lost()
    short.on_unmeasured(heading, left, right, min(one, other))
    long.on_unmeasured(heading, left, right, max(one, other))
    assert all(a <= b + 1e-15 for a, b in zip(short.pose, long.pose)) and short.twist[0] <= long.twist[0]
    before = long.pose
    long.on_interval(heading, 0.1, 0.2, 0.1)
    long.on_interval(heading, 0.1, 0.1, 0.0)
    assert all(a <= b for a, b in zip(before, long.pose))


def test_a_way_that_was_lost_doubts_along_a_shape_across():
    along, across = lost(), lost()
    along.on_unmeasured(0.0, 0.5, 0.5, 0.3)
    assert along.pose[0] > 0.0 and along.pose[1] == 0.0 and along.pose[2] > 0.0
    across.on_interval(0.0, 0.5, 0.5, 0.4)
    assert across.pose[0] == pytest.approx(0.0, abs=1e-15) and across.pose[1] > 0.0 and across.pose[2] == 0.0


def test_two_wheels_err_independently():
    """Half the sum of the ways, and their difference over the track."""
    u = lost()
    u.on_lost_way(0.5 * math.pi, 0.3, 0.4)
    assert u.pose == pytest.approx((0.0, (0.3**2 + 0.4**2) / 4.0, (0.3**2 + 0.4**2) / SEPARATION**2))


def test_the_speeds_doubt_passes_with_the_window():
    u = lost(window=3)
    u.on_interval(0.0, 0.1, 0.2, 0.1)
    seen = [u.twist[0]]
    for _ in range(3):
        u.on_interval(0.0, 0.1, 0.1, 0.0)
        seen.append(u.twist[0])
    assert seen[0] > seen[1] > seen[2] > seen[3] == 0.0
    assert lost().twist == (0.0, 0.0)


def test_it_covers_wheels_that_do_what_they_may_while_nobody_looks():
    """Wheels with random accelerations up to A; half a second is not read. The true error against the doubt."""
    random = np.random.default_rng(3)
    ratios = []
    for _ in range(300):
        u = lost()
        odometry, speeds = Odometry(SEPARATION, 1.0, 1.0), random.uniform(-0.5, 0.8, 2)
        odometry.start(0.0, 0.0, 0.0)
        angles = np.zeros(2)
        u.on_unmeasured(0.0, *speeds, 0.5)
        for k in range(1, 51):
            speeds = speeds + random.uniform(-A, A, 2) * 0.01
            angles = angles + speeds * 0.01
            odometry.update(*angles, 0.01 * k)
        ratios.append((odometry.x / math.sqrt(u.pose[0]), odometry.heading / math.sqrt(u.pose[2])))
    assert np.mean(np.abs(ratios) < 2.0) > 0.95
