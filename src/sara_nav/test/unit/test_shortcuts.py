"""Turns while driving in place of turns in place: laws of every path with shortcuts, and where they are made."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_common.platforms import load
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.clearance import room
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import pad_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.lattice.body import ROUGH, gap, place
from sara_nav.lattice.config import LatticePlannerConfig
from sara_nav.lattice.driving import FARTHEST, room_ahead
from sara_nav.lattice.dubins import dubins_join, joins_of
from sara_nav.lattice.field import Field
from sara_nav.lattice.problem import Problem
from sara_nav.lattice.shortcuts import BITTY, cut, delay, least_seconds, merged, run_up_seconds, with_shortcuts
from sara_nav.lattice.world import Body
from sara_nav.planners.planning import PlanError

PADDED = pad_footprint(np.array(load('sara').footprint), 0.01)
CONFIG = LatticePlannerConfig(curve_radius=0.4, max_vel_x=0.8, max_vel_theta=0.8, max_lateral_acc=0.3)
LETHAL = 254
SHARES = np.linspace(0.0, 1.0, 20)


def costmap_of(walls, size=8.0):
    """A Costmap of size x size m whose cells are obstacles where a wall (x0, y0, x1, y1), m, reaches in."""
    n = round(size / 0.05)
    costs = np.zeros((n, n), np.uint8)
    for x0, y0, x1, y1 in walls:
        costs[
            math.floor(y0 / 0.05 + 1e-6) : math.ceil(y1 / 0.05 - 1e-6),
            math.floor(x0 / 0.05 + 1e-6) : math.ceil(x1 / 0.05 - 1e-6),
        ] = LETHAL
    return Costmap(costs, GridGeometry(n, n, 0.05, 0.0, 0.0))


def problem_of(walls, config=CONFIG, size=8.0):
    return Problem(config, Field(costmap_of(walls, size), True, 4.0), Body(PADDED, 0.05))


def steps_of(problem, start, goal):
    """The moves (n, 5) of a plan."""
    start, goal = Pose2D(*start), Pose2D(*goal)
    return problem._steps(start, goal, problem._limit(start), problem._limit(goal))


def turned_in_place(steps):
    return float(np.abs(steps[steps[:, 3] == 0.0, 4]).sum())


def seconds_as_timed(by, steps):
    """s of moves (n, 5) by what shortcuts are chosen by."""
    moves, start = np.ascontiguousarray(steps[:, 3:]), steps[0, :3].copy()
    return least_seconds(by.world.rules, moves, 3)[0] + delay(by, start, moves, (0.0, 0.0), np.inf)


def least_gap(problem, start, steps):
    """m along moves (n, 5) from a Pose2D."""
    least, pose = problem.gap(start), start
    for length, turn in steps[:, 3:].tolist():
        least = min([least, *(gap(problem.world, place(pose, length, turn, share), 0.0) for share in SHARES)])
        pose = place(pose, length, turn, 1.0)
    return least


coordinate, angle = st.floats(0.8, 5.2), st.floats(-math.pi, math.pi)
box = st.tuples(st.floats(0.0, 5.5), st.floats(0.0, 5.5), st.floats(0.05, 1.5), st.floats(0.05, 1.5))


@settings(max_examples=20, suppress_health_check=[HealthCheck.filter_too_much])
@given(st.lists(box, max_size=5), st.tuples(coordinate, coordinate, angle), st.tuples(coordinate, coordinate, angle))
@example([], (3.0, 3.0, 0.5), (3.0, 3.0, 0.5))
@example([], (3.0, 3.0, 0.5), (3.0, 3.0, -2.5))
def test_shortcuts_lead_to_the_same_end_as_soon_or_sooner_and_keep_their_margins(boxes, start, goal):
    walls = [(x, y, x + w, y + h) for x, y, w, h in boxes]
    config = replace(CONFIG, max_expansions=1500)
    problem, plain = problem_of(walls, config, 6.0), problem_of(walls, replace(config, curve_radius=0.0), 6.0)
    assume(min(problem.gap(Pose2D(*start)), problem.gap(Pose2D(*goal))) >= CONFIG.hard_margin)
    try:
        before = steps_of(plain, start, goal)
    except PlanError:
        return
    by = config.shortcuts(problem.world, PADDED)
    found = with_shortcuts(by, Pose2D(*start), before)
    assert np.array_equal(found, with_shortcuts(by, Pose2D(*start), before))
    own_arcs = bool(np.any((before[:, 3] != 0.0) & (before[:, 4] != 0.0)))  # the search's, and rounded corners
    pose = Pose2D(*start)
    for x, y, yaw, length, turn in found.tolist():
        assert math.dist((x, y), pose[:2]) < 1e-9 and yaw == pose.yaw
        margin = config.curve_margin if length != 0.0 and turn != 0.0 and not own_arcs else config.hard_margin
        for share in SHARES:
            assert gap(problem.world, place(pose, length, turn, share), 0.0) > margin - ROUGH
        pose = place(pose, length, turn, 1.0)
    kept = min(least_gap(problem, Pose2D(*start), before), config.curve_margin)
    assert least_gap(problem, Pose2D(*start), found) > kept - ROUGH
    if len(found):
        assert math.dist(pose[:2], goal[:2]) < 1e-6
        assert abs(math.remainder(pose.yaw - goal[2], 2.0 * math.pi)) < 1e-6
        assert seconds_as_timed(by, found) <= seconds_as_timed(by, before) + BITTY


def test_in_the_open_the_chair_turns_as_it_drives():
    start, goal = (1.5, 1.5, math.pi / 2), (6.5, 6.5, math.pi / 4)
    stops, flows = (steps_of(problem_of([], config), start, goal) for config in (LatticePlannerConfig(), CONFIG))
    assert turned_in_place(stops) > 0.7
    assert turned_in_place(flows) < 1e-3 and (flows[flows[:, 4] != 0.0, 3] > 0.3).any()


def test_the_goal_is_come_to_straight_and_the_last_turn_stays_one():
    found = steps_of(problem_of([]), (1.5, 4.0, 0.0), (5.5, 4.0, math.pi / 2))  # a leg of the thesis's square
    assert found[-1, 3:].tolist() == pytest.approx([0.0, math.pi / 2])
    assert np.abs(found[:, 1] - 4.0).max() < 1e-6 and np.abs(found[:-1, 4]).max() < 1e-6


def test_a_chair_that_faces_the_wrong_way_turns_about_and_does_not_drive_astern():
    found = steps_of(problem_of([]), (2.0, 4.0, math.pi), (6.0, 4.0, 0.0))
    assert np.abs(found[:, 4]).sum() >= math.pi - 1e-6 and found[:, 3].min() >= 0.0


def test_where_there_is_no_room_for_an_arc_it_stops_and_turns():
    def turned(width):  # into the arm of a T-junction
        walls = [(0.0, 0.0, 8.0, 3.0), (0.0, 3.0 + width, 4.0 - 0.5 * width, 8.0)]
        walls.append((4.0 + 0.5 * width, 3.0 + width, 8.0, 8.0))
        return turned_in_place(steps_of(problem_of(walls), (1.0, 3.0 + 0.5 * width, 0.0), (4.0, 7.0, math.pi / 2)))

    assert turned(1.5) < 0.05 and turned(1.1) > 1.0


def test_an_arc_that_ends_close_before_a_narrow_place_counts_a_run_up():
    door = [(5.0, 0.0, 5.1, 3.6), (5.0, 4.4, 5.1, 8.0)]  # of 0.80 m
    world, rules = problem_of(door).world, problem_of(door).world.rules
    at = [run_up_seconds(world, Pose2D(5.0 - 0.55 - before, 4.0, 0.0), 0.5) for before in (0.05, 0.35, 1.0)]
    assert at[0] > at[1] > at[2] == 0.0 and at[0] <= rules.run_up_cost
    ahead, astern = Pose2D(4.0, 4.0, 0.0), Pose2D(4.0, 4.0, math.pi)
    assert run_up_seconds(world, astern, -0.5) == run_up_seconds(world, ahead, 0.5) > 0.0
    assert run_up_seconds(world, astern, 0.5) == 0.0


def test_a_dearer_stop_makes_fewer_turns_in_place():
    start, goal = (2.0, 2.0, 2.0), (5.0, 2.5, 0.2)
    turned = [
        turned_in_place(steps_of(problem_of([], replace(CONFIG, curve_stop=stop)), start, goal)) for stop in (0.0, 30.0)
    ]
    assert turned[0] > 0.5 and turned[1] < 0.05


def test_every_join_ends_at_its_pose_and_turns_no_sharper_than_its_radius():
    random, radii, moves, joined = np.random.default_rng(1), np.array([0.3, 1.0]), np.empty((3, 2)), 0
    for _ in range(60):
        start, end = random.uniform((-3.0, -3.0, -3.2), (3.0, 3.0, 3.2), (2, 3))
        for number in range(joins_of(radii)):
            if not dubins_join(number, start, end, radii, moves):
                continue
            pose, joined = Pose2D(*start), joined + 1
            for length, turn in moves.tolist():
                assert abs(turn) <= 1e-9 or length == 0.0 or abs(length / turn) >= radii.min() - 1e-9
                pose = place(pose, length, turn, 1.0)
            assert math.dist(pose[:2], end[:2]) < 1e-6
            assert abs(math.remainder(pose.yaw - end[2], 2.0 * math.pi)) < 1e-6
    assert joined > 60 * joins_of(radii) // 2


@pytest.mark.parametrize('sense', [1.0, -1.0])
def test_the_room_ahead_is_what_the_local_planner_sees(sense):
    problem, law = problem_of([(6.0, 0.0, 6.5, 8.0)]), CONFIG.shortcuts(problem_of([]).world, PADDED).driving
    for yaw in (0.0, 0.3, -0.5, 1.2):
        for x in (4.2, 4.6, 5.0):
            pose = Pose2D(x, 4.0, yaw if sense > 0.0 else yaw + math.pi)
            found = room_ahead(problem.world, law, pose, sense)
            world = LocalWorld(costmap_of([(6.0, 0.0, 6.5, 8.0)]), PADDED)
            seen = float(room(world, np.array([pose]), sense < 0.0, CONFIG.ahead_angle, 3.0).ahead[0])
            assert found <= FARTHEST and 0.45 * min(seen, FARTHEST) - 0.1 < found < 1.25 * seen + 0.1


def test_cut_and_merged_are_the_same_path():
    moves = np.array([[1.0, 0.0], [0.0, 1.3], [0.5, 0.4], [-0.7, 0.0]])
    pieces = cut(moves, 0.2, 0.3)
    assert np.abs(pieces[:, 0]).max() <= 0.2 + 1e-9 and np.abs(pieces[:, 1]).max() <= 0.3 + 1e-9
    assert merged(pieces) == pytest.approx(moves)
    assert len(merged(np.zeros((3, 2)))) == 0


@pytest.mark.parametrize(
    'name, value', [('curve_radius', -0.1), ('curve_margin', math.nan), ('max_lateral_acc', 0.0), ('narrow_vel', 0.0)]
)
def test_bad_parameters_are_named(name, value):
    faults = LatticePlannerConfig(**{name: value}).faults()
    assert len(faults) == 1 and faults[0].startswith(f'{name} is {value!r}')
