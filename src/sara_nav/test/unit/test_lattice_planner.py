"""The planner of the oriented footprint: what holds of every plan, and the places it is there for."""

import functools
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D, wrap
from sara_common.platforms import load
from sara_nav.costmaps.costmap import Costmap, InflationConfig, build
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import circle_footprint, pad_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.lattice.config import LatticePlannerConfig
from sara_nav.lattice.planner import LatticePlanner
from sara_nav.lattice.tree import empty_tree
from sara_nav.maps.map_io import load_map
from sara_nav.planners.navfn import NavfnConfig, NavfnROS
from sara_nav.planners.planning import PlanError, path_length

RESOLUTION = 0.05
FOOTPRINT = load('sara').footprint
PADDED = pad_footprint(np.array(FOOTPRINT), 0.01)
MAPS = Path(__file__).parents[3] / 'sara_bringup' / 'maps'
LETHAL, UNKNOWN = 254, 255
TURN = 0.005
"""m between two rows, below which they are a turn in place."""


def grid(width, height, *walls, value=LETHAL, costs=None):
    """Return a Costmap of width x height m whose cells are obstacles where a wall (x0, y0, x1, y1), m, reaches in."""
    costs = np.zeros((round(height / RESOLUTION), round(width / RESOLUTION)), np.uint8) if costs is None else costs
    for x0, y0, x1, y1 in walls:
        costs[
            math.floor(y0 / RESOLUTION + 1e-6) : math.ceil(y1 / RESOLUTION - 1e-6),
            math.floor(x0 / RESOLUTION + 1e-6) : math.ceil(x1 / RESOLUTION - 1e-6),
        ] = value
    return Costmap(costs, GridGeometry(costs.shape[1], costs.shape[0], RESOLUTION, 0.0, 0.0))


ENDS = Pose2D(1.8, 2.2, 0.0), Pose2D(6.3, 4.0, -0.4)
"""A start and a goal at either side of a `door`."""


def door(width=0.8, middle=3.0, thick=0.1):
    """Return two rooms of 4 x 6 m with a door between them, in the wall about x = 4, ``middle`` in y."""
    return grid(
        8.0,
        6.0,
        (4.0 - 0.5 * thick, 0.0, 4.0 + 0.5 * thick, middle - 0.5 * width),
        (4.0 - 0.5 * thick, middle + 0.5 * width, 4.0 + 0.5 * thick, 6.0),
    )


def fine(plan):
    """Return poses (m, 3) along a plan, no further apart than 1 cm and 0.02 rad."""
    rows = [plan[:1]]
    for a, b in zip(plan[:-1], plan[1:]):
        turn = wrap(b[2] - a[2])
        n = max(1, math.ceil(max(math.hypot(*(b - a)[:2]) / 0.01, abs(turn) / 0.02)))
        share = np.arange(1, n + 1)[:, None] / n
        rows.append(a + share * np.array([b[0] - a[0], b[1] - a[1], turn]))
    return np.vstack(rows)


def planner_of(*config):
    planner = LatticePlanner(*config)
    planner.set_footprint(np.array(FOOTPRINT))
    return planner


