"""Bends that begin and end gently: laws of every drive with transitions, and how much they gain."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_common.platforms import load
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.footprint import pad_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.lattice.body import gap, place
from sara_nav.lattice.config import LatticePlannerConfig
from sara_nav.lattice.field import Field
from sara_nav.lattice.poses import as_plan
from sara_nav.lattice.problem import Problem
from sara_nav.lattice.transitions import SPARE, sampled, shifts, slides, solved, squared_changes
from sara_nav.lattice.world import Body
from sara_nav.pursuit.path_tracker import Leg

PADDED = pad_footprint(np.array(load('sara').footprint), 0.01)
MOST, KEEP, SPACING = 0.05, 0.12, 0.05
START = Pose2D(8.0, 8.0, 0.3)
OPEN = ()


def world_of(walls=OPEN, size=16.0):
    """A World of size x size m with walls (x0, y0, x1, y1), m."""
    n = round(size / 0.05)
    costs = np.zeros((n, n), np.uint8)
    for x0, y0, x1, y1 in np.array(walls).reshape(-1, 4) / 0.05:
        costs[max(int(y0), 0) : max(int(y1), 0), max(int(x0), 0) : max(int(x1), 0)] = 254
    costmap = Costmap(costs, GridGeometry(n, n, 0.05, 0.0, 0.0))
    return Problem(LatticePlannerConfig(), Field(costmap, True, 4.0), Body(PADDED, 0.05)).world


def steps_of(moves, start=START):
    """Moves (n, 5) one after another from a Pose2D."""
    rows, pose = [], start
    for length, turn in moves:
        rows.append((*pose, length, turn))
        pose = place(pose, length, turn, 1.0)
    return np.array(rows, float), pose


def plan_of(moves, most=MOST, world=None, start=START):
    steps, end = steps_of(moves, start)
    return as_plan(world or world_of(), steps, (start, end), SPACING, (most, KEEP))


def bend(radius, angle, straight=1.5, sense=1.0):
    return [(sense * straight, 0.0), (sense * radius * abs(angle), angle), (sense * straight, 0.0)]


def changes(plan):
    """The greatest change of curvature, 1/m2, as it is driven."""
    return float(np.abs(Leg(plan[:, :2]).change).max())


def distances(plan, other):
    """How far (n,) each row of a plan is from the nearest of another, m."""
    return np.hypot(*(plan[:, None, :2] - other[None, :, :2]).T).min(axis=0)


radius, angle = st.floats(0.4, 2.0), st.floats(0.3, 1.8)
sign = st.sampled_from([-1.0, 1.0])


@given(st.integers(8, 60), st.integers(0, 1000))
def test_the_equations_are_solved(n, seed):
    random = np.random.default_rng(seed)
    bands, weights, right = squared_changes(n), 10.0 ** random.uniform(-3.0, 3.0, n), random.normal(size=n)
    differences = np.diff(np.eye(n), 3, axis=0)
    dense = differences.T @ differences
    assert all(np.allclose(np.diag(dense, k), bands[: n - k, k]) for k in range(4))
    assert np.allclose((dense + np.diag(weights)) @ solved(bands, weights, right), right, atol=1e-6)


@given(radius, angle, sign, sign)
def test_a_bend_begins_and_ends_more_gently_inside_of_its_arc(r, turn, side, sense):
    moves = bend(r, side * turn, sense=sense)
    plain, eased = plan_of(moves, 0.0), plan_of(moves)
    assert np.allclose(eased[[0, -1]], plain[[0, -1]], atol=1e-9)
    assert changes(eased) < 0.75 * changes(plain)
    assert np.abs(Leg(eased[:, :2]).curvature).max() < 1.15 / r
    # how far it is to the left of the nearest pose of the plain one, as the robot faces
    nearest = plain[np.argmin(np.hypot(*(eased[:, None, :2] - plain[None, :, :2]).T), axis=0)]
    offset = eased[:, :2] - nearest[:, :2]
    left = np.cos(nearest[:, 2]) * offset[:, 1] - np.sin(nearest[:, 2]) * offset[:, 0]
    inside = side * sense * left
    assert inside.max() < 1.2 * MOST + 0.002 and inside.min() > -0.004
    assert all(slides(a, b) <= 1e-4 for a, b in zip(eased, eased[1:]))
    assert np.hypot(*np.diff(eased[:, :2], axis=0).T).max() <= SPACING + 1e-9


@given(radius, angle)
def test_astern_it_is_the_same_path_the_other_way(r, turn):
    ahead, (_, end) = plan_of(bend(r, turn)), steps_of(bend(r, turn))
    back = plan_of([(-length, -rate) for length, rate in bend(r, turn)][::-1], start=end)
    assert distances(ahead, back).max() < 0.6 * SPACING


@pytest.mark.parametrize('moves', [[(2.0, 0.0)], [(1.2, 1.2)], [(-1.2, 0.8)], [(1.0, 0.0), (0.0, 0.7), (1.0, 0.0)]])
def test_straights_arcs_and_turns_in_place_stay_what_they_are(moves):
    plain, eased = plan_of(moves, 0.0), plan_of(moves)
    assert np.array_equal(plain, eased)


@given(st.floats(0.03, 0.5), st.floats(0.0, 0.8), radius, angle)
def test_no_gap_gets_less_than_what_is_kept_or_what_it_was(aside, along, r, turn):
    """A wall's end stands inside of the bend."""
    moves = bend(r, turn)
    _, corner = steps_of(moves[:1])
    x = corner.x + along * math.cos(START.yaw) - (0.3 + aside) * math.sin(START.yaw)
    y = corner.y + along * math.sin(START.yaw) + (0.3 + aside) * math.cos(START.yaw)
    world = world_of([(x - 0.05, y, x + 0.05, y + 0.6)])
    plain, eased = (plan_of(moves, most, world) for most in (0.0, MOST))
    least = [min(gap(world, Pose2D(*map(float, row)), 0.0) for row in plan) for plan in (plain, eased)]
    assert least[1] >= min(least[0], KEEP) - 2.0 * SPARE


def test_where_nothing_may_be_moved_rows_stay_as_they_are():
    moves = bend(0.5, 1.2)
    steps, end = steps_of(moves)
    crowded = as_plan(world_of(), steps, (START, end), SPACING, (MOST, 1.0))  # no gap is as wide
    assert np.array_equal(crowded, plan_of(moves, 0.0))


def test_poses_are_evenly_spaced_along_moves():
    moves = np.array(bend(0.5, 1.2))
    poses, step = sampled(np.array(START), moves, 0.025)
    assert step <= 0.025 and np.allclose(np.hypot(*np.diff(poses[:, :2], axis=0).T), step, rtol=1e-3)
    assert np.allclose(poses[-1], steps_of(moves)[1])
    assert np.all(shifts(np.zeros(40), np.r_[np.zeros(2), np.full(36, MOST), np.zeros(2)], np.ones(40)) == 0.0)
