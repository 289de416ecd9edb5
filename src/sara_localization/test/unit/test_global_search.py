"""A start anywhere by ranges: what the map predicts, the search over it, and when it is sure.

Ranges are those of range_world.py, not taken from the table.
"""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parent))
from range_world import CELL, CONE, CONFIG, CUPBOARD, LIMIT, MOUNTS, SIZE, drive, heard, room, way  # noqa: E402

from sara_common.planar import compose, wrap  # noqa: E402
from sara_localization.particles import echo_table, global_search  # noqa: E402
from sara_localization.particles.echo_table import FAR, NEAR, SILENT, UNHEARD_OF  # noqa: E402
from sara_localization.particles.range_localizer import RangeLocalizer  # noqa: E402
from sara_localization.ranges.range_data import BeamModel, RangeData, RangeMap  # noqa: E402


def test_a_table_says_what_is_heard():
    table = echo_table.make(room([CUPBOARD]), CONE, LIMIT)
    fine = room([CUPBOARD], 0.01)
    random, off = np.random.default_rng(3), []
    for _ in range(400):
        pose = random.uniform(0.3, 5.7), random.uniform(0.3, 2.6), random.uniform(-math.pi, math.pi)
        column, row = (math.floor((place + 3 * CELL) / CELL) for place in pose[:2])
        code = table.codes[table.rows[row, column], math.floor(pose[2] * 72 / (2 * math.pi) + 0.5) % 72]
        distance = heard(fine, pose, (0.0, 0.0, 0.0))
        expected = math.inf if code == SILENT else (code + 0.5) * table.bin
        off.append(0.0 if expected == distance else abs(expected - distance))
    assert np.percentile(off, 90) < 0.1


def test_a_steep_wall_is_not_heard_and_the_unknown_is_not_known():
    data = np.full((60, 60), -1, np.int8)
    data[:, :50] = 0
    data[50:, :50] = 100  # a wall along x in the north, in the east nobody knows
    table = echo_table.make(RangeMap.from_occupancy(data, CELL, (0.0, 0.0, 0.0), 65), math.radians(10.0), LIMIT)
    codes = table.codes[table.rows[40, 10]]
    north, west_north_west = 18, 34
    assert (codes[north] + 0.5) * table.bin == pytest.approx(0.475, abs=0.03)
    assert codes[west_north_west - 8] < SILENT  # 40 deg off the normal
    assert codes[west_north_west - 2] == UNHEARD_OF  # steeper than 60: nothing but the border of the map
    assert codes[0] == UNHEARD_OF


def test_a_turned_map_gives_the_same():
    origin = (3.0, -2.0, 0.7)
    readings = np.array([(*mount, 60.0 + 20.0 * k) for k, mount in enumerate(MOUNTS.values())])
    logs = echo_table.logarithms(BeamModel(0.1, 0.8, 0.06, 0.06, 0.08), LIMIT, 0.2)
    pose, sums = (2.02, 1.53, 0.37), []
    for where in ((0.0, 0.0, 0.0), origin):
        table = echo_table.make(room([CUPBOARD], origin=where), CONE, LIMIT)
        sums.append(np.zeros(1))
        echo_table.add_logarithms(table, logs, np.array([compose(where, pose)]), readings, sums[-1])
    assert sums[0] == pytest.approx(sums[1])


def test_the_beam_model_prefers_what_is_expected():
    logs = echo_table.logarithms(BeamModel(0.1, 0.8, 0.06, 0.06, 0.08), LIMIT, 0.2)
    assert np.isfinite(logs).all()
    assert logs[200, 20] > logs[20, 200]  # shorter than expected is likelier than longer
    for code in (40, 120, 220):
        assert logs[code, : echo_table.BINS].argmax() == code
    assert logs[SILENT].argmax() == FAR
    assert logs[5].argmax() == NEAR
    assert np.ptp(logs[UNHEARD_OF]) == 0.0
    for least, limit in ((0.0, LIMIT), (0.2, 1000.0)):  # the first bin is nearer than what is measured
        assert np.isfinite(echo_table.logarithms(BeamModel(0.1, 0.8, 0.06, 0.06, 0.08), limit, least)).all()


def test_a_start_anywhere_is_found_and_tracked():
    poses = way()
    localizer = RangeLocalizer(CONFIG, room([CUPBOARD]))
    assert localizer.start_anywhere() == '' and localizer.told == 'not sure where the robot is: drive it about'
    said = drive(localizer, [CUPBOARD], poses)
    assert 'found' in said and not localizer.searching and localizer.told == ''
    assert 'used' in said[said.index('found') :]
    x, y, yaw = localizer.correction.pose
    assert math.dist((x, y), poses[-1][:2]) < 0.1
    assert abs(wrap(yaw - poses[-1][2])) < math.radians(3.0)
    again = RangeLocalizer(CONFIG, room([CUPBOARD]))
    again.start_anywhere()
    assert drive(again, [CUPBOARD], poses) == said and again.correction.pose == localizer.correction.pose


def test_of_two_places_that_look_alike_neither_is_sure():
    localizer = RangeLocalizer(CONFIG, room())
    localizer.start_anywhere()
    said = drive(localizer, [], way(2))
    assert 'found' not in said and localizer.searching
    assert localizer.told.startswith('not sure where the robot is: ')


def test_rivals_of_a_rectangle_are_its_half_turn():
    localizer, poses = RangeLocalizer(CONFIG, room()), way()
    localizer.start_anywhere()
    drive(localizer, [], poses)
    search, here = localizer.search, localizer.correction.dead_reckoned
    lead, others = search._rivals.compare(here, poses[-1], 8.0)
    x, y, yaw = poses[-1]
    assert abs(lead) < 4.0
    assert math.dist(others[0][:2], (SIZE[0] - x, SIZE[1] - y)) < 0.25
    assert abs(wrap(others[0][2] - yaw - math.pi)) < math.radians(8.0)


