"""How far mapped walls are off: laws of the alignment, and what the campaign's part `mapping` asks for."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from sara_common.planar import compose, inverse
from sara_lab.campaign.made_maps import made_maps, sonar_made_maps
from sara_lab.campaign.mapping import faults, mapping
from sara_lab.journeys.travel_cases import MAPS
from sara_lab.judge import walls
from sara_lab.studies.map_trial import Made, Track
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import FREE, OCCUPIED, GridMap

CELL = 0.05


def room():
    """A GridMap of a room of 4 m x 3 m with a block in it."""
    data = np.full((64, 84), FREE, np.int8)
    data[:2] = data[-2:] = data[:, :2] = data[:, -2:] = OCCUPIED
    data[20:30, 50:54] = OCCUPIED
    return GridMap(data, GridGeometry(84, 64, CELL, -1.0, 2.0))


TRUE = room()
WALLS = walls.faces(TRUE.data == OCCUPIED, TRUE.geometry)


def test_faces_lie_round_a_cell():
    occupied = np.zeros((3, 4), bool)
    occupied[1, 2] = True
    found = walls.faces(occupied, GridGeometry(4, 3, CELL, 1.0, 0.0))
    assert len(found) == 4 * 5
    assert np.abs(found - (1.0 + 2.5 * CELL, 1.5 * CELL)).max(1) == pytest.approx(0.5 * CELL)


def test_the_map_s_border_is_a_face():
    assert len(walls.faces(np.ones((2, 3), bool), GridGeometry(3, 2, CELL, 0.0, 0.0))) == 10 * 5


@given(st.floats(-0.15, 0.15), st.floats(-0.15, 0.15), st.floats(-0.04, 0.04))
def test_a_rigid_displacement_is_taken_out(x, y, turn):
    pose = (3.0, -2.0, 1.0)
    points = walls.placed(WALLS[::7], inverse(pose))
    found = walls.aligned(points, cKDTree(WALLS), compose(pose, (x, y, turn)))
    assert math.dist(found[:2], pose[:2]) < 0.01 and abs(math.remainder(found[2] - pose[2], 2.0 * math.pi)) < 0.005


def test_a_perfect_map_has_half_a_cell_and_all_its_walls():
    errors = walls.judged(TRUE, TRUE, (0.0, 0.0, 0.0), WALLS)
    assert errors.median == pytest.approx(0.5 * CELL, abs=0.001) and errors.mapped == 1.0 and errors.strays == 0.0


def test_a_map_that_lacks_a_wall_or_shows_what_is_none_says_so():
    made = room()
    made.data[-2:] = FREE
    made.data[40:44, 30:34] = OCCUPIED
    errors = walls.judged(made, TRUE, (0.0, 0.0, 0.0), WALLS)
    assert 0.5 < errors.mapped < 0.85
    assert errors.strays == pytest.approx(16 / np.count_nonzero(made.data == OCCUPIED))


def test_a_bent_map_is_off():
    made = room()
    made.data[-2:] = FREE
    made.data[-6:-4] = OCCUPIED  # a wall that stands 0.2 m too near
    errors = walls.judged(made, TRUE, (0.0, 0.0, 0.0), WALLS)
    assert errors.p95 > 0.07 and errors.mapped < 0.9


def test_an_empty_map_has_nothing():
    empty = GridMap(np.zeros((3, 3), np.int8), GridGeometry(3, 3, CELL, 0.0, 0.0))
    errors = walls.judged(empty, TRUE, (0.0, 0.0, 0.0), WALLS)
    assert math.isinf(errors.median) and errors.mapped == 0.0


def test_poses_between_two_times_the_short_way_round():
    track = Track(np.array([(1.0, 0.0, 0.0, 3.1), (2.0, 1.0, 2.0, -3.1)]))
    assert track.at(0.9) is None and track.at(2.1) is None
    x, y, yaw = track.at(1.5)
    assert (x, y) == (0.5, 1.0) and math.cos(yaw) == pytest.approx(-1.0)


def made(median=0.015, p95=0.05, mapped=0.99, strays=0.001, pose=0.02):
    return Made(TRUE, walls.WallErrors((0.0, 0.0, 0.0), median, p95, mapped, strays), pose, pose, {})


def test_what_a_map_must_be():
    assert faults(made(), True) == [] and faults(made(strays=0.1), False) == []
    for changed, word in (
        ({'median': 0.021}, 'median'),
        ({'p95': 0.061}, 'p95'),
        ({'mapped': 0.9}, 'mapped'),
        ({'strays': 0.006}, 'no walls'),
        ({'pose': 0.4}, 'broken'),
    ):
        (sentence,) = faults(made(**changed), True)
        assert word in sentence


def test_the_part_has_each_map_alone_and_among_people():
    part = made_maps(20, Path('nowhere'))
    assert len(part.cases) == 150
    assert part.verdict({'all': {'reached': 147, 'cases': 150}}) == []
    assert part.verdict({'all': {'reached': 146, 'cases': 150}}) == ['146 of 150 reached, 98% are asked for']
    assert len(sonar_made_maps(20, Path('nowhere')).cases) == 100
    assert len(mapping(20, Path('nowhere')).cases) == 2 * 20 * len(MAPS)
