"""The map of key scans, and what of a scan is kept."""

import math

import numpy as np
import pytest
from slam_world import RAYS, angles_of, plan, planar, points, ranges, round_trip, scan, world

from sara_common.planar import between, compose
from sara_localization.geometry.rigid import Transform
from sara_nav.maps.map_io import FREE, OCCUPIED, UNKNOWN
from sara_slam.mapping.key_scan import KeyScan, RangeLimits, key_scan
from sara_slam.mapping.occupancy import Occupancy, count_rays

MAP = world()


def key(pose, **limits):
    return key_scan(scan(ranges(MAP, pose), pose), RangeLimits(**limits))


def one_ray(end, echo=True):
    return KeyScan(0.0, (0.0, 0.0, 0.0), (0.0, 0.0), np.array([end], np.float32), np.array([echo]))


def cell(grid, x, y):
    g = grid.geometry
    return grid.data[math.floor((y - g.origin_y) / g.resolution), math.floor((x - g.origin_x) / g.resolution)]


@pytest.mark.parametrize('end', [(5.5, 0.5), (0.5, 5.5), (7.2, 3.9), (3.1, 7.7), (0.5, 0.5), (6.5, 6.5)])
def test_a_ray_counts_each_cell_it_crosses_once_from_end_to_end(end):
    ended, passed = np.zeros((9, 9), np.uint16), np.zeros((9, 9), np.uint16)
    count_rays(ended, passed, (0.5, 0.5), np.array([end]), np.array([True]))
    assert ended[int(end[1]), int(end[0])] == ended.sum() == 1 and passed.max() <= 1
    steps = np.linspace(0.0, 1.0, 4000)[:, None]
    crossed = np.unique(np.floor((0.5, 0.5) + steps * (np.array(end) - 0.5)).astype(int), axis=0)
    seen = {(int(x), int(y)) for x, y in crossed} - {(int(end[0]), int(end[1]))}
    counted = set(zip(*(passed.nonzero()[::-1])))
    assert seen <= counted and len(counted) == abs(int(end[0])) + abs(int(end[1]))  # no step is diagonal


def test_walls_are_where_they_are():
    path = round_trip(30.0, 0.5)
    drawn = Occupancy(0.05, 0.25).draw([key(pose) for pose in path], path)
    g, truth = drawn.geometry, plan()
    rows, columns = np.nonzero(drawn.data == OCCUPIED)
    x, y = g.origin_x + (columns + 0.5) * 0.05, g.origin_y + (rows + 0.5) * 0.05
    wall = np.argwhere(truth == 100)[:, ::-1] * 0.05 + 0.025
    off = np.array([np.hypot(*(wall - place).T).min() for place in zip(x, y)])
    assert len(off) > 500 and np.percentile(off, 95) <= 0.051
    for x, y in ((7.0, 1.0), (1.0, 5.0), (13.0, 5.0)):
        assert cell(drawn, x, y) == FREE
    assert cell(drawn, 7.0, 5.0) == UNKNOWN  # inside the block


def test_what_is_added_is_as_if_it_were_drawn_at_once_and_what_moved_is_drawn_anew():
    path = round_trip(12.0, 0.5)
    scans, occupancy = [key(pose) for pose in path], Occupancy(0.05, 0.25)
    for count in (5, 11, len(path)):
        drawn = occupancy.draw(scans[:count], path[:count])
    at_once = Occupancy(0.05, 0.25).draw(scans, path)
    for x, y in np.random.default_rng(0).uniform((0.2, 0.2), (12.0, 1.8), (300, 2)):
        assert cell(drawn, x, y) == cell(at_once, x, y)
    moved = [(x + 1.0, y, yaw) for x, y, yaw in path]
    again = occupancy.draw(scans, moved)
    assert cell(again, path[0][0], 1.0) == UNKNOWN or again.geometry.origin_x > drawn.geometry.origin_x
    assert np.array_equal(again.data, Occupancy(0.05, 0.25).draw(scans, moved).data)


