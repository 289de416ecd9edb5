"""The judge of maps made by ultrasonic sensors, the arcs that stand beside, and the campaign's part."""

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from sara_bringup.lockstep.ranges import mountings
from sara_common.planar import compose, inverse
from sara_common.platforms import chosen
from sara_lab.campaign.sonar_mapping import HOW, _summary, faults
from sara_lab.judge import passed_walls
from sara_lab.judge.heard_walls import HeardWalls
from sara_lab.judge.passed_walls import MapErrors, doors, judged, laid_on, passed
from sara_lab.judge.walls import faces, placed
from sara_lab.studies import arc_grid
from sara_lab.studies.draw_maps import draw
from sara_lab.studies.sonar_survey import EVERYWHERE, FINISHING, Survey
from sara_lab.studies.sonar_trial import heard_share, laid, made_of
from sara_lab.studies.wandering import Recording
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import FREE, OCCUPIED, UNKNOWN, GridMap
from sara_slam.sonar.wall_graph import Solved

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


def test_a_wall_is_heard_where_it_is_nearest_and_not_where_it_is_steep():
    walls = HeardWalls(rooms())
    places, sensor = walls.heard(
        np.array([[1.5, 0.8, -0.5 * math.pi], [0.5, 0.8, math.radians(-25.0)], [2.0, 2.0, 3.0]])
    )
    assert set(sensor.tolist()) == {0, 2}  # the second one's walls are too far or too steep
    assert np.allclose(places[sensor == 0, 1], 0.0)
    assert np.abs(places[sensor == 0, 0] - 1.5).max() < 0.25
    assert np.allclose(places[sensor == 2, 0], 0.0)


ROOM = GridMap(rooms(door=(0.0, 0.0)).data[:, :64], GridGeometry(64, 84, CELL, -0.1, -0.1))


@pytest.fixture(scope='module')
def surveyed():
    """Stops that a Survey of one room tells, each heard from."""
    survey, found, here = Survey(ROOM), [], (1.5, 2.0, 0.0)
    while len(found) < 200 and (stop := survey.next_stop(here)) is not None:
        found.append(stop)
        survey.hear(stop)
        here = stop
    return found


def test_a_survey_ends_and_tells_no_place_twice(surveyed):
    assert 5 < len(surveyed) < 200
    assert len(set(surveyed)) == len(surveyed)


def test_near_its_end_only_walls_that_were_passed_count():
    survey, here = Survey(ROOM), (1.5, 2.0, 0.0)
    assert survey.next_stop(here, 100.0) is None
    survey.hear(here)
    assert survey.next_stop(here, 100.0) is not None


@pytest.mark.parametrize(('farther', 'stops'), [(FINISHING, (10, 100)), (EVERYWHERE, (1, 5))])
def test_a_room_is_finished_or_every_room_is_begun(farther, stops):
    survey, here, count = Survey(rooms(), farther), (1.5, 2.0, 0.0), 0
    while here[0] < 3.1:
        survey.hear(here)
        here, count = survey.next_stop(here), count + 1
    assert stops[0] <= count <= stops[1]


def test_where_it_stops_the_body_has_room(surveyed):
    walls = faces(ROOM.data == OCCUPIED, ROOM.geometry)
    length, width = chosen().size
    for x, y, yaw in surveyed:
        along, across = np.abs(placed(walls, inverse((x, y, yaw))).T)
        assert ((along > 0.5 * length + 0.03) | (across > 0.5 * width + 0.03)).all()


def test_its_stops_hear_the_walls(surveyed):
    sensors = np.array([compose(stop, mount) for stop in surveyed for mount in mountings(chosen()).values()])
    heard, _ = HeardWalls(ROOM).heard(sensors)
    near = cKDTree(heard).query(passed(ROOM, np.array(surveyed)))[0]
    assert (near < 0.2).mean() > 0.8


def test_a_drive_past_a_wall_is_mapped_and_drawn(tmp_path):
    """1.6 m along the doorway map's wall y = 0.075, whose distance a right sensor has."""
    sonars = chosen().sonars
    right = min(sonars, key=lambda name: (sonars[name].y, -sonars[name].x))
    t = np.arange(0.0, 4.0, 0.02)
    x, zero = 0.4 * t, np.zeros(len(t))
    poses = np.stack((t, t, x, zero, zero, 2.0 + x, zero + 0.575 - sonars[right].y, zero), 1)
    heard = np.arange(0.4, 3.9, 0.2)
    ranges = np.stack((heard, heard, np.zeros(len(heard)), np.full(len(heard), 0.5)), 1)
    drive = Recording(poses, ranges, (right,), 1.6)
    assert 0.1 < heard_share('doorway', drive) < 0.8  # of the wall beside it what one sensor came past
    lines, arcs = made_of('doorway', drive)
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
        {'map': 'room', 'heard': 0.97, **{how: GOOD._asdict() for how in HOW}},
        {'map': 'flat', 'heard': 0.9, **dict.fromkeys(HOW, GOOD._asdict())},
    ]
    lines, figures = _summary(results)
    assert [line.split()[:4] for line in lines[1:]] == [
        ['room', 'lines', '1', '1'],
        ['room', 'arcs', '1', '1'],
        ['flat', 'lines', '1', '1'],
        ['flat', 'arcs', '1', '1'],
    ]
    assert figures['flat_arcs']['doors'] == 2
    assert figures['flat_lines']['heard']['median'] == 0.9


def test_poses_and_walls_are_laid_into_another_frame():
    walls = np.array([[0.0, 2.0], [0.5 * math.pi, 1.0]])  # x = 2, y = 1
    solved = Solved(np.array([[0.0, 0.0, 0.0], [1.0, 0.5, 0.2]]), walls, np.zeros(2))
    pose = (3.0, -1.0, 0.5 * math.pi)
    moved = laid(solved, pose)
    assert moved.poses[1] == pytest.approx(compose(pose, (1.0, 0.5, 0.2)))
    for corner, (theta, rho) in zip(((2.0, 5.0, 0.0), (-4.0, 1.0, 0.0)), moved.walls):
        x, y, _ = compose(pose, corner)
        assert x * math.cos(theta) + y * math.sin(theta) == pytest.approx(rho)
