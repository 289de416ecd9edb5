"""Turning onto a heading and ending a drive on bases that answer late, slip and shake: always there, never hunting."""

import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D, wrap
from sara_nav.sampled.goal_stage import DONE, FACE, FOLLOW, ROTATE, STOP, Cycle, GoalLimits, GoalStage
from sara_nav.sampled.in_place_turn import InPlaceTurn, Rates, TurnLimits
from sara_nav.sampled.turn_gain import TurnGain

LIMITS = GoalLimits(
    xy_goal_tolerance=0.1,
    yaw_goal_tolerance=0.05,
    latch_xy_goal_tolerance=False,
    max_vel_x=0.55,
    max_vel_theta=1.0,
    min_in_place_vel_theta=0.4,
    acc_lim_x=2.5,
    acc_lim_theta=3.2,
    trans_stopped_vel=0.01,
    theta_stopped_vel=0.01,
    horizon=1.0,
    blind=0.1,
)


class Room:
    """Where every way, or none, is free, and turns are where ``turn`` says so."""

    def __init__(self, way=True, turn=lambda pose: True):
        self.way, self.turn = way, turn

    def straight_is_free(self, pose, goal):
        return self.way

    def turn_is_free(self, pose, yaw):
        return self.turn(pose)


FREE = Room()


class Base:
    """A unicycle with first-order lag, whose pose and speed are seen ``delay`` s late, with noise on the pose."""

    def __init__(self, pose, lag, delay, slip, noise=0.0, seed=0):
        self.pose, self.lag, self.slip, self.noise = pose, lag, slip, noise
        self.speed = 0.0, 0.0
        self.late = [(pose, self.speed)] * (1 + round(delay / 0.01))
        self.random = random.Random(seed)

    def go(self, v, w, seconds):
        for _ in range(round(seconds / 0.01)):
            share = 1.0 - math.exp(-0.01 / self.lag)
            self.speed = (
                self.speed[0] + share * (v - self.speed[0]),
                self.speed[1] + share * (w / self.slip - self.speed[1]),
            )
            self.pose = self.pose.advance(*self.speed, 0.01)
            self.late = self.late[1:] + [(self.pose, self.speed)]

    def seen(self, delay):
        pose, speed = self.late[0]
        pose = Pose2D(
            pose.x + self.random.gauss(0, self.noise),
            pose.y + self.random.gauss(0, self.noise),
            pose.yaw + self.random.gauss(0, self.noise),
        )
        return pose.advance(*speed, delay), speed


@settings(max_examples=60)
@given(
    st.floats(-3.14, 3.14),
    st.floats(0.02, 0.25),
    st.floats(0.0, 0.2),
    st.floats(0.9, 1.4),
    st.sampled_from([0.05, 0.1]),
    st.floats(0.1, 0.5),
)
def test_a_turn_in_place_ends_within_tolerance_without_hunting(angle, lag, delay, slip, period, slowest):
    turn, limits = InPlaceTurn(), TurnLimits(slowest, 1.0, 3.2, 0.01)
    base, last, rates, t = Base(Pose2D(0.0, 0.0, 0.0), lag, delay, slip), 0.0, [], 0.0
    while t < 60.0:
        pose, speed = base.seen(delay)
        rate = turn.rate(t, period, wrap(angle - pose.yaw), Rates(speed[1], last), limits, 0.05)
        if rate is None:
            break
        assert rate == 0.0 or slowest <= abs(rate) <= 1.0
        if rate and last * rate > 0.0:
            assert abs(rate) - abs(last) <= 3.2 * period + 1e-9
        rates.append(rate)
        last = rate
        base.go(0.0, rate, period)
        t += period
    assert t < 45.0 and abs(wrap(angle - base.pose.yaw)) <= 0.05 + 0.002
    senses = [math.copysign(1.0, r) for r in rates if r]
    assert sum(a != b for a, b in zip(senses, senses[1:])) <= 3, 'hunting'
    if senses:
        assert senses[0] == math.copysign(1.0, angle), 'the short way'


