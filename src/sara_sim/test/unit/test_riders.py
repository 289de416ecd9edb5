"""Simulated riders: the way is followed, each impairment does to the stick what it says, and a seed tells all luck."""

import math

import numpy as np
import pytest

from sara_common.planar import advanced
from sara_sim.riders.driving import BlindDriver, Manner, WayDriver
from sara_sim.riders.impairments import FourDirections, Jerks, Late, OneSided, Tremor
from sara_sim.riders.manoeuvres import Astern, Holder, InTurn, Turner
from sara_sim.riders.riders import RIDERS, Task, rider
from sara_sim.riders.stick import CENTRED, Stick
from sara_sim.riders.way import Way, rounded

DT = 0.05
CORNER = (0.0, 0.0), (3.0, 0.0), (3.0, 3.0)
TASK = Task(rounded(CORNER, 0.7), ((3.0, 0.0), (3.0, 3.0)))


class Steady:
    """A rider who always wants the same."""

    arrived = False

    def __init__(self, wanted):
        self.wanted = wanted

    def stick(self, _t, _pose):
        return self.wanted


def driven(person, start=(0.0, 0.0, 0.0), seconds=90.0, held=lambda pose: False):
    """(poses, sticks) of an ideal chair that a rider steers until they have arrived. held: whether it stands there."""
    pose, poses, sticks = start, [start], []
    for k in range(round(seconds / DT)):
        stick = person.stick(k * DT, pose)
        sticks.append(stick)
        if person.arrived:
            break
        if not held(pose) or stick.forward < 0.0:
            pose = advanced(*pose, 0.4 * stick.forward, 0.47 * stick.left, DT)
        poses.append(pose)
    return np.array(poses), sticks


def sticks_of(person, seconds=20.0):
    """(n, 2) what a rider's stick does, 20 times a second, while the chair stands at the origin."""
    return np.array([person.stick(k * DT, (0.0, 0.0, 0.0)) for k in range(round(seconds / DT))])


def away_from(points, poses):
    """The greatest distance (m) of poses from points of a way."""
    return max(min(math.dist(pose[:2], point) for point in points) for pose in poses)


def test_the_expert_follows_the_way_to_its_end():
    person = WayDriver(TASK.way)
    poses, _ = driven(person)
    assert person.arrived and math.dist(poses[-1][:2], (3.0, 3.0)) < 0.25
    assert away_from(person.way.points, poses) < 0.12


def test_near_a_narrow_place_one_goes_slowly():
    fast = max(stick.forward for stick in driven(WayDriver(((0.0, 0.0), (4.0, 0.0))))[1])
    slow = max(
        stick.forward
        for stick in driven(WayDriver(((0.0, 0.0), (4.0, 0.0)), ((2.0, 0.0),), Manner(narrow_near=9.0)))[1]
    )
    assert fast == pytest.approx(0.85) and slow == pytest.approx(0.6 * 0.85)


def test_what_lies_behind_is_turned_to_in_place():
    poses, sticks = driven(WayDriver(((0.0, 0.0), (3.0, 0.0))), (0.0, 0.0, 3.0))
    turning = [stick for stick in sticks if stick.forward == 0.0 and stick != CENTRED]
    assert turning[0].left < 0.0 and all(stick.left < 0.0 for stick in turning)
    assert np.hypot(*poses[: len(turning), :2].T).max() == 0.0


def test_what_is_seen_is_as_old_as_the_reaction():
    person = WayDriver(((0.0, 0.0), (9.0, 0.0)), manner=Manner(reaction=0.2))
    lefts = [person.stick(k * DT, (0.0, 0.0 if k < 10 else 0.3, 0.0)).left for k in range(20)]
    assert lefts[:14] == [0.0] * 14 and lefts[14] < 0.0


