"""Correlative matching: the best of all poses, exactly; the displacement it finds; its covariance."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from slam_world import points, world

from sara_common.planar import compose, inverse
from sara_slam.matching import grid_kernels, search_kernels
from sara_slam.matching.likelihood_grid import TILT, LikelihoodGrid, Window, believed
from sara_slam.matching.search_kernels import Search
from sara_slam.matching.surfaces import JOINED, Surfaces, fitted, placed, surfaces_of

MAP = world()
HERE = (7.0, 1.0, 0.1)
CORNER = (1.2, 1.0, 0.3)
FINE = 720
"""Rays of the scan that is known: its echoes lie closer than the cells."""


def found(true, predicted, window, here=HERE):
    grid = LikelihoodGrid(surfaces_of(points(MAP, here, rays=FINE)).placed(here), window.shift)
    return grid.match(points(MAP, true), predicted, window)


@given(st.integers(0, 10_000), st.sampled_from([1, 2, 4, 8]), st.floats(0.0, 3.0))
def test_the_search_finds_the_best_of_all_poses(seed, block, weight):
    rng = np.random.default_rng(seed)
    grid = (rng.random((60, 60)) ** 6 * 255).astype(np.uint8)
    cells = rng.uniform(-6.0, 6.0, (12, 2))
    turns = np.linspace(-0.4, 0.4, 5)
    search = Search(30.0, 30.0, 0.2, 2 * (8 // block), block, 12, weight, 5.0)
    most = search_kernels.bounds(grid_kernels.pooled(grid, block), cells, turns, search)
    best = search_kernels.best_shift(grid, cells, turns, search, most, np.argsort(-most, axis=None))
    scores = {}
    for a, turn in enumerate(turns):
        angle = 0.2 + turn
        c, s = math.cos(angle), math.sin(angle)
        columns = np.floor(30.0 + c * cells[:, 0] - s * cells[:, 1]).astype(int)
        rows = np.floor(30.0 + s * cells[:, 0] + c * cells[:, 1]).astype(int)
        for dy in range(-8, 8):
            for dx in range(-8, 8):
                total = int(grid[rows + dy, columns + dx].astype(int).sum())
                scores[a, dx, dy] = total - weight * (dx * dx + dy * dy) - 5.0 * turn * turn
    assert best[0] == pytest.approx(max(scores.values()))
    assert scores[best[1:]] == pytest.approx(best[0])


def test_pooling_gives_the_greatest_of_each_block():
    grid = np.random.default_rng(1).integers(0, 255, (20, 23)).astype(np.uint8)
    pooled = grid_kernels.pooled(grid, 4)
    for i in range(16):
        for j in range(19):
            assert pooled[i, j] == grid[i : i + 4, j : j + 4].max()


def room(turn):
    """Surfaces of a room of 6 m x 4 m with a box in it, turned and beside the grid's lines."""
    corners = [(-3, -2), (3, -2), (3, 2), (-3, 2), (-3, -2)], [(1, -2), (1, -1), (2, -1)]
    share = np.linspace(0.0, 1.0, 600)[:, None]
    walls = [a + share * np.subtract(b, a) for line in corners for a, b in zip(line, line[1:])]
    return surfaces_of(np.concatenate(walls)).placed((0.013, 0.028, turn))


@pytest.mark.parametrize('turn', [0.0, 0.4, 0.8])
@pytest.mark.parametrize('off', [(0.0, 0.0, 0.0), (0.13, -0.21, 0.11), (-0.31, 0.18, -0.16), (0.02, 0.33, 0.2)])
def test_a_displacement_is_found_to_a_few_millimetres(turn, off):
    walls, rng = room(turn), np.random.default_rng(3)
    seen = placed(walls.points[rng.choice(len(walls.points), 180)], inverse(off)) + rng.normal(0.0, 0.005, (180, 2))
    match = LikelihoodGrid(walls, 0.5).match(seen, (0.0, 0.0, 0.0), Window(0.5, 0.3, 10.0, 10.0))
    assert math.dist(match.pose[:2], off[:2]) < 0.008 and abs(match.pose[2] - off[2]) < 0.003
    assert match.response > 0.9 and match.score == pytest.approx(match.response * 180)
    assert match.covariance[0, 0] > math.dist(match.pose[:2], off[:2]) ** 2 / 9.0


@pytest.mark.parametrize('off', [(0.13, -0.21, 0.11), (-0.31, 0.18, -0.16), (0.02, 0.33, 0.2)])
def test_a_scan_finds_its_place_in_another(off):
    true = compose(CORNER, off)
    match = found(true, CORNER, Window(0.5, 0.3, 10.0, 10.0), CORNER)
    assert math.dist(match.pose[:2], true[:2]) < 0.03 and abs(match.pose[2] - true[2]) < 0.01