def check(plan, costmap, start, goal, footprint=PADDED, unknown_blocks=True):
    """Assert what holds of every plan from a free start."""
    assert plan[0].tolist() == [start.x, start.y, start.yaw] and plan[-1].tolist() == [goal.x, goal.y, goal.yaw]
    steps = np.diff(plan, axis=0)
    length = np.hypot(steps[:, 0], steps[:, 1])
    turn = (steps[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
    assert length.max() <= 0.051 and np.abs(turn).max() <= 0.11
    moves = length >= TURN
    middle = plan[:-1, 2] + 0.5 * turn
    aside = np.abs(-np.sin(middle) * steps[:, 0] + np.cos(middle) * steps[:, 1])
    assert aside[moves].max(initial=0.0) <= 1e-4  # wheels roll, and do not slide
    assert LocalWorld(costmap, footprint, unknown_blocks).touched(fine(plan)).max() == 0


def parts(plan):
    """Return (m ahead, m astern, rad turned in place)."""
    steps = np.diff(plan, axis=0)
    along = np.cos(plan[:-1, 2]) * steps[:, 0] + np.sin(plan[:-1, 2]) * steps[:, 1]
    turn = np.abs((steps[:, 2] + math.pi) % (2.0 * math.pi) - math.pi)
    return along[along > 0].sum(), -along[along < 0].sum(), turn[np.hypot(steps[:, 0], steps[:, 1]) < TURN].sum()


def plan_of(costmap, start, goal, footprint=PADDED, **parameters):
    planner = planner_of(LatticePlannerConfig(**parameters))
    planner.set_footprint(footprint)
    return planner.plan(costmap, start, goal)


@functools.cache
def own(name):
    """Return the Costmap of one of SARA's maps, as the shipped configuration makes it."""
    return build(load_map(str(MAPS / (name + '.yaml'))), 0.30, inflation=InflationConfig(0.75, 4.0))


def free_poses(costmap, count, seed, spare=0.03):
    """Return poses where the footprint, padded by ``spare`` m more, touches nothing."""
    random, g = np.random.default_rng(seed), costmap.geometry
    world, found = LocalWorld(costmap, pad_footprint(PADDED, spare)), []
    while len(found) < count:
        pose = Pose2D(
            *(float(o + random.uniform() * s) for o, s in zip((g.origin_x, g.origin_y), g.size)),
            float(random.uniform(-math.pi, math.pi)),
        )
        if not world.collides(pose):
            found.append(pose)
    return found


# -- laws ----------------------------------------------------------------------------------------------------------

GENTLE = {'curve_radius': 0.4, 'bend_deviation': 0.05}
coordinate, angle = st.floats(0.6, 5.4), st.floats(-math.pi, math.pi)
box = st.tuples(st.floats(0.0, 5.5), st.floats(0.0, 5.5), st.floats(0.05, 1.0), st.floats(0.05, 1.0))


@settings(max_examples=60, suppress_health_check=[HealthCheck.filter_too_much])
@given(
    st.lists(box, max_size=5),
    st.tuples(coordinate, coordinate, angle),
    st.tuples(coordinate, coordinate, angle),
    st.sampled_from([{}, GENTLE]),
)
@example([], (3.0, 3.0, 0.5), (3.0, 3.0, 0.5), {})
@example([], (3.0, 3.0, 0.5), (3.0, 3.0, -2.5), {})
def test_every_plan_is_whole_can_be_driven_touches_nothing_and_is_the_same_again(boxes, start, goal, bends):
    costmap = grid(6.0, 6.0, *((x, y, x + w, y + h) for x, y, w, h in boxes))
    start, goal = Pose2D(*start), Pose2D(*goal)
    world = LocalWorld(costmap, PADDED)
    assume(not world.collides(start) and not world.collides(goal))
    try:
        plan = plan_of(costmap, start, goal, max_expansions=4000, **bends)
    except PlanError as error:
        assert 'no way leads the footprint' in str(error)
        return
    check(plan, costmap, start, goal)
    assert np.array_equal(plan, plan_of(costmap, start, goal, max_expansions=4000, **bends))


@settings(max_examples=25)
@given(st.floats(-1.0, 1.0), st.floats(1.0, 2.9), angle, st.sampled_from(['x', 'y', 'both']))
def test_mirrored_maps_have_ways_as_good(aside, distance, yaw, axis):
    costmap = door(0.9)
    start, goal = Pose2D(4.0 - distance, 3.0 + aside, 0.2 * yaw), Pose2D(6.0, 2.5, yaw)
    assume(not LocalWorld(costmap, PADDED).collides(start))

    def mirrored(pose):
        x, y, yaw = pose.x, pose.y, pose.yaw
        if axis in ('x', 'both'):
            x, yaw = 8.0 - x, math.pi - yaw
        if axis in ('y', 'both'):
            y, yaw = 6.0 - y, -yaw
        return Pose2D(x, y, wrap(yaw))

    straight, reflected = (plan_of(costmap, *ends) for ends in ((start, goal), (mirrored(start), mirrored(goal))))
    check(reflected, costmap, mirrored(start), mirrored(goal))
    assert path_length(reflected) == pytest.approx(path_length(straight), rel=0.15, abs=0.3)


# -- doors ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize('middle', [3.0, 3.01, 3.025, 2.985])
@pytest.mark.parametrize('yaw', [0.0, 0.6, -1.2, 2.0, math.pi])
def test_a_door_of_80_cm_from_any_angle_on_the_grid_and_off_it(middle, yaw):
    costmap = door(0.8, middle)
    start, goal = Pose2D(1.8, 2.2, yaw), Pose2D(6.3, 4.0, -0.4)
    plan = plan_of(costmap, start, goal)
    check(plan, costmap, start, goal)
    through = fine(plan)
    through = through[np.abs(through[:, 0] - 4.0) < 0.55]
    assert np.abs(wrap(through[:, 2])).max() < math.radians(4.0)  # square
    assert np.abs(through[:, 1] - middle).max() < 0.06  # in the middle
    before = fine(plan)
    before = before[np.abs(before[:, 0] - 4.0) < 0.9]
    assert np.abs(wrap(before[:, 2])).max() < math.radians(10.0)  # and come up to straight
    assert parts(plan)[1] < 0.3 + 3.0 * (abs(yaw) > 3.0)


def test_a_door_that_is_too_narrow_is_none():
    with pytest.raises(
        PlanError, match='no way leads the footprint from .1.80, 2.20, 0 deg. to the goal .6.30, 4.00, -23 deg.'
    ):
        plan_of(door(0.6), *ENDS)


@pytest.mark.parametrize(('hard', 'kept'), [(0.10, 0.08), (0.14, 0.06)])
def test_a_door_that_leaves_no_hard_margin_is_passed_with_less_of_it(hard, kept):
    """Of 0.80 m, with 0.60 + 2 x 0.01 m of body, it leaves 0.09 m at each side: half-way to the least margin of 0.06 m
    is little enough, or is not.
    """
    costmap = door(0.8)
    with pytest.raises(PlanError, match='no way'):
        plan_of(costmap, *ENDS, hard_margin=hard)
    plan = plan_of(costmap, *ENDS, hard_margin=hard, least_margin=0.06)
    check(plan, costmap, *ENDS, footprint=pad_footprint(np.array(FOOTPRINT), 0.01 + kept))
    assert np.array_equal(plan, plan_of(costmap, *ENDS, hard_margin=kept))


def test_the_least_margin_is_for_nothing_where_the_hard_one_is_kept():
    costmap = door(0.8)
    plan = plan_of(costmap, *ENDS, hard_margin=0.06)
    assert np.array_equal(plan, plan_of(costmap, *ENDS, hard_margin=0.06, least_margin=0.02))
    assert np.array_equal(plan, plan_of(costmap, *ENDS, hard_margin=0.06, least_margin=0.20))


def test_without_room_for_the_least_margin_either_there_is_no_way():
    planner = planner_of(LatticePlannerConfig(hard_margin=0.16, least_margin=0.14))
    with pytest.raises(PlanError, match='no way leads the footprint'):
        planner.plan(door(0.8), *ENDS)
    assert not planner.explore(door(0.8), ENDS[0])[60, 120]
    planner = planner_of(LatticePlannerConfig(hard_margin=0.14, least_margin=0.02))
    assert planner.explore(door(0.8), ENDS[0])[60, 120]


def test_a_slanting_passage_is_driven_along():
    """Two walls 0.9 m apart at 17 degrees to the grid, 3 m long."""
    c, s = math.cos(0.3), math.sin(0.3)
    y, x = np.mgrid[0:120, 0:160] * RESOLUTION + 0.025
    along, across = c * (x - 4.0) + s * (y - 3.0), -s * (x - 4.0) + c * (y - 3.0)
    costs = np.where((np.abs(along) < 1.5) & (np.abs(across) > 0.45), LETHAL, 0).astype(np.uint8)
    costmap = grid(8.0, 6.0, costs=costs)
    start, goal = Pose2D(1.0, 2.5, 1.0), Pose2D(7.0, 3.5, -2.0)
    plan = plan_of(costmap, start, goal)
    check(plan, costmap, start, goal)
    within = plan[np.abs(c * (plan[:, 0] - 4.0) + s * (plan[:, 1] - 3.0)) < 1.0]
    assert np.abs(wrap(within[:, 2] - 0.3)).max() < 0.05


# -- where there is no room ----------------------------------------------------------------------------------------


def dead_end():
    """Return a corridor 0.9 m wide and 4 m long that ends at x = 0.5 and opens at x = 4.5 into a room of 3.5 x 5 m."""
    return grid(8.0, 5.0, (0.0, 0.0, 4.5, 2.0), (0.0, 2.9, 4.5, 5.0), (0.0, 0.0, 0.5, 5.0))


def test_it_backs_out_of_a_dead_end_and_turns_where_there_is_room():
    costmap = dead_end()
    start, goal = Pose2D(1.2, 2.45, math.pi), Pose2D(6.5, 1.5, -1.0)
    plan = plan_of(costmap, start, goal)
    check(plan, costmap, start, goal)
    _, astern, _ = parts(plan)
    assert 2.5 < astern < 5.0
    narrow = plan[plan[:, 0] < 4.0]
    assert np.abs(wrap(narrow[:, 2] - math.pi)).max() < 0.2  # it does not turn in there


def test_it_backs_into_a_dead_end_when_the_goal_says_so():
    costmap = dead_end()
    start, goal = Pose2D(6.5, 1.5, -1.0), Pose2D(1.2, 2.45, 0.0)
    plan = plan_of(costmap, start, goal)
    check(plan, costmap, start, goal)
    assert 2.5 < parts(plan)[1] < 6.0
    ahead = plan_of(costmap, start, Pose2D(1.2, 2.45, math.pi))
    assert parts(ahead)[1] < 0.5


def test_turns_are_made_where_there_is_room_to_turn():
    """In a corridor 1.2 m wide the body cannot turn about, in the bay beside it, it can."""
    costmap = grid(10.0, 5.0, (0.0, 0.0, 10.0, 1.0), (0.0, 2.2, 4.0, 5.0), (6.0, 2.2, 10.0, 5.0))
    start, goal = Pose2D(1.0, 1.6, 0.0), Pose2D(1.5, 1.6, math.pi)
    plan = plan_of(costmap, start, goal)
    check(plan, costmap, start, goal)
    assert plan[:, 0].max() > 3.0


def test_a_corner_that_only_an_arc_passes():
    """An L of corridors 1.0 m wide: turning about in its corner would need 1.23 m, but for the outer corner cut off."""
    costmap = grid(5.0, 5.0, (0.0, 0.0, 3.0, 3.0), (4.0, 0.0, 5.0, 5.0), (0.0, 4.0, 5.0, 5.0))
    start, goal = Pose2D(3.5, 0.8, math.pi / 2.0), Pose2D(0.8, 3.5, math.pi)
    plan = plan_of(costmap, start, goal)
    check(plan, costmap, start, goal)


def junction(width=1.0):
    """Return a corridor along x with an arm upwards at x = 4."""
    return grid(9.0, 6.0, (0.0, 0.0, 9.0, 0.5), (0.0, 0.5 + width, 4.0, 6.0), (4.0 + width, 0.5 + width, 9.0, 6.0))


def turned_with_something_near_an_end(plan, costmap, reach=0.15):
    """Return how much (m and rad) of a plan bends while an obstacle is within ``reach`` m before or behind."""
    rows = fine(plan)
    world = LocalWorld(costmap, np.array([(0.53 + reach, side) for side in (0.18, -0.18)] + [(-0.53 - reach, -0.18)]))
    bends = np.abs([wrap(b - a) for a, b in zip(rows[:-1, 2], rows[1:, 2])]) > 1e-6
    steps = np.hypot(*np.diff(rows[:, :2], axis=0).T) + np.abs(np.diff(rows[:, 2]))
    return float(steps[bends & (np.array(world.touched(rows))[1:] > 0)].sum())


def test_it_does_not_drive_astern_where_it_can_turn_about():
    """A start with its front 0.9 m from the hall's end and its side 0.6 m from a wall; the goal is at the other end."""
    costmap = own('hall')
    start, goal = Pose2D(2.278, 0.251, 2.897), Pose2D(28.809, 0.486, 0.471)
    plan = plan_of(costmap, start, goal, turning_room=0.18, blind=0.2, beside=0.12)
    check(plan, costmap, start, goal)
    ahead, astern, _ = parts(plan)
    assert astern < 3.0 and ahead > 20.0


def test_where_sensors_do_not_measure_it_does_not_turn():
    costmap, start, goal = junction(), Pose2D(1.5, 1.0, 0.0), Pose2D(4.5, 4.0, 0.5 * math.pi)
    near = {}
    for blind in (0.0, 0.18):
        plan = planner_of(LatticePlannerConfig(blind=blind)).plan(costmap, start, goal)
        check(plan, costmap, start, goal)
        near[blind] = turned_with_something_near_an_end(plan, costmap)
    assert near[0.18] == 0.0 < 0.2 < near[0.0]


def test_with_its_front_at_a_wall_it_backs_before_it_turns():
    costmap, start, goal = grid(6.0, 6.0, (4.0, 0.0, 4.1, 6.0)), Pose2D(3.4, 3.0, 0.0), Pose2D(3.0, 1.5, -0.5 * math.pi)
    plan = planner_of(LatticePlannerConfig(blind=0.18)).plan(costmap, start, goal)
    check(plan, costmap, start, goal)
    assert turned_with_something_near_an_end(plan, costmap) == 0.0
    assert plan[1, 0] < start.x and plan[1, 2] == start.yaw


@pytest.mark.parametrize(
    'y, yaw', [(1.36, 0.0), (1.33, 0.0), (1.315, 0.0), (1.56, -math.pi / 2.0), (1.50, -math.pi / 2.0), (1.40, 0.4)]
)
def test_a_start_too_near_to_a_wall_is_left_without_things_getting_worse(y, yaw):
    """Along the wall, 0.06 to 0.015 m from it, facing it, with its front in it, and with a corner in it."""
    costmap = grid(12.0, 6.0, (0.0, 0.0, 12.0, 1.0))
    start, goal = Pose2D(3.0, y, yaw), Pose2D(3.0, 4.0, 1.0)  # its side is 0.30 m from the middle, its front 0.55 m
    plan = plan_of(costmap, start, goal)
    assert plan[0].tolist() == [start.x, start.y, start.yaw] and plan[-1].tolist() == [goal.x, goal.y, goal.yaw]
    touched = LocalWorld(costmap, PADDED).touched(fine(plan))
    assert touched.max() == touched[0] and touched[-1] == 0


def test_a_goal_close_to_a_wall_is_come_up_to():
    costmap = grid(6.0, 6.0, (0.0, 0.0, 6.0, 1.0))
    start, goal = Pose2D(3.0, 4.0, 1.0), Pose2D(3.0, 1.31, 0.0)
    check(plan_of(costmap, start, goal), costmap, start, goal)


# -- what a planner is told ----------------------------------------------------------------------------------------


def test_unknown_cells_are_obstacles_unless_allowed():
    costmap = grid(8.0, 6.0, (3.0, 0.0, 5.0, 6.0), value=UNKNOWN)
    ends = Pose2D(1.5, 3.0, 0.0), Pose2D(6.5, 3.0, 0.0)
    with pytest.raises(PlanError, match='no way leads the footprint'):
        plan_of(costmap, *ends)
    check(plan_of(costmap, *ends, allow_unknown=True), costmap, *ends, unknown_blocks=False)
    with pytest.raises(PlanError, match='overlaps an obstacle, unknown space or the edge of the map'):
        plan_of(costmap, ends[0], Pose2D(4.0, 3.0, 0.0))


@pytest.mark.parametrize(
    'start, goal, text',
    [
        ((-1.0, 3.0, 0.0), (6.0, 3.0, 0.0), r'the robot at \(-1.00, 3.00\) is off the map'),
        ((2.0, 3.0, 0.0), (6.0, 30.0, 0.0), r'the goal \(6.00, 30.00\) is off the map'),
        ((2.0, 3.0, 0.0), (4.0, 2.0, 0.0), r'the footprint at the goal \(4.00, 2.00, 0 deg\) overlaps an obstacle'),
        ((2.0, 3.0, 0.0), (3.55, 2.0, 0.0), r'the footprint at the goal \(3.55, 2.00, 0 deg\) overlaps'),
        ((2.0, 3.0, 0.0), (math.nan, 2.0, 0.0), 'not finite'),
    ],
)
def test_what_cannot_be_planned_is_said(start, goal, text):
    with pytest.raises(PlanError, match=text):
        plan_of(door(), Pose2D(*start), Pose2D(*goal))


@pytest.mark.parametrize('turns', [3, -200, 1e300])
def test_a_yaw_may_have_been_counted_round_and_round(turns):
    costmap = grid(6.0, 6.0)
    yaw = turns * 2.0 * math.pi
    same = Pose2D(4.0, 3.0, float(wrap(yaw)))
    plan = planner_of().plan(costmap, Pose2D(2.0, 2.0, yaw), Pose2D(4.0, 3.0, yaw))
    assert np.array_equal(plan, planner_of().plan(costmap, Pose2D(2.0, 2.0, same.yaw), same))


def test_where_the_body_is_turned_matters():
    costmap = door()
    ends = Pose2D(2.0, 3.0, 0.0), Pose2D(3.55, 2.0, math.pi / 2.0)  # along the wall, 0.10 m off it
    check(plan_of(costmap, *ends), costmap, *ends)


def test_a_goal_moves_within_the_tolerance():
    costmap = door(0.8)
    planner = planner_of(LatticePlannerConfig(default_tolerance=1.0))
    planner.set_footprint(PADDED)
    start, goal = Pose2D(1.5, 3.0, 0.0), Pose2D(3.7, 1.5, 0.0)
    plan = planner.plan(costmap, start, goal)
    assert planner.goal_used != goal and planner.goal_used.distance(goal) <= 1.0 and planner.goal_used.yaw == goal.yaw
    check(plan, costmap, start, planner.goal_used)
    planner.plan(costmap, start, Pose2D(2.5, 1.5, 0.0))
    assert planner.goal_used == Pose2D(2.5, 1.5, 0.0)


def test_a_search_gives_up_in_words():
    with pytest.raises(PlanError, match=r'that was found in 20 states \(max_expansions\)'):
        plan_of(dead_end(), Pose2D(1.2, 2.45, math.pi), Pose2D(6.5, 1.5, -1.0), max_expansions=20)


def test_the_table_of_cells_is_never_full_however_few_states_are_allowed():
    """A search for an empty slot would not end."""
    for most in range(1, 20):
        tree = empty_tree(most)
        assert len(tree.keys) > len(tree.x)
    plan = plan_of(dead_end(), Pose2D(1.2, 2.45, math.pi), Pose2D(1.1, 2.45, math.pi), max_expansions=1)
    assert len(plan) > 1


def test_explore_says_where_a_plan_may_lead():
    reached = planner_of().explore(door(0.6 - 0.1), Pose2D(1.5, 3.0, 0.0))
    assert reached.shape == (120, 160) and reached[60, 40] and not reached[60, 120] and not reached[60, 78]
    reached = planner_of().explore(door(0.8), Pose2D(1.5, 3.0, 0.0))
    assert reached[60, 40] and reached[60, 120]


def test_a_search_in_vain_is_not_made_again_until_something_changes():
    costmap, planner = door(0.6), planner_of()
    start, goal = ENDS

    def searched(start=start, goal=goal):
        with pytest.raises(PlanError, match='no way'):
            planner.plan(costmap, start, goal)
        return planner.expanded > 0

    assert searched() and not searched() and not searched(Pose2D(1.8005, 2.2, 0.001))
    assert searched(Pose2D(1.8015, 2.2, 0.0)) and searched(Pose2D(1.8015, 2.2, 0.003))
    assert searched(start, Pose2D(6.3, 4.0, -0.41)) and searched() and not searched()
    costmap.costs[20, 20] = LETHAL
    assert searched() and not searched()
    planner.set_footprint(pad_footprint(np.array(FOOTPRINT), 0.01))
    assert searched() and not searched()
    costmap.costs[:] = door(0.8).costs
    assert len(planner.plan(costmap, start, goal)) > 10 and planner.expanded > 0


@pytest.mark.parametrize(
    'corners',
    [
        circle_footprint(0.3),
        np.array([[0.9, 0.0], [-0.2, 0.35], [-0.2, -0.35]]),
        np.array([[0.2, 0.2], [0.2, -0.2], [-0.6, -0.25], [-0.6, 0.25]]),
    ],
)
def test_any_polygon_fits_where_it_fits(corners):
    costmap = door(0.9)
    start, goal = Pose2D(1.8, 2.2, 0.4), Pose2D(6.3, 4.0, 2.0)
    check(plan_of(costmap, start, goal, corners), costmap, start, goal, corners)


def test_another_footprint_is_taken_at_once():
    costmap, planner = door(0.8), planner_of()
    planner.plan(costmap, *ENDS)
    planner.set_footprint(pad_footprint(np.array(FOOTPRINT), 0.15))
    with pytest.raises(PlanError, match='no way'):
        planner.plan(costmap, *ENDS)


def test_a_costmap_that_changed_is_looked_at_anew():
    costmap, planner = door(0.8), planner_of()
    planner.plan(costmap, *ENDS)
    costmap.costs[60, 80] = LETHAL  # a post in the door
    with pytest.raises(PlanError, match='no way'):
        planner.plan(costmap, *ENDS)


@pytest.mark.parametrize(
    'name, value',
    [
        ('speed', 0.0),
        ('turn_rate', -1.0),
        ('hard_margin', -0.01),
        ('least_margin', 1.01),
        ('clearance', 0.0),
        ('greed', 0.5),
        ('clearance_weight', -1.0),
        ('max_expansions', 0),
        ('reverse_factor', math.nan),
    ],
)
def test_bad_parameters_are_named(name, value):
    faults = LatticePlannerConfig(**{name: value}).faults()
    assert len(faults) == 1 and faults[0].startswith(f'{name} is {value!r}, allowed are')
    assert LatticePlannerConfig().faults() == []


# -- SARA's maps ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize('name', ['flat', 'school', 'hall'])
def test_where_navfn_finds_a_way_so_does_the_body(name):
    costmap = own(name)
    poses = free_poses(costmap, 24, seed=sum(name.encode()))
    navfn, ways = NavfnROS(NavfnConfig(allow_unknown=False)), []
    for start, goal in zip(poses[::2], poses[1::2]):
        try:
            shortest = path_length(navfn.plan(costmap, start, goal))
        except PlanError:
            continue
        plan = plan_of(costmap, start, goal)
        check(plan, costmap, start, goal)
        ways.append(path_length(plan) - 1.25 * shortest)
    assert len(ways) >= 8 and max(ways) < 2.5  # room to turn may lie off the way