def test_a_cell_is_occupied_where_enough_rays_end():
    through, at = one_ray((2.0, 0.01)), one_ray((1.01, 0.01))
    for ended, occupied in ((1, False), (2, True)):
        scans = [at] * ended + [through] * 4
        drawn = Occupancy(0.05, 0.25).draw(scans, [(0.0, 0.0, 0.0)] * len(scans))
        assert (cell(drawn, 1.01, 0.01) == OCCUPIED) == occupied
        assert cell(drawn, 0.5, 0.01) == FREE and cell(drawn, 2.0, 0.01) == OCCUPIED


def test_the_map_covers_what_is_asked_for_and_grows_beyond():
    drawn = Occupancy(0.1, 0.25, (-2.0, -1.0, 3.0, 1.0)).draw([one_ray((1.0, 0.0))], [(0.0, 0.0, 0.0)])
    g = drawn.geometry
    assert (g.origin_x, g.origin_y) == pytest.approx((-2.0, -1.0)) and g.size == pytest.approx((5.0, 2.0))
    grown = Occupancy(0.1, 0.25, (-2.0, -1.0, 3.0, 1.0)).draw([one_ray((9.0, 0.0))], [(0.0, 0.0, 2.0)])
    assert grown.geometry.origin_x < -3.7 and cell(grown, 9.0 * math.cos(2.0), 9.0 * math.sin(2.0)) == OCCUPIED


def test_no_scan_is_an_unknown_map():
    assert (Occupancy(0.05, 0.25).draw([], []).data == UNKNOWN).all()


def test_ranges_that_are_used():
    measured = np.full(120, 4.0)
    measured[:10], measured[10:20], measured[20:30], measured[30:40] = np.inf, np.nan, -np.inf, 10.0
    measured[40:50] = 0.01
    kept = lambda **limits: key_scan(scan(measured, (0.0, 0.0, 0.0)), RangeLimits(**limits))
    plain = kept()
    assert len(plain.ends) == 70 and plain.echo.all()  # no echo says nothing
    near = kept(usable=3.0)
    assert len(near.ends) == 70 and not near.echo.any()  # the rays are clear that far
    assert np.hypot(*near.ends.T) == pytest.approx(3.0)
    clear = kept(usable=6.0, greatest=20.0)
    assert len(clear.ends) == 90 and clear.echo.sum() == 70
    assert np.hypot(*clear.ends[~clear.echo].T) == pytest.approx(6.0)
    assert len(kept(greatest=3.0).ends) == 0


def test_a_scanner_upside_down_and_beside_the_middle():
    pose, mount = (7.0, 1.0, 0.0), Transform.from_xyz_rpy(0.3, 0.1, 0.2, math.pi, 0.0, 0.0)
    seen = ranges(MAP, (7.3, 1.1, 0.0))[::-1]  # it counts the other way round
    kept = key_scan(scan(seen, pose)._replace(mount=mount), RangeLimits())
    expected = points(MAP, (7.3, 1.1, 0.0)) + (0.3, 0.1)
    assert kept.origin == pytest.approx((0.3, 0.1)) and kept.points()[::-1] == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize('motion', [(0.08, 0.01, 0.12), (0.0, 0.0, -0.3), (-0.05, 0.0, 0.0)])
def test_each_ray_counts_as_cast_at_its_own_time(motion):
    """The echoes of a scanner that moves while it sweeps lie where those of one at rest do."""
    pose, mount = (7.0, 1.0, 0.2), (0.4, 0.05, 0.1)
    base = [compose(pose, between((0.0, 0.0, 0.0), motion, k / (RAYS - 1))) for k in range(RAYS)]
    measured = np.array([ranges(MAP, compose(there, mount))[k] for k, there in enumerate(base)])
    taken = scan(measured, pose)._replace(mount=planar(mount), ended=planar(compose(pose, motion)))
    kept = key_scan(taken, RangeLimits())
    true = []
    for k, there in enumerate(base):
        if np.isfinite(measured[k]):
            x, y, yaw = compose(there, mount)
            angle = yaw + angles_of()[k]
            true.append((x + measured[k] * math.cos(angle), y + measured[k] * math.sin(angle)))
    c, s = math.cos(pose[2]), math.sin(pose[2])
    placed = kept.ends @ np.array([[c, s], [-s, c]]) + pose[:2]
    assert placed == pytest.approx(np.array(true), abs=1e-5)
    assert kept.origin == pytest.approx(mount[:2])