def test_a_wide_window_finds_a_large_displacement():
    true = (3.1, 1.2, -0.2)
    match = found(true, CORNER, Window(3.0, 0.6, 10.0, 10.0), CORNER)
    assert math.dist(match.pose[:2], true[:2]) < 0.05 and abs(match.pose[2] - true[2]) < 0.02


def test_where_scans_say_nothing_the_prediction_holds():
    ends = np.stack((np.linspace(-4.0, 4.0, 200), np.full(200, 1.0)), 1)
    along = np.concatenate((ends, ends * (1.0, -1.0)))
    grid = LikelihoodGrid(surfaces_of(np.concatenate([along + (shift, 0.0) for shift in (-2.0, 0.0, 2.0)])), 0.5)
    match = grid.match(along[100:300], (0.2, 0.1, 0.02), Window(0.5, 0.2, 0.2, 0.1))
    assert abs(match.pose[0] - 0.2) < 0.02 and abs(match.pose[1]) < 0.02 and abs(match.pose[2]) < 0.005


def test_along_a_corridor_the_covariance_is_large_and_across_it_small():
    ends = np.stack((np.linspace(-4.0, 4.0, 160), np.full(160, 1.0)), 1)
    both = np.concatenate((ends, ends * (1.0, -1.0)))
    turned = surfaces_of(both).placed((0.0, 0.0, 0.5))  # the corridor runs along 0.5 rad
    match = LikelihoodGrid(turned, 0.3).match(both[40:280], (0.0, 0.0, 0.5), Window(0.2, 0.1, 1.0, 1.0))
    along, across = np.array((math.cos(0.5), math.sin(0.5))), np.array((-math.sin(0.5), math.cos(0.5)))
    P = match.covariance[:2, :2]
    assert along @ P @ along > 8.0 * (across @ P @ across)
    corner = found(CORNER, CORNER, Window(0.2, 0.1, 1.0, 1.0), CORNER).covariance
    assert max(corner[0, 0], corner[1, 1]) < 0.3 * (along @ P @ along)


def test_an_echo_where_rays_went_through_contradicts():
    grid = LikelihoodGrid(surfaces_of(points(MAP, HERE)).placed(HERE), 0.3)
    grid.clear(HERE[:2], placed(points(MAP, HERE), HERE))
    window = Window(0.2, 0.1, 1.0, 1.0)
    same = points(MAP, HERE)
    assert grid.match(same, HERE, window).agreement > 0.99
    nearer = np.concatenate((same[::2], 0.5 * same[1::2]))  # half of what is seen stands in the free space
    assert grid.match(nearer, HERE, window).agreement < 0.7


def test_the_end_of_what_is_known_does_not_pull():
    """A scan sees a wall further than it is known; a step in it says where along it the robot is."""
    known = [(-2.0, 1.0), (0.0, 1.0), (0.0, 1.2), (1.0, 1.2)]
    share = np.linspace(0.0, 1.0, 60)[:, None]
    line = lambda corners: np.concatenate([a + share * np.subtract(b, a) for a, b in zip(corners, corners[1:])])
    walls = surfaces_of(line(known))
    seen = line([*known[:-1], (1.2, 1.2)])
    match = LikelihoodGrid(walls, 0.3).match(seen, (0.0, 0.0, 0.0), Window(0.2, 0.1, 0.3, 0.1))
    assert abs(match.pose[0]) < 0.004 and abs(match.pose[1]) < 0.002 and abs(match.pose[2]) < 0.002


def test_what_is_seen_of_a_wall_is_laid_on_its_line_and_corners_have_no_normal():
    rng, x = np.random.default_rng(2), np.linspace(0.0, 3.0, 200)
    wall = np.stack((x, np.full(200, 1.0)), 1) + rng.normal(0.0, 0.01, (200, 2))
    places, normals = fitted(wall)
    assert np.std(places[:, 1]) < 0.4 * np.std(wall[:, 1])
    assert np.hypot(*normals.T) == pytest.approx(np.ones(200)) and np.abs(normals[:, 1]).min() > 0.98
    corner = np.concatenate((np.stack((x[:100], np.zeros(100)), 1), np.stack((np.full(100, x[99]), x[:100]), 1)))
    _, normals = fitted(corner)
    assert not normals[99].any() and np.abs(normals[50]) == pytest.approx((0.0, 1.0), abs=1e-6)


def test_neighbours_are_joined_and_others_are_not():
    echoes = np.array([(0.0, 0.0), (0.34, 0.0), (0.34 + JOINED + 0.01, 0.0), (5.0, 5.0)])
    surfaces = surfaces_of(echoes)
    assert len(surfaces.points) == 4 + 6
    between = surfaces.points[4:]
    assert between[:, 0] == pytest.approx(0.34 * np.arange(1, 7) / 7.0) and (between[:, 1] == 0.0).all()
    assert np.abs(surfaces.normals[4:, 1]) == pytest.approx(np.ones(6)) and not surfaces.normals[2:4].any()
    for few in (np.zeros((0, 2)), np.zeros((1, 2))):
        assert len(surfaces_of(few).points) == len(few)