def test_who_does_not_get_on_lets_go_backs_off_and_tries_again():
    _, sticks = driven(WayDriver(((0.0, 0.0), (3.0, 0.0))), seconds=12.0, held=lambda pose: pose[0] > 1.0)
    backs = [k for k, stick in enumerate(sticks) if stick.forward < 0.0]
    quiet = [k for k, stick in enumerate(sticks) if stick == CENTRED and k < backs[0]]
    assert len(quiet) * DT == pytest.approx(1.3, abs=0.1)
    assert backs == list(range(backs[0], backs[-1] + 1)) and len(backs) * DT == pytest.approx(1.6, abs=0.1)
    assert sticks[backs[-1] + 1].forward > 0.0


def test_where_there_is_no_backing_off_one_goes_ahead_a_little():
    person = WayDriver(((0.0, 0.0), (-3.0, 0.0)))  # which lies behind: a turn in place that is held
    pushes = [stick.forward for k in range(300) if (stick := person.stick(k * DT, (0.0, 0.0, 0.0))).forward]
    turn = pushes.index(0.5)
    assert set(pushes[:turn]) == {-0.5} and turn * DT == pytest.approx(1.6, abs=0.1)


def test_the_blind_head_straight_for_one_goal_after_the_other():
    person = BlindDriver(((3.0, 0.0), (3.0, 3.0)))
    poses, _ = driven(person, (0.0, 0.5, 0.0))
    assert person.arrived
    first = poses[poses[:, 0] < 2.0]
    line = 0.5 - 0.5 * first[:, 0] / 3.0
    assert np.abs(first[:, 1] - line).max() < 0.25


def test_a_tremor_shakes_within_its_band():
    shaken = sticks_of(Tremor(Steady(Stick(0.0, 0.5)), 4), 51.2)
    for column, middle in ((0, 0.0), (1, 0.5)):
        power = np.abs(np.fft.rfft(shaken[:, column] - middle)) ** 2
        rates = np.fft.rfftfreq(len(shaken), DT)
        assert power[(rates > 2.8) & (rates < 6.2)].sum() > 0.95 * power.sum()
        assert 0.2 < np.abs(shaken[:, column] - middle).max() <= 0.6
    assert (sticks_of(Tremor(Steady(CENTRED), 4)) == 0.0).all()


def test_jerks_are_pushes_that_end():
    pushed = np.hypot(*(sticks_of(Jerks(Steady(Stick(0.0, 0.5)), 1), 300.0) - (0.0, 0.5)).T) > 1e-9
    begins = np.count_nonzero(np.diff(pushed.astype(int)) == 1)
    assert 60 < begins < 120  # one in 3.4 s
    assert pushed.mean() == pytest.approx(0.4 / 3.4, abs=0.04)


def test_the_late_do_what_was_wanted_before():
    class Counting(Steady):
        def stick(self, t, _pose):
            return Stick(0.0, min(0.1 + t, 1.0))

    late = sticks_of(Late(Counting(None), 0.4), 0.8)
    assert (late[:8] == 0.0).all()
    assert late[8:, 1] == pytest.approx(0.1 + DT * np.arange(8))


def test_the_one_sided_drift_to_the_side_they_neglect():
    left = OneSided(Steady(Stick(-0.5, 0.5)), 0, side=1, bias=0.2, seen=0.6)
    assert left.stick(0.0, (0.0, 0.0, 0.0)) == pytest.approx((-0.1, 0.5))
    right = OneSided(Steady(Stick(-0.5, 0.5)), 0, side=-1, bias=0.2, seen=0.6)
    assert right.stick(0.0, (0.0, 0.0, 0.0)) == pytest.approx((-0.7, 0.5))
    assert {OneSided(Steady(CENTRED), seed).side for seed in range(20)} == {-1, 1}