def test_readings_tell_the_pose_near_another_and_how_exactly():
    localizer, poses = RangeLocalizer(CONFIG, room()), way()
    localizer.start_anywhere()
    drive(localizer, [], poses)
    rivals, here, (x, y, yaw) = localizer.search._rivals, localizer.correction.dead_reckoned, poses[-1]
    beside = x + 0.12, y - 0.1, yaw + math.radians(6.0)
    pose, covariance = rivals.pose_near(here, beside)
    assert math.dist(pose[:2], (x, y)) < 0.06 and abs(wrap(pose[2] - yaw)) < math.radians(2.0)
    assert covariance[0, 0] + covariance[1, 1] < 0.1**2 and covariance[2, 2] < math.radians(2.5) ** 2
    rivals._stations = [rivals._stations[-1]]  # one place does not say so much
    _, covariance = rivals.pose_near(here, beside)
    assert covariance[2, 2] > math.radians(2.5) ** 2


def test_a_place_that_is_known_but_not_exactly_is_not_found(monkeypatch):
    monkeypatch.setattr(global_search, 'EXACT_RAD', math.radians(0.5))
    localizer = RangeLocalizer(CONFIG, room([CUPBOARD]))
    localizer.start_anywhere()
    assert 'found' not in drive(localizer, [CUPBOARD], way())
    assert localizer.search.belief.weight > 0.99 and localizer.search.rival is None
    assert localizer.told.startswith('not sure where the robot is: ')


def test_what_is_heard_on_a_map_serves_another_search():
    map_, poses = room([CUPBOARD]), way()[:20]
    places, ends = global_search.Places(map_, CONFIG.search_clearance), []
    for known in (None, places, places):
        localizer = RangeLocalizer(CONFIG, map_)
        localizer.start_anywhere(known)
        drive(localizer, [CUPBOARD], poses)
        ends.append(localizer.search.belief.pose)
    assert ends[0] == ends[1] == ends[2] and places.table(CONE, LIMIT) is places.table(CONE, LIMIT)


def test_what_ends_a_search_and_what_begins_it_anew():
    localizer = RangeLocalizer(CONFIG)
    assert localizer.start_anywhere() == 'there is no map yet' and not localizer.searching
    localizer.set_map(room([CUPBOARD]))
    assert localizer.start_anywhere() == ''
    drive(localizer, [CUPBOARD], way()[:5])
    assert localizer.search.steps > 1
    assert localizer.set_map(room()) == '' and localizer.searching and localizer.search is None
    drive(localizer, [CUPBOARD], way()[:5])
    localizer.on_pose(100.0, (50.0, 0.0, 0.0))  # it was put there
    assert localizer.searching and localizer.search is None
    solid = RangeMap.from_occupancy(np.full((9, 9), 100, np.int8), CELL, (0.0, 0.0, 0.0), 65)
    assert 'no free place' in localizer.set_map(solid) and not localizer.searching
    assert 'no free place' in localizer.start_anywhere()
    localizer.set_map(room())
    localizer.start_anywhere()
    localizer.forget()
    assert not localizer.searching and localizer.told == '' and localizer.correction.offset == (0.0, 0.0, 0.0)


def test_faulty_readings_change_nothing():
    localizer = RangeLocalizer(CONFIG, room([CUPBOARD]))
    localizer.start_anywhere()
    good = RangeData('a', 10.0, (0.5, 0.0, 0.0), 1.0, 0.16, 2.5, CONE)
    assert localizer.on_range(good) == 'waiting'
    localizer.on_pose(10.0, (0.0, 0.0, 0.0))
    assert localizer.on_range(good) == 'searched'
    faulty = (
        ({'range': math.nan}, 'bad_range'),
        ({'stamp': math.inf}, 'bad_range'),
        ({'mount': (math.nan, 0.0, 0.0)}, 'bad_range'),
        ({'field_of_view': 0.0}, 'bad_range'),
        ({'range': -1.0}, 'out_of_span'),
        ({'stamp': 1.0}, 'waiting'),
        ({'field_of_view': 0.2}, 'other_sensor'),
        ({'most': 1.0}, 'other_sensor'),
        ({'range': -math.inf}, 'searched'),
        ({'range': math.inf}, 'searched'),
    )
    for change, what in faulty:
        assert localizer.on_range(good._replace(**change)) == what
    localizer.on_pose(10.1, (math.nan, 0.0, 0.0))
    localizer.on_pose(10.2, (0.3, 0.0, 0.0))
    assert localizer.on_range(good._replace(stamp=10.2)) == 'searched'
    assert np.isfinite(localizer.search.filter.poses).all() and localizer.correction.counts['bad_pose'] == 1


def test_a_range_of_zero_metres_and_a_map_of_one_cell_are_survived():
    lone = RangeMap.from_occupancy(np.zeros((1, 1), np.int8), 1.0, (0.0, 0.0, 0.0), 65)
    localizer = RangeLocalizer(replace(CONFIG, search_clearance=0.0), lone)
    assert localizer.start_anywhere() == ''
    for k in range(40):
        localizer.on_pose(10.0 + 0.1 * k, (0.05 * k, 0.0, 0.1 * k))
        localizer.on_range(RangeData('a', 10.0 + 0.1 * k, (0.0, 0.0, 0.0), 0.0, 0.16, 2.5, CONE))
    assert np.isfinite(localizer.search.filter.poses).all() or not localizer.searching