def test_surfaces_turn_with_their_frame():
    here = Surfaces(np.array([(1.0, 0.0)]), np.array([(0.0, 1.0)])).placed((1.0, 2.0, 0.5 * math.pi))
    assert here.points[0] == pytest.approx((1.0, 3.0)) and here.normals[0] == pytest.approx((-1.0, 0.0))


def test_the_covariance_is_that_of_the_prediction_where_nothing_is_near():
    grid = LikelihoodGrid(surfaces_of(np.array([(50.0, 50.0), (50.1, 50.0)])), 0.3)
    match = grid.match(np.ones((20, 2)), (0.0, 0.0, 0.0), Window(0.2, 0.1, 0.05, 0.02))
    assert match.pose == pytest.approx((0.0, 0.0, 0.0), abs=1e-9) and match.response == 0.0
    assert match.covariance == pytest.approx(np.diag((0.05, 0.05, 0.02)) ** 2) and math.isnan(match.agreement)


def test_a_match_does_not_depend_on_where_the_map_s_origin_lies():
    window, shift = Window(0.4, 0.2, 1.0, 1.0), np.array((37.35, -12.7))
    true = compose(CORNER, (0.1, 0.05, 0.05))
    one = LikelihoodGrid(surfaces_of(points(MAP, CORNER)).placed(CORNER), 0.5).match(points(MAP, true), CORNER, window)
    moved = (CORNER[0] + shift[0], CORNER[1] + shift[1], CORNER[2])
    two = LikelihoodGrid(surfaces_of(points(MAP, CORNER)).placed(moved), 0.5).match(points(MAP, true), moved, window)
    assert math.dist(np.array(two.pose[:2]) - shift, one.pose[:2]) < 1e-3
    off = compose(inverse(one.pose), (two.pose[0] - shift[0], two.pose[1] - shift[1], two.pose[2]))
    assert abs(off[2]) < 1e-3


def test_normals_point_to_where_a_wall_was_seen_from_and_its_back_is_not_faced():
    wall = surfaces_of(np.stack((np.linspace(-1.0, 1.0, 40), np.full(40, 2.0)), 1)).seen_from((0.0, 0.0))
    assert (wall.normals[:, 1] < -0.99).all()
    turned = wall.placed((5.0, 0.0, 0.5 * math.pi))
    assert (turned.normals[:, 0] > 0.99).all()
    assert wall.facing((0.3, 1.5), 0.2).all() and not wall.facing((0.3, 2.5), 0.2).any()
    assert wall.facing((0.3, 2.1), 0.2).all()  # the viewer may be on this side after all
    corner = Surfaces(np.zeros((1, 2)), np.zeros((1, 2)))
    assert corner.facing((9.0, 9.0), 0.0).all()


@given(st.floats(-3.0, 3.0), st.floats(0.0, 0.5 * TILT))
def test_along_a_bare_wall_echoes_tell_nothing_however_their_normals_err(direction, error):
    rng = np.random.default_rng(0)
    angles = direction + error * rng.standard_normal(400)
    J = np.stack((np.cos(angles), np.sin(angles), rng.uniform(-3.0, 3.0, 400)), 1)
    told = believed(J.T @ J)
    along = np.array((-math.sin(direction), math.cos(direction), 0.0))
    across = np.array((math.cos(direction), math.sin(direction), 0.0))
    assert along @ told @ along < 1.0 and across @ told @ across > 380.0
    assert np.linalg.eigvalsh(told).min() > -1e-6


def test_where_walls_stand_across_all_is_believed():
    J = np.array([(1.0, 0.0, 0.5), (0.0, 1.0, -0.5)] * 50)
    told = believed(J.T @ J)
    assert told == pytest.approx(J.T @ J, rel=0.03)
    assert believed(np.zeros((3, 3))) == pytest.approx(np.zeros((3, 3)))


def test_along_a_bare_wall_the_pose_is_the_predicted_one():
    x = np.arange(-4.0, 4.0, 0.02)
    rng = np.random.default_rng(3)
    known = surfaces_of(np.stack((x, 1.0 + 0.01 * rng.standard_normal(len(x))), 1))
    seen = np.stack((x, 1.0 + 0.01 * rng.standard_normal(len(x))), 1)[50:-50]
    match = LikelihoodGrid(known, 1.0).match(seen, (0.3, 0.05, 0.0), Window(1.0, 0.2, 0.4, 0.05))
    assert match.pose[0] == pytest.approx(0.3, abs=0.02) and match.pose[1] == pytest.approx(0.0, abs=0.01)
    sigmas = np.sqrt(np.diag(match.covariance))
    assert sigmas[0] == pytest.approx(0.4, rel=0.1) and sigmas[1] < 0.04
