"""The judge of maps made by ultrasonic sensors, the arcs that stand beside, and the campaign's part."""

import math

import numpy as np
import pytest

from sara_lab.campaign.sonar_mapping import HOW, _summary, faults
from sara_lab.journeys.travel_cases import grid_of
from sara_lab.judge import passed_walls
from sara_lab.judge.passed_walls import MapErrors, SeenWalls, doors, judged, laid_on, passed
from sara_lab.judge.walls import placed
from sara_lab.studies import arc_grid
from sara_lab.studies.draw_maps import draw
from sara_lab.studies.sonar_drives import TURNS, stops
from sara_lab.studies.sonar_trial import made_of
from sara_lab.studies.wandering import Recording
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import FREE, OCCUPIED, UNKNOWN, GridMap

CELL = 0.05


def rooms(door=(1.6, 2.4), stray=()):
    """Two rooms of 3 m by 4 m side by side, the wall between them from x = 3.0 to 3.1, with a door."""
    data = np.full((84, 126), FREE, np.int8)
    data[:2], data[-2:], data[:, :2], data[:, -2:], data[:, 62:64] = (OCCUPIED,) * 5
    data[2 + round(door[0] / CELL) : 2 + round(door[1] / CELL), 62:64] = FREE
    for row, column in stray:
        data[row, column] = OCCUPIED
    return GridMap(data, GridGeometry(126, 84, CELL, -0.1, -0.1))


WAY = np.stack((np.linspace(1.0, 5.0, 60), np.full(60, 2.0)), 1)


def test_the_door_is_found():
    (door,) = doors(rooms())
    assert (door.x, door.y, door.along) == (pytest.approx(3.05), pytest.approx(2.0), 1)
    assert (door.wide, door.deep) == (pytest.approx(0.8), pytest.approx(0.1))


def test_walls_behind_walls_and_far_away_are_not_passed():
    seen = passed(rooms(), WAY[:1])
    assert np.hypot(*(seen - WAY[0]).T).max() <= passed_walls.REACH + 0.1
    assert (seen[:, 0] <= 3.0 + 1e-9).all()
    assert np.isclose(seen[:, 0], 0.0).any()


def test_the_true_map_is_as_good_as_cells_allow():
    errors = judged(rooms(), WAY, rooms(), WAY)
    assert errors.pose_rms < 0.01
    assert errors.median == pytest.approx(0.5 * CELL, abs=0.005)
    assert (errors.mapped, errors.false, errors.doors, errors.shut) == (1.0, 0.0, 1, 0)


def test_a_map_elsewhere_is_laid_on_the_true_one():
    there = placed(WAY, (2.0, 1.0, 0.5))
    pose = laid_on(there, WAY)
    assert np.allclose(placed(there, pose), WAY)


def test_a_door_that_is_shut_and_what_is_no_wall_are_seen():
    made = rooms(door=(1.6, 2.25), stray=[(30, 20), (30, 21)])
    errors = judged(made, WAY, rooms(), WAY)
    assert errors.shut == 1
    assert errors.false == pytest.approx(2 / (made.data == FREE).sum())


def test_walls_that_are_not_there_are_not_mapped():
    made = rooms()
    made.data[:, :2] = UNKNOWN
    assert judged(made, WAY, rooms(), WAY).mapped < 0.95


def test_a_map_without_walls_is_judged():
    made = GridMap(np.full((84, 126), FREE, np.int8), rooms().geometry)
    errors = judged(made, WAY, rooms(), WAY)
    assert errors.median == math.inf
    assert errors.mapped == 0.0


def test_stops_are_where_there_is_room_and_see_all_walls_of_both_rooms_from_near():
    start = (3.0, 4.0, 0.0)
    places = np.array(list(stops('doorway', 0, start)))
    assert tuple(places[-1]) == start
    at, counts = np.unique(places[:-1, :2], axis=0, return_counts=True)
    assert (counts == 2).all()  # turned there
    walls = SeenWalls(grid_of('doorway'))
    assert np.hypot(*(walls.points[:, None] - at).transpose(2, 0, 1)).min() > TURNS - 2 * CELL
    near = np.zeros(len(walls.points), bool)
    for place in at:
        near[walls.seen_from(place, 1.5)] = True
    passed_by = passed(grid_of('doorway'), at)
    assert near.sum() > 0.9 * len(passed_by)
    assert (at[:, 0] > 6.1).any() and (at[:, 0] < 6.0).any()


def test_a_drive_past_a_wall_is_mapped_and_drawn(tmp_path):
    """1.6 m along the doorway map's wall y = 0.075, whose distance the front right sensor has."""
    t = np.arange(0.0, 4.0, 0.02)
    x, zero = 0.4 * t, np.zeros(len(t))
    poses = np.stack((t, t, x, zero, zero, 2.0 + x, zero + 0.865, zero), 1)
    heard = np.arange(0.4, 3.9, 0.2)
    ranges = np.stack((heard, heard, np.zeros(len(heard)), np.full(len(heard), 0.5)), 1)
    lines, arcs = made_of('doorway', Recording(poses, ranges, ('SLDD',), 1.6))
    assert lines.errors.p95 < 0.08
    assert lines.errors.false == 0.0
    assert lines.errors.p95 < arcs.errors.p95
    draw('doorway', lines, lines.places, tmp_path / 'lines.png')
    assert (tmp_path / 'lines.png').stat().st_size > 1000


def test_arcs_are_occupied_at_the_range_and_free_before_it():
    sensors = np.tile((0.0, 0.0, 0.0), (10, 1))
    made = arc_grid.draw(sensors, np.full(10, 1.0), math.radians(60.0))
    g = made.geometry

    def at(x, y):
        column, row = g.to_cell(x, y)
        return made.data[row, column]

    assert at(0.5, 0.0) == FREE
    assert at(1.01, 0.0) == OCCUPIED
    assert at(1.5, 0.0) == UNKNOWN
    assert at(math.cos(0.5) + 0.005, math.sin(0.5) + 0.005) == OCCUPIED
    assert at(-0.5, 0.0) == UNKNOWN


GOOD = MapErrors((0.0, 0.0, 0.0), 0.05, 0.02, 0.08, 0.95, 0.001, 2, 0)


def test_the_part_names_what_does_not_hold():
    assert faults(GOOD) == []
    bad = GOOD._replace(pose_rms=0.2, mapped=0.5, shut=1)
    assert faults(bad) == [
        'pose_rms is 0.200, 0.12 is allowed',
        'shut is 1.000, 0 is allowed',
        '50.0% of the walls passed are mapped, 90% are asked for',
    ]


def test_the_summary_has_a_line_for_each_map_and_way_of_making_it():
    results = [
        {'map': 'room', **{how: GOOD._asdict() for how in HOW}},
        {'map': 'flat', **dict.fromkeys(HOW, GOOD._asdict())},
    ]
    lines, figures = _summary(results)
    assert [line.split()[:4] for line in lines[1:]] == [
        ['room', 'lines', '1', '1'],
        ['room', 'arcs', '1', '1'],
        ['flat', 'lines', '1', '1'],
        ['flat', 'arcs', '1', '1'],
    ]
    assert figures['flat_arcs']['doors'] == 2
