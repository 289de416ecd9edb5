"""Scans and clouds as points: round trips, what counts as a reading, and data that is wrong."""

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_nav.costmaps import observations as obs

finite = st.floats(-50.0, 50.0, width=32)


@given(st.lists(st.floats(0.1, 9.9), min_size=1, max_size=50), st.floats(-3.0, 3.0), st.floats(0.0, 0.1))
def test_points_of_a_scan_are_at_their_ranges_and_angles(ranges, start, step):
    points = obs.scan_points(ranges, start, step, 0.05, 10.0)
    assert np.hypot(points[:, 0], points[:, 1]) == pytest.approx(ranges)
    turned = np.arctan2(points[:, 1], points[:, 0]) - (start + step * np.arange(len(ranges)))
    assert np.cos(turned) == pytest.approx(np.ones(len(ranges)))
    assert (points[:, 2] == 0.0).all()


def test_what_is_no_reading_is_left_out():
    ranges = [math.nan, 0.05, 0.1, 9.99, 10.0, math.inf, -math.inf, -1.0]
    assert len(obs.scan_points(ranges, 0.0, 0.1, 0.1, 10.0)) == 2
    with_infinity = obs.scan_points(ranges, 0.0, 0.1, 0.1, 10.0, True)
    assert np.hypot(*with_infinity[:, :2].T) == pytest.approx([0.1, 9.99, 9.9999])
    assert obs.scan_points([], 0.0, 0.1, 0.1, 10.0).shape == (0, 3)


@pytest.mark.parametrize(
    'limits', [(math.nan, 0.1, 0.1, 1.0), (0.0, math.inf, 0.1, 1.0), (0.0, 0.1, 1.0, 0.5), (0.0, 0.1, 0.0, math.inf)]
)
def test_a_scan_without_sense_is_refused(limits):
    with pytest.raises(obs.ObservationError, match='angle_min'):
        obs.scan_points([1.0], *limits)


@given(st.lists(st.tuples(finite, finite, finite), max_size=20), st.booleans(), st.booleans(), st.integers(0, 9))
def test_a_cloud_gives_back_the_points_that_were_packed(points, big_endian, double, gap):
    order, letter, size = '>' if big_endian else '<', 'd' if double else 'f', 8 if double else 4
    step = 3 * size + gap
    data = b''.join(bytes(gap) + struct.pack(order + '3' + letter, *p) for p in points)
    fields = {name: (gap + i * size, 8 if double else 7) for i, name in enumerate('xyz')}
    found = obs.cloud_points(data, obs.CloudLayout(len(points), 1, step, step * len(points), fields, big_endian))
    assert found.tolist() == [list(p) for p in points]


def test_rows_of_a_cloud_may_be_padded():
    row = struct.pack('<6f', 1, 2, 3, 4, 5, 6) + b'pad!'
    found = obs.cloud_points(row * 2, obs.CloudLayout(2, 2, 12, 28, {'x': (0, 7), 'y': (4, 7), 'z': (8, 7)}))
    assert found.tolist() == [[1, 2, 3], [4, 5, 6]] * 2


@pytest.mark.parametrize(
    'change',
    [
        dict(data=b'short'),
        dict(point_step=8),
        dict(row_step=4),
        dict(width=5),
        dict(fields={'x': (0, 7), 'y': (4, 7)}),
        dict(fields={'x': (0, 7), 'y': (4, 7), 'z': (8, 2)}),
        dict(fields={'x': (0, 7), 'y': (4, 7), 'z': (50, 7)}),
    ],
)
def test_a_cloud_without_sense_is_refused(change):
    data = change.pop('data', bytes(24))
    sound = obs.CloudLayout(2, 1, 12, 24, {'x': (0, 7), 'y': (4, 7), 'z': (8, 7)})
    with pytest.raises(obs.ObservationError, match='cloud'):
        obs.cloud_points(data, sound._replace(**change))


@given(
    st.lists(st.tuples(finite, finite, finite), min_size=2, max_size=10),
    st.tuples(finite, finite, finite),
    st.tuples(finite, finite, finite, finite),
)
def test_a_transform_keeps_distances_and_moves_the_origin(points, shift, q):
    length = math.sqrt(sum(v * v for v in q))
    if length < 1e-3:
        return
    points = np.array(points)
    moved = obs.transformed(np.vstack([[0.0, 0.0, 0.0], points]), shift, [v / length for v in q])
    assert moved[0] == pytest.approx(shift)
    assert np.linalg.norm(moved[1:] - moved[0], axis=1) == pytest.approx(np.linalg.norm(points, axis=1), abs=1e-6)


def test_a_quarter_turn():
    q = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))
    assert obs.transformed([[1.0, 0.0, 0.5]], (1.0, 2.0, 3.0), q)[0] == pytest.approx([1.0, 3.0, 3.5])


@pytest.mark.parametrize(
    'shift, q',
    [
        ((0, 0, math.nan), (0, 0, 0, 1)),
        ((0, 0, 0), (0, 0, 0, 0)),
        ((0, 0, 0), (math.nan, 0, 0, 1)),
        ((0, 0, 0), (0, 0, 0, 2)),
    ],
)
def test_a_transform_that_is_none_is_refused(shift, q):
    with pytest.raises(obs.ObservationError, match='transform'):
        obs.transformed([[0.0, 0.0, 0.0]], shift, q)