def turns(goals, lag, delay, slowest, fastest, tolerance):
    """Turn to headings (rad) one after the other; returns the InPlaceTurn, and how often each was set out for."""
    turn, limits = InPlaceTurn(), TurnLimits(slowest, fastest, 3.2, 0.01)
    base, t, starts = Base(Pose2D(0.0, 0.0, 0.0), lag, delay, 1.0), 0.0, []
    for goal in goals:
        turn.begin()
        last, begun = 0.0, 0
        while True:
            pose, speed = base.seen(delay)
            rate = turn.rate(t, 0.05, wrap(goal - pose.yaw), Rates(speed[1], last), limits, tolerance)
            if rate is None:
                break
            begun += rate != 0.0 and last == 0.0
            last = rate
            base.go(0.0, rate, 0.05)
            t += 0.05
        starts.append(begun)
    return turn, starts


def test_the_coast_is_learned_so_that_the_second_turn_needs_no_correction():
    turn, starts = turns((1.5, 0.0, 1.5), 0.2, 0.1, 0.4, 1.0, 0.03)
    assert starts[-1] == 1 and 0.1 < turn.coast < 0.4


def test_before_a_stop_was_seen_a_turn_ends_where_the_tolerance_begins():
    turn, starts = turns((1.5, 0.0, 1.5, 0.0), 0.4, 0.1, 0.2, 0.2, 0.05)
    assert starts == [1, 1, 1, 1] and 0.35 < turn.coast < 0.55


@settings(max_examples=40)
@given(
    st.floats(-0.7, 0.7),
    st.floats(-0.7, 0.7),
    st.floats(-3.1, 3.1),
    st.floats(-3.1, 3.1),
    st.floats(0.02, 0.2),
    st.floats(0.0, 0.15),
    st.floats(1.0, 1.3),
    st.sampled_from([0.0, 0.003]),
    st.booleans(),
)
def test_a_goal_within_the_horizon_is_approached_straight_and_reached(
    x, y, yaw, goal_yaw, lag, delay, slip, noise, latch
):
    """As when sampling has stalled: from any place and heading about the goal, with a pose that shakes."""
    limits = GoalLimits(**{**LIMITS.__dict__, 'latch_xy_goal_tolerance': latch})
    stage, base = GoalStage(), Base(Pose2D(x, y, yaw), lag, delay, slip, noise)
    goal, last, t = Pose2D(0.0, 0.0, goal_yaw), (0.0, 0.0), 0.0
    while stage.phase != DONE and t < 90.0:
        pose, speed = base.seen(delay)
        command = stage.update(Cycle(t, 0.05, pose, speed, last, goal, limits, FREE))
        last = (0.0, 0.0) if command is None else command
        assert 0.0 <= last[0] <= limits.max_vel_x and abs(last[1]) <= limits.max_vel_theta
        base.go(*last, 0.05)
        t += 0.05
    assert stage.phase == DONE and stage.failed(base.pose, goal) == ''
    assert base.pose.distance(goal) <= limits.xy_goal_tolerance + (0.05 if latch else 0.0) + 4 * noise
    assert abs(wrap(base.pose.yaw - goal_yaw)) <= limits.yaw_goal_tolerance + 4 * noise + 0.002


def test_stages_follow_one_another_and_stops_keep_the_accelerations():
    stage, last, seen = GoalStage(), (0.5, 0.4), []
    goal = Pose2D(0.0, 0.0, 1.0)
    for i in range(20):
        command = stage.update(Cycle(0.05 * i, 0.05, Pose2D(-0.08, 0.0, 0.0), last, last, goal, LIMITS, FREE))
        if stage.phase == STOP:
            assert last[0] - command[0] <= 2.5 * 0.05 + 1e-9 and last[1] - command[1] <= 3.2 * 0.05 + 1e-9
        last = command
        seen.append(stage.phase)
    assert list(dict.fromkeys(seen)) == [STOP, ROTATE] and last[0] == 0.0 and last[1] >= 0.4


