"""make_plan's search about the goal, and goals as clients send them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.goals.goal_input import GoalError, global_pose, planar_pose
from sara_nav.goals.goal_search import GivenUp, Nearby, cleared, places, search_plan
from sara_nav.grids.grid import GridGeometry
from sara_nav.planners.grid_planner import GridPlanner
from sara_nav.planners.navfn import NavfnROS

GEOMETRY = GridGeometry(80, 60, 0.1, -1.0, -1.0)


def costs(*blocks):
    """Return a Costmap, free but for rectangles (x0, y0, xn, yn) of obstacles, in cells."""
    grid = np.zeros(GEOMETRY.shape, np.uint8)
    for x0, y0, xn, yn in blocks:
        grid[y0:yn, x0:xn] = 254
    return Costmap(grid, GEOMETRY)


def peers_order(goal, tolerance):
    """The C++ search written down as it is: loops over growing squares."""
    step = 0.3 if tolerance >= 0.3 else tolerance
    result, ring = [], 1
    while ring * step <= tolerance + 1e-6 * step:
        for row in range(ring + 1):
            for column in range(ring + 1):
                if max(row, column) == ring:
                    for y in (-1, 1) if row else (1,):
                        for x in (-1, 1) if column else (1,):
                            result.append((goal.x + x * column * step, goal.y + y * row * step))
        ring += 1
    return [p for p in result if -1.0 <= p[0] < 7.0 and -1.0 <= p[1] < 5.0]


@given(st.floats(-1.5, 7.5), st.floats(-1.5, 5.5), st.floats(0.01, 2.0))
def test_places_and_their_order_are_the_peers(x, y, tolerance):
    goal = Pose2D(x, y, 0.0)
    found = [tuple(p) for p in places(goal, tolerance, GEOMETRY) if GEOMETRY.to_cell(*p) is not None]
    expected = [p for p in peers_order(goal, tolerance) if GEOMETRY.to_cell(*p) is not None]
    assert len(found) == len(expected)
    assert np.array(found) == pytest.approx(np.array(expected))


@pytest.mark.parametrize('x', [0.0, 1e9, -1e300])
@pytest.mark.parametrize('tolerance', [0.0, 1e-320, 1e-9, 1e9, 1e300])
def test_places_come_to_an_end_and_lie_on_the_map(x, tolerance):
    found = places(Pose2D(x, 2.0, 0.0), tolerance, GEOMETRY)
    assert len(found) <= 27 * 20 + 1
    assert all(-1.0 <= px <= 7.0 + 1e-9 and -1.0 <= py <= 5.0 + 1e-9 for px, py in found)


START = Pose2D(0.0, 0.0, 0.0)


@pytest.mark.parametrize('planner', [GridPlanner(), NavfnROS()])
def test_a_goal_in_an_obstacle_is_planned_to_nearby_and_the_goal_appended(planner):
    costmap, goal = costs((45, 25, 55, 35)), Pose2D(4.0, 2.0, 1.0)
    plan, text = search_plan(planner, costmap, START, goal)
    assert plan is None and 'obstacle' in text
    plan, text = search_plan(planner, costmap, START, goal, Nearby(1.0))
    assert plan[-1].tolist() == [4.0, 2.0, 1.0] and 'leads to' in text
    x, y = plan[-2, :2]
    assert costmap.cost_at(x, y) == 0 and max(abs(x - 4.0), abs(y - 2.0)) == pytest.approx(0.6)
    bare, _ = search_plan(planner, costmap, START, goal, Nearby(1.0, add_unreachable_goal=False))
    assert bare.tolist() == plan[:-1].tolist()


def test_the_exact_goal_is_first():
    plan, text = search_plan(GridPlanner(), costs(), START, Pose2D(4.0, 2.0, 1.0), Nearby(1.0))
    assert text == '' and plan[-1].tolist() == [4.0, 2.0, 1.0]


def test_what_cannot_be_reached_is_not_tried_where_the_planner_knows():
    """A closed chamber: navfn knows at once; without that knowledge the search comes to an end all the same."""
    tried = []

    class Counting(NavfnROS):
        def plan(self, *args):
            tried.append(args)
            return super().plan(*args)

    closed = costs((40, 20, 60, 21), (40, 40, 60, 41), (40, 20, 41, 41), (60, 20, 61, 41))
    assert search_plan(Counting(), closed, START, Pose2D(4.0, 2.0, 0.0), Nearby(0.9))[0] is None
    assert len(tried) == 1
    plan, _ = search_plan(Counting(), closed, START, Pose2D(4.0, 2.0, 0.0), Nearby(2.0))
    assert plan is not None and len(tried) == 3


def test_the_search_can_be_given_up():
    with pytest.raises(GivenUp):
        search_plan(
            GridPlanner(), costs((45, 25, 55, 35)), START, Pose2D(4.0, 2.0, 1.0), Nearby(1.0, give_up=lambda: True)
        )


def test_clearing_frees_a_square_about_the_robot_and_nothing_else():
    costmap = costs((0, 0, 80, 60))
    free = np.argwhere(cleared(costmap, START, 0.46).costs == 0) * 0.1 - 0.95
    assert free.min() == pytest.approx(-0.45) and free.max() == pytest.approx(0.45) and len(free) == 100
    assert (costmap.costs == 254).all()
    assert (cleared(costmap, Pose2D(100.0, 0.0, 0.0), 0.46).costs == 254).all()


# -- goals as they are sent
# ------------------------------------------------------------------------------------------------


def nowhere(frame):
    raise LookupError(f'"{frame}" does not exist')


def test_a_goal_in_another_frame_is_brought_into_the_global_one():
    there = Pose2D(1.0, 2.0, math.pi / 2)
    pose = global_pose('odom', (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), 'map', lambda frame: there)
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((1.0, 3.0, math.pi / 2))
    assert global_pose('/map', (1.0, 2.0, 0.0), (0.0, 0.0, 0.0, 1.0), 'map', nowhere) == Pose2D(1.0, 2.0, 0.0)


@pytest.mark.parametrize(
    'frame, position, quaternion, text',
    [
        ('', (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), 'frame_id is empty'),
        ('/', (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), 'frame_id is empty'),
        (
            'moon',
            (0.0, 0.0, 0.0),
            (0.0, 0.0, 0.0, 1.0),
            'Failed to transform the goal pose from moon into the map frame',
        ),
        ('map', (math.nan, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), 'NaN'),
        (
            'map',
            (0.0, 0.0, 0.0),
            (0.0, 0.0, 0.0, 0.0),
            'Aborting on goal because it was sent with an invalid quaternion',
        ),
        ('map', (0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0), 'invalid quaternion'),
        ('map', (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), 'about the vertical'),
    ],
)
def test_goals_that_are_none_are_refused_in_words(frame, position, quaternion, text):
    with pytest.raises(GoalError, match=text):
        global_pose(frame, position, quaternion, 'map', nowhere)


@given(st.floats(-math.pi, math.pi), st.floats(-100.0, 100.0))
def test_poses_survive_the_way_through_a_quaternion(yaw, x):
    pose = planar_pose((x, 1.0, 0.0), (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)))
    assert (pose.x, pose.y) == (x, 1.0) and math.cos(pose.yaw - yaw) == pytest.approx(1.0)


@given(st.floats(-math.pi, math.pi), st.floats(2e-3, 1e6))
def test_a_goal_s_quaternion_of_any_length_is_its_direction(yaw, length):
    """The peer normalises it: RViz and scripts send (0, 0, 0, 2) and the like."""
    pose = planar_pose((0.0, 0.0, 0.0), (0.0, 0.0, length * math.sin(0.5 * yaw), length * math.cos(0.5 * yaw)))
    assert math.cos(pose.yaw - yaw) == pytest.approx(1.0)


@pytest.mark.parametrize('quaternion', [(0.0, 0.0, 0.0, 5e-4), (0.0, 0.0, 0.0, 1e200), (0.0, 2.0, 0.0, 2.0)])
def test_a_goal_s_quaternion_without_a_direction_is_refused(quaternion):
    with pytest.raises(GoalError, match='invalid quaternion'):
        planar_pose((0.0, 0.0, 0.0), quaternion)
