"""Footprints: reading, radii and padding against the peer, and what a footprint touches on a map."""

import math
import pathlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import LETHAL, UNKNOWN, Costmap
from sara_nav.grids import footprint as fp
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.grid import GridGeometry

REFERENCE = np.load(pathlib.Path(__file__).parents[1] / 'data' / 'costmap_reference.npz')
SARA = fp.parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])


def empty_map(cells=160):
    return Costmap(np.zeros((cells, cells), np.uint8), GridGeometry(cells, cells, 0.05, 0.0, 0.0))


def test_arrays_are_parsed_as_the_peer_parses_them():
    """array_parser_test of costmap_2d: numbers in any form, brackets that match, a depth of two."""
    assert fp._parse_array('[[1, 2.2], [.3, -4e4], [0,0]]') == [[1.0, 2.2], [0.3, -40000.0], [0.0, 0.0]]
    assert fp.parse_footprint('[[1 2] [3\t4], [ 5,6 ]]').tolist() == [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]


@given(st.lists(st.tuples(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0)), min_size=3, max_size=20))
def test_a_footprint_written_out_is_read_back(corners):
    assert fp.parse_footprint(str([list(c) for c in corners])).tolist() == [list(c) for c in corners]


@pytest.mark.parametrize(
    'malformed',
    [
        '[1, 2.2], [.3, -4e4], [0, 0]]',
        '[[1, 2.2], [.3, -4e4], [0, 0]',
        '[1, 2.2], [.3, -4e4], [0, 0]',
        '[1, 2.2, .3, -4e4]',
        '[[1, 2e], [3, 4], [0, 0]]',
        '[[[1, 2.2]], [[.3, -4e4]], [[0, 0]]]',
    ],
)
def test_arrays_that_are_malformed_are_refused(malformed):
    with pytest.raises(fp.FootprintError, match='footprint'):
        fp.parse_footprint(malformed)


def test_string_and_list_are_the_same():
    assert (fp.parse_footprint('[[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]]') == SARA).all()


@pytest.mark.parametrize(
    'value',
    [
        '',
        'round',
        '[[1, 2], [3]]',
        [[1, 2], [3, 4]],
        7,
        [[0, 0], [1, 'a'], [1, 1]],
        [[0, 0], [1, math.nan], [1, 1]],
        [[540, 290], [540, -290], [-540, 0]],  # in millimetres
        '__import__("os")',
    ],
)
def test_senseless_footprints_are_refused(value):
    with pytest.raises(fp.FootprintError, match='footprint'):
        fp.parse_footprint(value)


@pytest.mark.parametrize('number', range(7))
def test_radii_and_padding_are_the_peers(number):
    polygon = REFERENCE[f'poly_{number}']
    assert fp.radii(polygon) == pytest.approx(REFERENCE[f'poly_{number}_radii'], abs=1e-9)
    for padding, padded in zip(REFERENCE['paddings'], REFERENCE[f'poly_{number}_padded']):
        assert fp.pad_footprint(polygon, padding) == pytest.approx(padded, abs=1e-12)


def test_a_centre_outside_the_footprint_has_no_inscribed_circle():
    """The peer takes the distance of the outline here, and so calls cells touched that are not."""
    assert fp.radii(REFERENCE['poly_7'])[0] == 0.0


@given(st.floats(0.05, 5.0))
def test_a_circles_radii(radius):
    inscribed, circumscribed = fp.radii(fp.circle_footprint(radius))
    assert circumscribed == pytest.approx(radius)
    assert inscribed == pytest.approx(radius * math.cos(math.pi / 16))


@given(st.floats(2.0, 6.0), st.floats(2.0, 6.0), st.floats(-4.0, 4.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_any_obstacle_well_inside_is_found_and_none_well_outside(x, y, yaw, dx, dy):
    costmap = empty_map()
    at = Pose2D(x, y, yaw).compose(Pose2D(dx, dy, 0.0))
    column, row = costmap.geometry.to_cell(at.x, at.y)
    costmap.costs[row, column] = LETHAL
    found = LocalWorld(costmap, SARA).collides(Pose2D(x, y, yaw))
    if abs(dx) <= 0.54 and abs(dy) <= 0.29:
        assert found
    elif abs(dx) > 0.54 + 0.075 or abs(dy) > 0.29 + 0.075:
        assert not found


def test_agrees_with_the_peers_footprint_cost():
    """The peer looks at the outline alone: whatever it finds we find, but for grazes of under half a cell."""
    costs, theirs = REFERENCE['fpcost_grid'], REFERENCE['fpcost']
    checker = LocalWorld(Costmap(costs, GridGeometry(160, 160, 0.05, 0.0, 0.0)), SARA)
    ours = checker.touched(REFERENCE['fpcost_poses']) > 0
    assert ((theirs < 0) & ~ours).sum() <= 0.005 * len(theirs)
    assert (ours[theirs < 0]).mean() > 0.99
    assert ((theirs >= 0) & ours).mean() < 0.08  # obstacles that lie wholly inside


places = st.one_of(st.floats(-1.0, 9.0), st.sampled_from((math.nan, math.inf, -math.inf, 1e300)))


@given(
    st.lists(st.tuples(st.integers(0, 159), st.integers(0, 159), st.sampled_from((LETHAL, UNKNOWN))), max_size=40),
    st.booleans(),
    st.lists(st.tuples(places, places, st.floats(-4.0, 4.0)), min_size=1, max_size=4),
)
def test_each_point_on_an_obstacle_counts_by_how_deep_it_lies_inside(cells, unknown_blocks, poses):
    costmap = empty_map()
    for row, column, cost in cells:
        costmap.costs[row, column] = cost
    world = LocalWorld(costmap, SARA, unknown_blocks)
    for pose, found in zip(poses, world.touched(poses)):
        c, s = math.cos(pose[2]), math.sin(pose[2])
        plain = 0
        for px, py in world.cover.points:
            u, v = (pose[0] + c * px - s * py) / 0.05, (pose[1] + s * px + c * py) / 0.05
            cost = costmap.costs[int(v), int(u)] if 0.0 <= u < 160 and 0.0 <= v < 160 else LETHAL
            inside = min(0.54 - abs(px), 0.29 - abs(py))
            plain += (cost == LETHAL or (cost == UNKNOWN and unknown_blocks)) * (1 + int(inside / 0.025 + 1e-6))
        assert found == plain


def test_off_the_map_is_a_collision_and_unknown_as_asked():
    costmap = empty_map()
    assert LocalWorld(costmap, SARA).collides(Pose2D(0.3, 4.0, 0.0))
    costmap.costs[80, 80] = UNKNOWN
    assert LocalWorld(costmap, SARA, unknown_blocks=True).collides(Pose2D(4.0, 4.0, 0.0))
    assert not LocalWorld(costmap, SARA, unknown_blocks=False).collides(Pose2D(4.0, 4.0, 0.0))


def test_one_in_contact_may_leave_but_not_press_on():
    costmap = empty_map()
    costmap.costs[60:100, 91] = LETHAL  # a wall at x = 4.55..4.60
    checker = LocalWorld(costmap, SARA)
    start = 4.03
    assert checker.collides(Pose2D(start, 4.0, 0.0))
    assert not checker.worsens([[start - 0.02 * i, 4.0, 0.0] for i in range(10)])
    assert checker.worsens([[start + 0.02 * i, 4.0, 0.0] for i in range(10)])
