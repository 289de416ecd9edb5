"""Sweeps of a moving scanner: at rest they are rigid, between two poses each ray has its own."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.planar import quaternion_from_yaw
from sara_common.scans import TransformError, shares_of, swept

REST = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
numbers = st.floats(-5.0, 5.0)


@given(st.lists(st.tuples(numbers, numbers, numbers), max_size=5), numbers, numbers, st.floats(-math.pi, math.pi))
def test_a_scanner_at_rest_gives_its_points_as_they_are(points, x, y, yaw):
    place = ((x, y, 0.0), quaternion_from_yaw(yaw))
    points = np.array(points).reshape(-1, 3)
    turn = np.array([[math.cos(yaw), -math.sin(yaw), 0.0], [math.sin(yaw), math.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    assert swept(points, np.linspace(0.0, 1.0, len(points)), place, place) == pytest.approx(
        points @ turn.T + (x, y, 0.0)
    )


@given(st.floats(0.0, 1.0), st.floats(-3.0, 3.0), numbers)
def test_a_ray_is_placed_at_its_share_of_turn_and_way(share, turn, way):
    found = swept([[1.0, 0.0, 0.5]], [share], REST, ((way, 0.0, 0.0), quaternion_from_yaw(turn)))[0]
    assert found == pytest.approx([share * way + math.cos(share * turn), math.sin(share * turn), 0.5], abs=1e-6)


def test_a_rotation_goes_the_short_way_round():
    last = ((0.0, 0.0, 0.0), tuple(-v for v in quaternion_from_yaw(0.2)))
    assert swept([[1.0, 0.0, 0.0]], [0.5], REST, last)[0] == pytest.approx([math.cos(0.1), math.sin(0.1), 0.0])


def test_shares_run_from_the_first_ray_to_the_last():
    assert shares_of([0, 270, 540], 541) == pytest.approx([0.0, 0.5, 1.0])
    assert shares_of([0], 1) == [0.0]


@pytest.mark.parametrize(
    'place', [((math.nan, 0, 0), (0, 0, 0, 1)), ((0, 0, 0), (0, 0, 0, 0)), ((0, 0, 0), (0, 0, 0, 2))]
)
def test_what_is_no_transform_is_refused(place):
    with pytest.raises(TransformError, match='is not one'):
        swept([[1.0, 0.0, 0.0]], [0.0], REST, place)
