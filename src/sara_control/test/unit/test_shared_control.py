"""Laws of shared control, for drawn worlds, wishes and poses, and what it does at doors, walls and tables."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_common.planar import advanced
from sara_common.platforms import load, parameters
from sara_control.assist import docking
from sara_control.assist.assist_config import AssistConfig
from sara_control.assist.correction import Correction, sentence
from sara_control.assist.help_profiles import HelpProfiles
from sara_control.assist.local_grid import (
    GridError,
    LocalGrid,
    distance_at,
    field_of,
    gap,
    gaps_beside,
    outline_of,
    too_near,
)
from sara_control.assist.shared_control import SharedControl

CELL = 0.05
CONFIG = AssistConfig.of()
BODY = {'length': 1.0, 'width': 0.6}
FINE = outline_of(CONFIG.length, CONFIG.width, 0.02)
NAN = math.nan
speeds = st.floats(-0.4, 0.4)
turns = st.floats(-0.6, 0.6)


def world(width, height, *boxes, edge=True):
    """A LocalGrid of a room (m) with boxes (x0, y0, x1, y1; m)."""
    blocked = np.zeros((round(height / CELL), round(width / CELL)), bool)
    if edge:
        blocked[[0, -1]] = blocked[:, [0, -1]] = True
    for x0, y0, x1, y1 in boxes:
        blocked[round(y0 / CELL) : round(y1 / CELL), round(x0 / CELL) : round(x1 / CELL)] = True
    return LocalGrid(blocked, CELL, 0.0, 0.0)


DOOR = world(8.0, 6.0, (4.0, 0.0, 4.1, 2.6), (4.0, 3.4, 4.1, 6.0))  # 0.80 m wide, its middle at (4.05, 3)

AT_THE_WALL = (4.0 - 0.5 * CONFIG.length - 0.06, 1.5, 0.0)  # before it, beside the door

PILLAR = (5.0, 3.2, 5.4, 3.8)


def knows(grid, config=CONFIG, t=0.0):
    assist = SharedControl(config)
    assist.on_grid(grid, t)
    return assist


def drive(grid, pose, rider, seconds=30.0, config=CONFIG):
    """[(pose, Assisted, wish, gap)] of a robot whose speeds follow within 0.4 m/s2 and 1.2 rad/s2."""
    assist, field = SharedControl(config), field_of(grid, 1.5)
    v = w = 0.0
    rows = []
    for k in range(round(seconds / 0.05)):
        t = 0.05 * k
        if k % 4 == 0:
            assist.on_grid(grid, t)
        wish = rider(t, pose)
        if wish is None:
            break
        result = assist.step(t, wish, pose, (v, w))
        v += min(max(result.v - v, -0.04), 0.02)
        w += min(max(result.w - w, -0.06), 0.06)
        pose = advanced(*pose, v, w, 0.05)
        rows.append((pose, result, wish, gap(field, FINE, *pose)))
    return rows


def heads_for(x, y, until, speed=0.34):
    """A rider who points the stick at a place (m) until `until` (pose) is true."""

    def rider(_t, pose):
        if until(pose):
            return None
        bearing = math.remainder(math.atan2(y - pose[1], x - pose[0]) - pose[2], math.tau)
        return speed, min(max(1.2 * bearing, -0.5), 0.5)

    return rider


@st.composite
def places(draw):
    """A world with up to four boxes, and a pose that is free in it."""
    boxes = draw(st.lists(st.tuples(st.floats(0.5, 5.0), st.floats(0.5, 5.0), st.floats(0.1, 1.5)), max_size=4))
    grid = world(6.0, 6.0, *((x, y, x + size, y + size) for x, y, size in boxes))
    return grid, draw(st.tuples(st.floats(0.0, 6.0), st.floats(0.0, 6.0), st.floats(-math.pi, math.pi)))


class TestLaws:
    @given(places(), speeds, turns, st.tuples(speeds, turns))
    @settings(max_examples=150, deadline=None)
    def test_it_is_never_faster_than_asked_and_never_goes_the_other_way(self, place, v, w, driven):
        grid, pose = place
        result = knows(grid).step(0.0, (v, w), pose, driven)
        assert abs(result.v) <= abs(v) + 1e-12 and result.v * v >= 0.0
        assert abs(result.w) <= max(CONFIG.max_angular, abs(w)) + 1e-12
        if abs(v) < 0.04:
            assert result.w * w >= 0.0 and abs(result.w) <= abs(w)

    @given(places(), speeds, turns)
    @settings(max_examples=50, deadline=None)
    def test_what_is_not_corrected_is_the_wish(self, place, v, w):
        grid, pose = place
        result = knows(grid).step(0.0, (v, w), pose)
        if result.correction is None and (v, w) != (0.0, 0.0):
            assert result.v == pytest.approx(v, rel=0.01)
            assert result.w == pytest.approx(w, abs=0.151 * abs(v) + 0.01 * abs(w))

    @given(places(), st.lists(st.tuples(speeds, turns), min_size=1, max_size=5))
    @settings(max_examples=30, deadline=None)
    def test_a_centred_stick_stands_in_that_cycle(self, place, wishes):
        grid, pose = place
        assist = knows(grid)
        for k, wish in enumerate(wishes):
            assist.step(0.05 * k, wish, pose)
        result = assist.step(0.3, (0.0, 0.0), pose)
        assert (result.v, result.w, result.correction) == (0.0, 0.0, None)

    @given(st.floats(-0.4, 0.4), turns, st.floats(-math.pi, math.pi))
    def test_with_room_all_round_it_is_the_wish(self, v, w, yaw):
        grid = world(4.6, 4.6)  # 1.5 m from every point of the outline to the walls, and some more ahead
        result = knows(grid).step(0.0, (v, w), (2.3, 2.3, yaw))
        if (v, w) != (0.0, 0.0):
            assert result == (v, w, None)

    @given(places(), st.lists(st.tuples(speeds, turns), min_size=1, max_size=12))
    @settings(max_examples=60, deadline=None)
    def test_so_it_is_whatever_was_wished_for_before(self, place, wishes):
        grid, pose = place
        assist = knows(grid)
        for k, (v, w) in enumerate(wishes):
            result = assist.step(0.05 * k, (v, w), pose)
            assert abs(result.v) <= abs(v) + 1e-12 and result.v * v >= 0.0
            assert abs(result.w) <= max(CONFIG.max_angular, abs(w)) + 1e-12


class TestSwitches:
    """A rider with a switch for each direction: who turns on the way veers, where room is short."""

    VEERS = AssistConfig.of(steady_time=0.0, veer_time=3.0)
    BETWEEN = 2.0, 0.65, 0.0  # walls 0.35 m on either side
    AHEAD, LEFT = (0.28, 0.0), (0.0, 0.36)

    def driven(self, wishes, pose, grid=None):
        """[Assisted] of a robot that stands at a pose, a wish each 0.5 s."""
        assist, grid, results = SharedControl(self.VEERS), grid or world(9.0, 1.3), []
        for k, wish in enumerate(wishes):
            assist.on_grid(grid, 0.5 * k)
            results.append(assist.step(0.5 * k, wish, pose))
        return results

    def test_a_turn_on_the_way_is_a_bend_for_as_long_as_it_says(self):
        results = self.driven([self.AHEAD] + 7 * [self.LEFT], self.BETWEEN)
        assert all(0.0 < result.v <= 0.28 for result in results[:7]) and results[7].v == 0.0
        assert results[1].correction is not None and results[0] == (*self.AHEAD, None)

    def test_so_it_is_astern(self):
        results = self.driven([(-0.28, 0.0), self.LEFT], self.BETWEEN)
        assert -0.28 <= results[1].v < 0.0

    def test_who_stands_or_has_let_go_turns_in_place(self):
        for before in ([], [self.AHEAD, (0.0, 0.0)]):
            assert self.driven([*before, self.LEFT], self.BETWEEN)[-1].v == 0.0

    def test_where_there_is_room_it_turns_in_place(self):
        assert self.driven([self.AHEAD, self.LEFT], (4.0, 4.0, 0.0), world(8.0, 8.0))[-1] == (*self.LEFT, None)

    def test_a_clock_set_back_forgets_the_way(self):
        assist, grid = SharedControl(self.VEERS), world(9.0, 1.3)
        for t, wish in ((100.0, self.AHEAD), (1.0, self.LEFT)):
            assist.on_grid(grid, t)
            result = assist.step(t, wish, self.BETWEEN)
        assert result.v == 0.0

    @given(places(), st.lists(st.tuples(st.sampled_from((-0.3, 0.0, 0.3)), turns), min_size=1, max_size=8))
    @settings(max_examples=60, deadline=None)
    def test_it_is_never_faster_than_it_was_asked_to_drive(self, place, wishes):
        grid, pose = place
        assist, drove = knows(grid, self.VEERS), 0.0
        for k, (v, w) in enumerate(wishes):
            drove = v or (drove if w else 0.0)
            result = assist.step(0.1 * k, (v, w), pose)
            assert abs(result.v) <= abs(drove) + 1e-12 and result.v * drove >= 0.0
            assert abs(result.w) <= max(CONFIG.max_angular, abs(w)) + 1e-12
            assert v or result.w * w >= -1e-9 or result.correction in (Correction.LEFT, Correction.RIGHT)


class TestDocks:
    """What stands free and is broad is driven up to."""

    START = 2.0, 3.0, 0.0
    BED = 3.7, 2.55, 5.7, 3.45

    @staticmethod
    def ahead(until=4.0):
        return lambda _t, pose: (0.3, 0.0) if pose[0] < until else None

    def test_a_bed_is_driven_up_to(self):
        rows = drive(world(8.0, 6.0, self.BED), self.START, self.ahead(), 12.0)
        assert rows[-1][1].correction is Correction.STOPS and 0.0 < rows[-1][3] < 0.15
        assert all(abs(pose[1] - 3.0) < 1e-9 for pose, *_ in rows)

    def test_so_it_is_astern(self):
        rows = drive(world(8.0, 6.0, self.BED), (2.0, 3.0, math.pi), lambda _t, pose: (-0.3, 0.0), 12.0)
        assert rows[-1][1].v == 0.0 and 0.0 < rows[-1][3] < 0.15 and abs(rows[-1][0][1] - 3.0) < 0.01

    @pytest.mark.parametrize(
        ('boxes', 'yaw'),
        [
            ([(3.7, 2.8, 4.1, 3.2)], 0.0),  # narrower than the body
            ([(3.7, 2.1, 5.7, 3.0)], 0.0),  # not squarely ahead
            ([BED], 0.3),
        ],
    )
    def test_the_rest_is_gone_round(self, boxes, yaw):
        rows = drive(world(8.0, 6.0, *boxes), (*self.START[:2], yaw), self.ahead(4.5), 30.0)
        assert rows[-1][0][0] > 4.4

    @pytest.mark.parametrize(
        ('boxes', 'yes'),
        [
            ([BED], True),
            ([(3.7, 2.2, 5.7, 3.8)], True),
            ([(3.7, 2.2, 5.7, 3.4)], True),
            ([(3.7, 2.8, 5.7, 3.8)], False),
            ([(3.7, 0.0, 3.9, 3.4), (3.7, 4.3, 3.9, 6.0)], False),  # a wall with a door
            ([(3.7, 0.0, 3.9, 6.0)], False),
            ([], False),
        ],
    )
    def test_what_it_is(self, boxes, yes):
        size, field = (CONFIG.length, CONFIG.width), field_of(world(8.0, 6.0, *boxes), 1.5)
        for x in (2.0, 2.5, 3.1):
            assert docking.faces(field, size, (x, 3.0, 0.0), 1.0, 2.0) is yes
            assert docking.faces(field, size, (x, 3.0, math.pi), -1.0, 2.0) is yes
            assert not docking.faces(field, size, (x, 3.0, math.pi), 1.0, 1.0)

    def test_who_bends_goes_by(self):
        rows = drive(
            world(8.0, 6.0, self.BED), self.START, lambda _t, pose: (0.3, 0.15) if pose[0] < 4.5 else None, 30.0
        )
        assert rows[-1][0][0] > 4.4 and rows[-1][0][1] > 3.45

    @pytest.mark.parametrize(
        ('seen', 'again'),
        [
            ([(1.0, 2.9), (5.0, 2.5)], True),
            ([(1.0, 2.9)], False),
            ([(1.0, 1.0), (5.0, 2.5)], False),  # it was away
            ([(1.0, 2.5), (70.0, 2.5)], False),  # long ago
            ([(1.0, 2.5), (-1.0, 2.5)], False),  # the clock was set back
        ],
    )
    def test_who_comes_again(self, seen, again):
        docked = docking.Docked()
        docked.see(0.0, (2.5, 3.0, 0.0))
        docked.brings_up(0.5, (3.0, 3.0, 0.0))
        for t, x in seen:
            docked.see(t, (x, 3.0, 0.0))
        assert docked.again is again

    def test_who_backs_off_and_comes_again_goes_by(self):
        def rider(t, pose):
            return None if pose[0] > 4.5 else (-0.2, 0.0) if 8.0 < t < 11.0 else (0.3, 0.0)

        rows = drive(world(8.0, 6.0, self.BED), self.START, rider, 50.0)
        assert rows[-1][0][0] > 4.4 and min(row[3] for row in rows) > 0.0


class TestTrembles:
    """A hand that trembles by more than it asks for."""

    NEAR = 0.33 + 0.5 * CONFIG.length, 2.0, math.pi  # 0.28 m before a wall
    OPEN = 3.0, 3.0, math.pi  # in the middle of a room

    @staticmethod
    def hand(v, w, seconds=4.0):
        """[(s, (v, w))] of a stick that asks for v and w and trembles at 4 and 5 Hz."""
        return [
            (t, (v + 0.3 * math.sin(25.1 * t), w + 0.5 * math.sin(31.4 * t + 1.0)))
            for t in np.arange(0.0, seconds, 0.05).tolist()
        ]

    @staticmethod
    def driven(wishes, pose):
        """[Assisted] of a robot that stands at a pose in a room."""
        assist, room, results = knows(world(6.0, 6.0)), world(6.0, 6.0), []
        for t, wish in wishes:
            assist.on_grid(room, t)
            results.append(assist.step(t, wish, pose))
        return results

    def test_where_room_is_short_it_moves_nothing_to_and_fro(self):
        results = self.driven(self.hand(0.1, 0.0), self.NEAR)
        assert all(result.v >= 0.0 for result in results[10:])
        assert any(result.correction is Correction.CALMER for result in results)

    def test_a_turn_that_is_not_free_stands_still(self):
        results = self.driven(self.hand(0.0, 0.25), (3.0, 0.34, 0.0))  # its side at a wall
        assert all((result.v, result.w) == (0.0, 0.0) for result in results[10:])

    def test_in_the_open_it_is_the_wish(self):
        wishes = self.hand(0.1, 0.1)
        assert self.driven(wishes, self.OPEN) == [(*wish, None) for _, wish in wishes]

    def test_who_turns_round_is_soon_obeyed(self):
        wishes = [(0.05 * k, (0.3 if k < 20 else -0.3, 0.0)) for k in range(30)]
        backs = [result.v for result in self.driven(wishes, self.NEAR)[20:]]
        assert backs[0] == 0.0 and backs[-1] == -0.3 and sorted(backs, reverse=True) == backs


class TestBeside:
    @pytest.mark.parametrize(
        ('gaps', 'beside', 'off'),
        [
            ((0.5, 0.2), (0.0, 0.3), 0.1),  # a wall on the right
            ((0.5, 0.2), (0.3, 0.0), 0.0),  # which is on the other side
            ((0.1, 0.1), (0.0, 0.3), 0.0),  # in the middle of a door
            ((0.16, 0.04), (0.0, 0.3), 0.06),  # beside its middle
            ((0.2, 0.5), (0.3, 0.0), 0.1),
            ((0.2, 0.5), (0.0, 0.0), 0.0),
        ],
    )
    def test_how_much_nearer_it_is_than_it_is_to_be(self, gaps, beside, off):
        assert too_near(gaps, beside) == pytest.approx(off)

    @given(places())
    @settings(max_examples=50, deadline=None)
    def test_the_two_sides_gaps_are_those_of_their_points(self, place):
        grid, pose = place
        field = field_of(grid, 1.5)
        c, s = math.cos(pose[2]), math.sin(pose[2])
        for half, found in zip((FINE.points[: FINE.half], FINE.points[FINE.half :]), gaps_beside(field, FINE, *pose)):
            at = pose[:2] + half @ np.array([[c, s], [-s, c]])
            least = min(distance_at(field, x, y) for x, y in at.tolist())
            if least > 0.0:
                assert found == pytest.approx(min(least, 1.5 - FINE.radius), abs=CELL)

    def test_the_left_half_is_on_the_left(self):
        assert (FINE.points[: FINE.half, 1] >= 0.0).all() and (FINE.points[FINE.half :, 1] <= 0.0).all()


class TestWhatItKnows:
    @pytest.mark.parametrize('pose', [None, (NAN, 0.0, 0.0), (0.0, math.inf, 0.0)])
    def test_without_a_pose_it_leaves_the_rider_to_the_gate(self, pose):
        assert knows(DOOR).step(0.0, (0.3, 0.1), pose) == (0.3, 0.1, Correction.UNKNOWN)

    @pytest.mark.parametrize('t', [-0.2, 1.01, NAN])
    def test_an_old_grid_is_not_used(self, t):
        assert knows(DOOR).step(t, (0.3, 0.1), (3.0, 3.0, 1.0)).correction is Correction.UNKNOWN

    def test_before_the_first_grid(self):
        assert SharedControl(CONFIG).step(0.0, (0.3, 0.1), (3.0, 3.0, 1.0)) == (0.3, 0.1, Correction.UNKNOWN)

    @pytest.mark.parametrize('wish', [(NAN, 0.1), (0.3, math.inf)])
    def test_a_wish_that_is_no_number_stands(self, wish):
        assert knows(DOOR).step(0.0, wish, (3.0, 3.0, 1.0)) == (0.0, 0.0, None)

    @pytest.mark.parametrize(
        'change', [{'resolution': 0.0}, {'resolution': NAN}, {'origin_x': NAN}, {'blocked': [True]}]
    )
    def test_a_grid_that_makes_no_sense_is_refused_and_the_last_one_kept(self, change):
        assist = knows(DOOR)
        before = assist.step(0.0, (0.34, 0.0), (2.5, 3.4, 0.0))
        with pytest.raises(GridError):
            assist.on_grid(DOOR._replace(**change), 0.0)
        assist.step(0.05, (0.0, 0.0), None)
        assert assist.step(0.1, (0.34, 0.0), (2.5, 3.4, 0.0)) == before

    def test_off_the_grid_nothing_is_in_the_way(self):
        assert knows(DOOR).step(0.0, (0.3, 0.1), (50.0, 3.0, 0.0)) == (0.3, 0.1, None)


class TestHelp:
    @pytest.mark.parametrize('degrees', [-45, -30, -15, 0, 15, 30, 45])
    def test_it_leads_through_a_door(self, degrees):
        a = math.radians(degrees)
        start = (4.05 - 2.0 * math.cos(a), 3.0 - 2.0 * math.sin(a), a)
        rows = drive(DOOR, start, heads_for(5.5, 3.0, lambda pose: pose[0] > 5.0))
        assert rows[-1][0][0] > 4.99 and min(row[3] for row in rows) > 0.0

    @pytest.mark.parametrize('y', (0.65, 1.0, 1.4))  # 0.3 to 1.1 m off the wall
    @pytest.mark.parametrize('turn', (-0.1, -0.2, -0.3))
    def test_along_a_wall_that_the_rider_steers_into(self, y, turn):
        rows = drive(world(14.0, 4.0), (1.0, y, 0.0), lambda t, pose: (0.34, turn) if pose[0] < 10.0 else None, 50.0)
        assert rows[-1][0][0] > 9.9 and min(row[3] for row in rows) > 0.1
        assert all(0.25 < row[3] < 0.35 for row in rows if row[0][0] > 7.0)

    @pytest.mark.parametrize(('yaw', 'wish', 'kept'), [(0.0, (0.34, -0.1), True), (math.pi, (-0.34, -0.1), False)])
    def test_walls_are_kept_off_ahead_and_not_astern(self, yaw, wish, kept):
        hall, start = world(14.0, 4.0), (3.0, 0.9, yaw)
        with_it, without = (
            drive(hall, start, lambda t, pose: wish, 15.0, AssistConfig.of(beside=beside)) for beside in (0.3, 0.0)
        )
        assert (with_it != without) is kept
        assert not kept or with_it[-1][3] > without[-1][3] + 0.02

    def test_who_steers_away_from_the_wall_is_let_go(self):
        grid = world(14.0, 4.0)
        assist, pose = knows(grid), (5.0, 0.6, 0.0)
        wishes = 5 * [(0.34, -0.2)] + 5 * [(0.34, -0.05)] + 10 * [(0.34, 0.2)] + 10 * [(0.34, 0.05)]
        results = []
        for k, wish in enumerate(wishes):
            assist.on_grid(grid, 0.05 * k)
            results.append(assist.step(0.05 * k, wish, pose))
        assert {result.correction for result in results[:10]} == {Correction.LEFT}
        assert results[16:20] == 4 * [(0.34, 0.2, None)]
        assert results[-5:] == 5 * [(0.34, 0.05, None)]

    def test_round_a_box_in_the_way(self):
        grid = world(8.0, 6.0, (4.0, 2.6, 4.5, 3.1))
        rows = drive(grid, (1.5, 2.9, 0.0), heads_for(7.0, 2.9, lambda pose: pose[0] > 6.0))
        assert rows[-1][0][0] > 5.9 and min(row[3] for row in rows) > 0.02

    def test_it_stops_before_a_wall(self):
        rows = drive(world(6.0, 4.0), (3.0, 2.0, 0.0), lambda t, pose: (0.34, 0.0), 20.0)
        assert rows[-1][1].v == 0.0 and 0.0 < rows[-1][3] < 0.2

    @pytest.mark.parametrize('push', (0.05, 0.1, 0.2, 0.4))
    def test_a_turn_in_place_is_no_faster_than_the_push(self, push):
        grid = world(6.0, 6.0, (4.3, 0.6, 5.7, 2.0))
        result = knows(grid).step(0.0, (push, 0.0), (3.5, 2.3, -0.4))
        corner = math.hypot(0.5 * CONFIG.length, 0.5 * CONFIG.width) / CONFIG.turn_slip
        assert result.v == 0.0 and result.correction is Correction.LEFT
        assert 0.0 < result.w <= push / corner + 1e-9 and result.w < CONFIG.max_angular

    def test_astern_as_ahead(self):
        grid = world(8.0, 6.0, (4.0, 2.6, 4.5, 3.1))
        rider = heads_for(7.0, 2.9, lambda pose: pose[0] > 6.0)

        def astern(t, pose):
            wish = rider(t, (pose[0], pose[1], pose[2] + math.pi))
            return None if wish is None else (-wish[0], wish[1])

        rows = drive(grid, (1.5, 2.9, math.pi), astern)
        assert rows[-1][0][0] > 5.9 and min(row[3] for row in rows) > 0.02

    def test_a_turn_beside_a_wall_is_made_as_far_as_there_is_room(self):
        rows = drive(world(6.0, 4.0), (3.0, 0.45, 0.0), lambda t, pose: (0.0, 0.5), 6.0)
        assert min(row[3] for row in rows) > 0.0
        assert rows[-1][1].correction in (Correction.STOPS, Correction.SLOWER)

    def test_who_pushes_towards_a_wall_right_after_a_turn_in_place_is_stopped_too(self):
        law, room = knows(world(6.0, 4.0)), CONFIG.length / 2.0 + CONFIG.margin
        for k in range(40):
            assert law.step(0.01 * k, (0.0, 0.5), (3.0, 2.0, 0.0)).w > 0.0
        assert law.step(0.4, (0.3, 0.01), (5.9 - room, 2.0, 0.0)).v < 0.1

    def test_more_help_keeps_further_from_a_wall(self):
        far = []
        for share in (0.0, 1.0):
            config = AssistConfig.of(help=share)
            rows = drive(world(8.0, 4.0), (1.0, 1.2, 0.0), lambda t, pose: (0.34, -0.15), 15.0, config)
            far.append(rows[-1][3])
        assert 0.0 < far[0] < 0.15 and far[1] > far[0] + 0.1


class TestTheRiderWins:
    def corrected(self, config=CONFIG):
        return knows(DOOR, config), (3.2, 3.3, 0.0)  # the left jamb is straight ahead

    def test_who_holds_the_stick_fully_against_a_correction_is_left_alone(self):
        grid, pose, wish = world(8.0, 4.0), (3.0, 0.8, -0.1), (0.4, -0.55)  # to the right is a wall
        assist = knows(grid)
        results = []
        for k in range(30):
            assist.on_grid(grid, 0.05 * k)
            results.append(assist.step(0.05 * k, wish, pose))
        assert {result.correction for result in results[:20]} == {Correction.LEFT}
        assert all(result == (*wish, Correction.INSISTED) for result in results[22:])
        assist.step(1.6, (0.0, 0.0), pose)
        assert assist.step(1.65, wish, pose).correction is Correction.LEFT

    def test_who_holds_it_fully_against_a_wall_is_left_alone(self):
        assist = knows(DOOR)
        results = [assist.step(0.05 * k, (0.4, 0.0), AT_THE_WALL).correction for k in range(22)]
        assert results[:20] == 20 * [Correction.STOPS] and results[-1] is Correction.INSISTED

    @pytest.mark.parametrize('wish', [(0.4, 0.0), (0.4, -0.2), (0.2, 0.3)])  # ahead; to its side; not fully
    def test_who_does_not_is_helped_on(self, wish):
        assist, pose = self.corrected()
        for k in range(100):
            assist.on_grid(DOOR, 0.05 * k)
            assert assist.step(0.05 * k, wish, pose).correction is not Correction.INSISTED

    def test_override_lasts_as_long_as_it_says(self):
        assist, pose = self.corrected()
        assert assist.override_left(0.0) == 0.0
        assist.override(0.0)
        for t, alone in ((0.1, True), (19.9, True), (20.0, False), (20.1, False)):
            assert assist.override_left(t) == pytest.approx(max(20.0 - t, 0.0))
            assist.on_grid(DOOR, t)
            assist.step(t, (0.0, 0.0), pose)
            assert (assist.step(t, (0.3, 0.0), pose).correction is Correction.OVERRIDE) is alone

    def test_override_is_taken_back(self):
        assist, pose = self.corrected()
        assist.override(0.0)
        assist.override(0.05, on=False)
        assert assist.override_left(0.1) == 0.0
        assert assist.step(0.1, (0.3, 0.0), pose).correction is not Correction.OVERRIDE

    def test_a_clock_set_back_ends_an_override(self):
        assist, pose = self.corrected()
        assist.override(1000.0)
        assert assist.override_left(0.0) == 0.0
        assert assist.step(0.0, (0.3, 0.0), pose).correction is not Correction.OVERRIDE

    def test_an_override_is_named_before_what_the_rider_insists_on(self):
        assist, wish, pose = knows(DOOR), (0.4, 0.0), AT_THE_WALL
        for k in range(30):
            assist.on_grid(DOOR, 0.05 * k)
            assist.step(0.05 * k, wish, pose)
        assist.override(1.5)
        assert assist.step(1.5, wish, pose) == (*wish, Correction.OVERRIDE)
        assert assist.step(21.6, wish, pose) == (*wish, Correction.INSISTED)

    def test_each_correction_has_a_sentence_of_its_own(self):
        said = [sentence(one) for one in (None, *Correction)]
        assert len(set(said)) == 1 + len(Correction)
        assert all(text.startswith('The chair ') and text.endswith('.') for text in said)


class TestProfiles:
    """Another rider's config while it runs."""

    POSE, WISH = (2.9, 2.8, 0.0), (0.3, 0.0)  # before a jamb of the door

    @settings(max_examples=50, deadline=None)
    @given(st.floats(0.7, 3.4), st.floats(0.7, 5.3), st.floats(-3.1, 3.1), speeds, turns)
    def test_who_goes_with_the_gate_alone_drives_as_wished(self, x, y, yaw, v, w):
        result = knows(DOOR, AssistConfig.of(enabled=False)).step(0.0, (v, w), (x, y, yaw))
        assert result == (v, w, None if v == w == 0.0 else Correction.OFF)

    def test_it_counts_from_the_next_command_on_and_leaves_no_trace(self):
        assist, fresh = knows(DOOR), knows(DOOR, AssistConfig.of(help=0.1, clear=0.8))
        helped = assist.step(0.0, self.WISH, self.POSE)
        assert helped.correction is not None
        assist.use(AssistConfig.of(enabled=False))
        assert assist.step(0.05, self.WISH, self.POSE) == (*self.WISH, Correction.OFF)
        assist.use(AssistConfig.of(help=0.1, clear=0.8))  # the grid is known as far as this one needs it
        assert assist.step(0.1, self.WISH, self.POSE) == fresh.step(0.1, self.WISH, self.POSE) != helped
        assist.use(CONFIG)
        assert assist.step(0.15, self.WISH, self.POSE) == helped

    @pytest.mark.parametrize('y', (3.3, 3.4, 3.7))
    def test_little_help_begins_nearer_than_much_and_keeps_clear_too(self, y):
        begins = {}
        configs, hall = (
            HelpProfiles.from_params(parameters('sara_control', 'assist.yaml', load('sara'))).configs,
            world(10.0, 7.0, PILLAR),
        )
        for name in ('much', 'little'):
            rows = drive(hall, (1.5, y, 0.0), heads_for(9.0, y, lambda pose: pose[0] > 8.5), 40.0, configs[name])
            begins[name] = next(pose[0] for pose, result, *_ in rows if result.correction is not None)
            assert min(row[3] for row in rows) > 0.1 and rows[-1][0][0] > 8.5
        assert begins['little'] > begins['much'] + 0.2

    def test_an_old_grid_stays_old_and_an_override_lasts(self):
        assist = SharedControl(CONFIG)
        assist.use(AssistConfig.of(help=0.1))
        assert assist.step(0.0, self.WISH, self.POSE).correction is Correction.UNKNOWN
        assist.on_grid(DOOR, 0.0)
        assist.override(0.0)
        assist.use(CONFIG)
        assert assist.override_left(5.0) == 15.0
        assert assist.step(19.0, self.WISH, self.POSE).correction is Correction.OVERRIDE
        assert assist.step(21.0, self.WISH, self.POSE).correction is Correction.UNKNOWN

    def test_who_insisted_is_helped_again_by_another_profile(self):
        assist, wish, pose = knows(DOOR), (CONFIG.max_linear, 0.0), AT_THE_WALL
        for k in range(30):
            assist.on_grid(DOOR, 0.05 * k)
            found = assist.step(0.05 * k, wish, pose).correction
        assert found is Correction.INSISTED
        assist.use(CONFIG)
        assert assist.step(1.5, wish, pose).correction is Correction.STOPS


class TestConfig:
    @pytest.mark.parametrize(
        'values',
        [
            {'margin': -0.1},
            {'help': 1.1},
            {'horizon': NAN},
            {'sources': 'joystick'},
            {'enabled': 1},
            {'sources': [1]},
            {'nearest_look': 2.5},
            {'margin': 0.2, 'clear': 0.2},
            {'margin': 0.1, 'clear': 0.05},
            {'braking': 0.0},
            {'margins': 0.1},
        ],
    )
    def test_faults_are_named(self, values):
        with pytest.raises(ConfigError, match=next(iter(values))):
            AssistConfig.from_params({**BODY, **values})

    def test_all_faults_at_once(self):
        with pytest.raises(ConfigError) as error:
            AssistConfig.from_params({**BODY, 'help': 2, 'margin': -1, 'nothing': 0})
        assert len(error.value.faults) == 3

    def test_no_mapping(self):
        with pytest.raises(ConfigError, match='mapping'):
            AssistConfig.from_params([])