def test_four_directions_are_one_at_a_time_and_chosen_once_a_second():
    wanted = Steady(Stick(0.1, 0.8))
    person = FourDirections(wanted)
    assert person.stick(0.0, (0.0, 0.0, 0.0)) == (0.0, 0.7)
    wanted.wanted = Stick(-0.5, 0.8)
    assert person.stick(0.95, (0.0, 0.0, 0.0)) == (0.0, 0.7)
    assert person.stick(1.0, (0.0, 0.0, 0.0)) == (-0.6, 0.0)
    wanted.wanted = Stick(0.0, -0.5)
    assert person.stick(2.0, (0.0, 0.0, 0.0)) == (0.0, -0.7)
    wanted.wanted = CENTRED
    assert person.stick(3.0, (0.0, 0.0, 0.0)) == CENTRED


@pytest.mark.parametrize('name', RIDERS)
def test_the_same_seed_steers_the_same_and_arrives(name):
    one, other = (driven(rider(name, TASK, 5), seconds=200.0) for _ in range(2))
    assert one[1] == other[1]
    assert math.dist(one[0][-1][:2], (3.0, 3.0)) < 0.3
    assert np.abs(np.array(one[1])).max() <= 1.0


@pytest.mark.parametrize('name', ['tremor', 'jerks'])
def test_another_seed_is_other_luck(name):
    assert driven(rider(name, TASK, 5))[1] != driven(rider(name, TASK, 6))[1]


def test_a_way_that_comes_by_twice_is_not_cut_short():
    way = Way(((0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 0.1)))
    way.go_on(0.5, 0.1)
    assert way.reached == pytest.approx(0.5, abs=0.05)
    way.go_on(0.4, 0.1)
    assert way.reached == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize('points', [((0.0, 0.0),), ((1.0, 1.0), (1.0, 1.0))])
def test_a_way_without_length_is_refused(points):
    with pytest.raises(ValueError, match='two points or more'):
        Way(points)


def test_rounded_corners_stay_near_the_line():
    points = np.array(rounded(CORNER, 0.7))
    assert tuple(points[0]) == CORNER[0] and tuple(points[-1]) == CORNER[-1]
    assert min(math.dist(point, CORNER[1]) for point in points) == pytest.approx(0.25 * 0.7 * math.sqrt(2), abs=0.03)
    headings = np.unwrap(np.arctan2(*np.diff(points, axis=0).T[::-1]))
    assert np.abs(np.diff(headings)).max() < 0.35


def test_somebody_backs_up_along_a_way():
    person = Astern(WayDriver(rounded(CORNER, 0.7), manner=Manner(arrival=0.12)))
    poses, sticks = driven(person, (0.0, 0.0, math.pi))
    assert person.arrived and min(stick.forward for stick in sticks) < -0.5
    assert max(stick.forward for stick in sticks) <= 0.0
    assert math.dist(poses[-1, :2], CORNER[-1]) < 0.15 and abs(poses[-1, 2] + 0.5 * math.pi) < 0.2


@pytest.mark.parametrize('yaw', [math.pi, 2.0, -2.0, 0.3, -0.3])
def test_somebody_turns_in_place_the_short_way(yaw):
    person = Turner(yaw)
    poses, sticks = driven(person)
    assert person.arrived and all(stick.forward == 0.0 for stick in sticks)
    assert (poses[:, :2] == 0.0).all() and sticks[-1] == CENTRED
    assert abs(math.remainder(poses[-1, 2] - yaw, 2.0 * math.pi)) < 0.25  # an ideal chair stops at once
    assert np.abs(np.diff(poses[:, 2])).sum() < abs(yaw) + 0.1


def test_one_thing_is_done_after_the_other_with_a_pause_between():
    person = InTurn([WayDriver(((0.0, 0.0), (1.0, 0.0))), Turner(math.pi), Astern(WayDriver(((1.0, 0.0), (2.0, 0.0))))])
    poses, sticks = driven(person)
    assert person.arrived and abs(poses[-1, 0] - 2.0) < 0.3
    assert sum(stick == CENTRED for stick in sticks) >= 2 * round(1.0 / DT)


def test_a_stick_is_held():
    assert (sticks_of(Holder(Stick(0.2, 0.5))) == (0.2, 0.5)).all()
