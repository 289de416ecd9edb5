"""Room beside and before a footprint, and what it touches: against the plain sums, cell by cell and point by point."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_nav.costmaps.costmap import LETHAL, UNKNOWN, Costmap
from sara_nav.grids.clearance import CONVERGING, DIVERGING, WALL_BEHIND, place_of, room
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import parse_footprint
from sara_nav.grids.grid import GridGeometry

SARA = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
LAME = parse_footprint([[0.60, 0.05], [0.10, -0.30], [-0.40, -0.25], [-0.45, 0.33], [0.20, 0.40]])
SIDE = 80
GRID = GridGeometry(SIDE, SIDE, 0.05, -2.0, -2.0)
cells = st.lists(
    st.tuples(st.integers(0, SIDE - 1), st.integers(0, SIDE - 1), st.sampled_from((LETHAL, UNKNOWN))), max_size=12
)
walls = st.lists(st.tuples(st.integers(0, SIDE - 1), st.booleans()), max_size=2)
poses = st.lists(st.tuples(st.floats(-2.4, 2.4), st.floats(-2.4, 2.4), st.floats(-7.0, 7.0)), min_size=1, max_size=6)


def world_of(marks, lines=(), footprint=SARA, unknown_blocks=True):
    costs = np.zeros(GRID.shape, np.uint8)
    for at, upright in lines:
        costs[:, at : at + 2] = LETHAL if upright else costs[:, at : at + 2]
        costs[at : at + 2, :] = costs[at : at + 2, :] if upright else LETHAL
    for row, column, cost in marks:
        costs[row, column] = cost
    return LocalWorld(Costmap(costs, GRID), footprint, unknown_blocks)


def blocked(world, row, column):
    if not (0 <= row < SIDE and 0 <= column < SIDE):
        return True
    cost = world.costmap.costs[row, column]
    return cost == LETHAL or (cost == UNKNOWN and world.unknown_blocks)


def outline_gap(world, bx, by):
    """The signed distance of a point (robot's frame) from the outline, by the textbook."""
    squared, inside, corners = math.inf, False, world.footprint
    for (ax, ay), (cx, cy) in zip(corners, np.roll(corners, -1, axis=0)):
        ex, ey = cx - ax, cy - ay
        along = min(max(((bx - ax) * ex + (by - ay) * ey) / (ex * ex + ey * ey), 0.0), 1.0)
        squared = min(squared, (bx - ax - along * ex) ** 2 + (by - ay - along * ey) ** 2)
        if (ay > by) != (cy > by) and bx < ex * (by - ay) / ey + ax:
            inside = not inside
    return -math.sqrt(squared) if inside else math.sqrt(squared)


def goes_on(world, x, y, yaw, sense, outward):
    """Whether obstacles go on from a point (x, y) towards a robot with a yaw: its wall is driven along."""
    c, s = math.cos(yaw), math.sin(yaw)
    found = []
    for back in WALL_BEHIND:
        sides = np.arange(-DIVERGING * back, max(CONVERGING * back, 0.05) + 1e-12, 0.05)
        at = [(x - sense * c * back - s * outward * k, y - sense * s * back + c * outward * k) for k in sides]
        spots = [(math.floor((b + 2.0) / 0.05), math.floor((a + 2.0) / 0.05)) for a, b in at]
        found.append(any(min(spot) >= 0 and max(spot) < SIDE and blocked(world, *spot) for spot in spots))
    return all(found)


@settings(max_examples=120)
@given(cells, walls, poses, st.sampled_from((SARA, LAME)), st.booleans())
def test_points_on_obstacles_count_by_their_weights(marks, lines, at, footprint, unknown_blocks):
    world = world_of(marks, lines, footprint, unknown_blocks)
    expected = []
    for x, y, yaw in at:
        c, s = math.cos(yaw), math.sin(yaw)
        (px, py), weights = world.cover.points.T, world.cover.weights.tolist()
        u, v = (x + c * px - s * py + 2.0) / 0.05, (y + s * px + c * py + 2.0) / 0.05
        expected.append(sum(n * blocked(world, math.floor(b), math.floor(a)) for a, b, n in zip(u, v, weights)))
    assert world.touched(at).tolist() == expected


@settings(max_examples=120)
@given(cells, walls, poses, st.booleans(), st.floats(0.2, 1.2), st.floats(0.2, 1.5), st.sampled_from((SARA, LAME)))
def test_room_is_that_of_the_nearest_cell_and_of_what_is_ahead(marks, lines, at, backward, angle, reach, footprint):
    world = world_of(marks, lines, footprint)
    seen = room(world, np.array(at), backward, angle, reach)
    radius = float(np.hypot(*footprint.T).max())
    sense = -1.0 if backward else 1.0
    front, span = float((sense * footprint[:, 0]).max()), 0.6 * float(np.abs(footprint[:, 1]).max())
    rows, columns = np.nonzero(world.costmap.costs >= LETHAL)
    inner = [
        all(0 < k < SIDE - 1 for k in (r, c))
        and min(
            world.costmap.costs[r - 1, c],
            world.costmap.costs[r + 1, c],
            world.costmap.costs[r, c - 1],
            world.costmap.costs[r, c + 1],
        )
        >= LETHAL
        for r, c in zip(rows, columns)
    ]
    for i, (x, y, yaw) in enumerate(at):
        gap = ahead = math.inf
        for r, c, within in zip(rows, columns, inner):
            dx, dy = -2.0 + (c + 0.5) * 0.05 - x, -2.0 + (r + 0.5) * 0.05 - y
            if within or math.hypot(dx, dy) > radius + reach - 1e-9:
                continue
            bx, by = math.cos(yaw) * dx + math.sin(yaw) * dy, math.cos(yaw) * dy - math.sin(yaw) * dx
            beyond, beside = sense * bx - front, max(abs(by) - span, 0.0)
            if beyond > 0.0 and beside <= math.tan(angle) * beyond - 1e-9:
                at_wall = x + dx, y + dy, yaw, sense, math.copysign(1.0, by)
                if beside == 0.0 or not goes_on(world, *at_wall):
                    ahead = min(ahead, math.hypot(beyond, beside))
            distance = outline_gap(world, bx, by)
            if distance <= reach - 1e-9:
                gap = min(gap, distance)
        assert (
            seen.gap[i] == pytest.approx(max(gap - 0.025, 0.0), abs=1e-8)
            or gap == math.inf
            and seen.gap[i] >= reach - 0.0251
        )
        assert seen.ahead[i] == pytest.approx(max(ahead - 0.025, 0.0), abs=1e-8) or seen.ahead[i] <= max(
            ahead - 0.025, 0.0
        )
        if math.isfinite(seen.gap[i]):
            assert max(outline_gap(world, seen.x[i], seen.y[i]) - 0.025, 0.0) == pytest.approx(seen.gap[i], abs=1e-8)


def drawn(*lines):
    """A LocalWorld of SARA with straight walls, each from (x, y) to (x, y), m."""
    costs = np.zeros(GRID.shape, np.uint8)
    for (x0, y0), (x1, y1) in lines:
        for k in np.linspace(0.0, 1.0, 200):
            costs[int((y0 + k * (y1 - y0) + 2.0) / 0.05), int((x0 + k * (x1 - x0) + 2.0) / 0.05)] = LETHAL
    return LocalWorld(Costmap(costs, GRID), SARA, True)


def ahead_of(world, at=(0.0, 0.0, 0.0), backward=False):
    return float(room(world, np.array([at]), backward, 0.7, 1.2).ahead[0])


@pytest.mark.parametrize('backward', (False, True))
@pytest.mark.parametrize('yaw', (0.0, 0.1, -0.1))
def test_the_walls_of_a_corridor_do_not_stand_ahead(yaw, backward):
    corridor = drawn(((-1.9, 0.5), (1.9, 0.5)), ((-1.9, -0.5), (1.9, -0.5)))
    assert ahead_of(corridor, (0.0, 0.0, yaw), backward) == math.inf


def test_what_echoes_from_before_the_robot_stands_ahead():
    jambs = drawn(((1.0, 0.4), (1.0, 1.9)), ((1.0, -1.9), (1.0, -0.4)))
    assert ahead_of(jambs) == pytest.approx(0.50, abs=0.06)
    closing = drawn(((-1.9, 1.5), (1.9, 0.0)))  # by 22 deg
    assert ahead_of(closing) < 1.3
    begins = drawn(((1.0, 0.4), (1.9, 0.4)))  # a wall seen from its end
    assert ahead_of(begins) == pytest.approx(0.50, abs=0.06)
    dead_end = drawn(((-1.9, 0.5), (1.2, 0.5)), ((-1.9, -0.5), (1.2, -0.5)), ((1.2, -0.5), (1.2, 0.5)))
    assert ahead_of(dead_end) == pytest.approx(0.66, abs=0.05)


def test_places_about_the_robot_have_names():
    assert [place_of(x, y, SARA) for x, y in ((1.0, 0.0), (0.6, 0.3), (0.0, 0.4), (-1.0, -0.4), (-1.0, 0.0))] == [
        'front',
        'front left',
        'left',
        'rear right',
        'rear',
    ]