def test_it_does_not_stop_at_the_rim_of_the_tolerance_while_it_gets_further_in():
    stage, goal = GoalStage(), Pose2D(0.0, 0.0, 0.0)

    def phase(t, x):
        stage.update(Cycle(t, 0.05, Pose2D(x, 0.0, 0.0), (0.1, 0.0), (0.1, 0.0), goal, LIMITS, FREE))
        return stage.phase

    assert phase(0.0, -0.12) == FOLLOW and phase(0.1, -0.098) == FOLLOW and phase(0.5, -0.09) == FOLLOW
    assert phase(0.7, -0.09) == STOP, 'after half a second'
    stage.begin()
    assert phase(1.0, -0.098) == FOLLOW and phase(1.1, -0.084) == STOP, 'well inside'


def test_only_a_free_way_is_approached_and_only_from_within_the_horizon():
    for pose, way, expected in (
        (Pose2D(0.05, 0.08, 0.0), True, FACE),
        (Pose2D(0.05, 0.08, 0.0), False, FOLLOW),
        (Pose2D(2.0, 0.0, 0.0), True, FOLLOW),
    ):
        stage = GoalStage()
        tight = GoalLimits(**{**LIMITS.__dict__, 'xy_goal_tolerance': 0.05})
        stage.update(Cycle(0.0, 0.05, pose, (0.0, 0.0), (0.0, 0.0), Pose2D(0.0, 0.0, 0.0), tight, Room(way)))
        assert stage.phase == expected


def test_without_room_to_turn_at_the_rim_of_the_tolerance_it_drives_to_its_middle():
    goal, t, last = Pose2D(0.0, 0.0, 2.0), 0.0, (0.0, 0.0)
    room = Room(turn=lambda pose: pose.distance(goal) < 0.03)
    stage, base = GoalStage(), Base(Pose2D(-0.08, 0.0, 0.3), 0.1, 0.1, 1.0)
    while stage.phase != DONE and t < 30.0:
        pose, speed = base.seen(0.1)
        last = stage.update(Cycle(t, 0.05, pose, speed, last, goal, LIMITS, room)) or (0.0, 0.0)
        if stage.phase == ROTATE:
            assert base.pose.distance(goal) < 0.03
        base.go(*last, 0.05)
        t += 0.05
    assert stage.phase == DONE


def test_a_goal_that_cannot_be_approached_is_given_up():
    """A base that does not move: every approach times out of reach, and after eight it says so."""
    stage, goal, t, last = GoalStage(), Pose2D(0.0, 0.0, 0.0), 0.0, (0.0, 0.0)
    stage.take_over(Cycle(t, 0.05, Pose2D(-0.5, 0.0, 0.0), last, last, goal, LIMITS, FREE))
    where = Pose2D(-0.5, 0.0, 0.0)
    while not stage.failed(where, goal):
        where = Pose2D(0.2 if stage.phase == 'approach goal' else -0.5, 0.0, 0.0)  # it always slides past the goal
        command = stage.update(Cycle(t, 0.05, where, (0.0, 0.0), last, goal, LIMITS, FREE))
        last = command or (0.0, 0.0)
        t += 0.05
        assert t < 120.0
    assert 'xy_goal_tolerance' in stage.failed(where, goal)


def test_the_turn_gain_is_what_the_base_makes_of_commands():
    for slip in (1.0, 1.27):
        gain, base = TurnGain(), Base(Pose2D(0.0, 0.0, 0.0), 0.15, 0.1, slip)
        for i in range(200):
            command = 0.6 * math.sin(0.05 * i)
            gain.update(0.05, command, base.late[0][1][1])
            base.go(0.0, command, 0.05)
        assert gain.value == pytest.approx(1.0 / slip, rel=0.08)
    still = TurnGain()
    for _ in range(500):
        still.update(0.05, 0.0, 0.0)
    assert still.value == 1.0
    stuck = TurnGain()
    for _ in range(500):
        stuck.update(0.05, 0.5, 0.0)
    assert stuck.value == 0.5
