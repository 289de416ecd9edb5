"""The probability that the pose by ranges is wrong: what raises it and what does not, and the search that it begins."""

import math
import sys
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parent))
from range_world import CELL, CONE, CONFIG, CUPBOARD, drive, room, way  # noqa: E402

from ahead_of_time import compilations  # noqa: E402
from sara_common.planar import compose, wrap  # noqa: E402
from sara_localization.particles import echo_table  # noqa: E402
from sara_localization.particles.global_search import Places  # noqa: E402
from sara_localization.particles.range_localizer import RangeLocalizer  # noqa: E402
from sara_localization.particles.range_lost import LAW  # noqa: E402
from sara_localization.ranges import map_echo  # noqa: E402
from sara_localization.ranges.range_data import RangeData, RangeMap  # noqa: E402

POSES = way(2)
AWAY = compose(POSES[0], (1.0, 0.5, math.radians(8.0)))  # where it is told that it starts
BOX = 2.6, 0.1, 3.0, 0.4  # beside the way, not on the map
LIMIT = CONFIG.lost_limit
SILENT = replace(CONFIG, lost_recovery=False)


class Probabilities(RangeLocalizer):
    """Notes the probability after each reading."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.said = []

    def on_range(self, reading):
        what = super().on_range(reading)
        self.said.append(self.lost_probability)
        return what


@pytest.mark.parametrize('things', [[CUPBOARD], [CUPBOARD, BOX]])
def test_a_right_pose_is_not_doubted_beside_what_the_map_lacks(things):
    localizer = Probabilities(CONFIG, room([CUPBOARD]))
    said = drive(localizer, things, POSES, reckoned=POSES[0])
    assert max(localizer.said) < 0.5 and localizer.said[-1] < 0.01 and 'found' not in said
    assert localizer.told == ''


def test_a_wrong_pose_is_noticed_within_a_few_steps():
    localizer = Probabilities(SILENT, room([CUPBOARD]))
    drive(localizer, [CUPBOARD], POSES[:25], reckoned=AWAY)
    assert localizer.said[0] == LAW.prior and localizer.lost_probability > LIMIT
    assert localizer.told.startswith('lost: the pose is wrong with a probability of 0.')
    assert 'drive it about' not in localizer.told  # nothing is searched for


def test_the_place_is_found_again_meanwhile_the_pose_is_given_out():
    ends = []
    for _ in range(2):
        localizer = Probabilities(CONFIG, room([CUPBOARD]))
        said = drive(localizer, [CUPBOARD], POSES, reckoned=AWAY)
        lost = next(i for i, probability in enumerate(localizer.said) if probability > LIMIT)
        assert said.index('found') > lost and not localizer.searching and localizer.correction.counts['found'] == 1
        x, y, yaw = localizer.correction.pose
        assert math.dist((x, y), POSES[-1][:2]) < 0.1 and abs(wrap(yaw - POSES[-1][2])) < math.radians(3.0)
        assert localizer.said[-1] < 0.1 and localizer.told == ''
        ends.append((said, localizer.correction.pose))
    assert ends[0] == ends[1]


def test_nothing_compiles_while_the_pose_is_judged_and_searched_for():
    localizer = RangeLocalizer(CONFIG, room([CUPBOARD]))
    kernels = (map_echo.echo, echo_table._fill, echo_table.add_logarithms)
    before = [compilations(kernel) for kernel in kernels]
    assert 'found' in drive(localizer, [CUPBOARD], POSES, reckoned=AWAY)
    echo, *others = (compilations(kernel) - was for kernel, was in zip(kernels, before))
    assert echo == 0 and max(others) <= 1


def test_without_recovery_it_stays_lost():
    localizer = Probabilities(SILENT, room([CUPBOARD]))
    assert 'found' not in drive(localizer, [CUPBOARD], POSES, reckoned=AWAY)
    assert localizer.search is None


def test_nothing_waits_for_places_that_are_still_worked_out():
    works, coming = [], Future()
    localizer = Probabilities(CONFIG, room([CUPBOARD]), submit=lambda work: works.append(work) or coming)
    drive(localizer, [CUPBOARD], POSES[:40], reckoned=AWAY)
    assert len(works) == 1 and localizer.search is None
    assert localizer.told.endswith('drive it about, or tell it where it is')
    pauses = []
    coming.set_result(works[0](lambda: pauses.append(0)))
    assert len(pauses) > 10
    assert isinstance(coming.result(), Places)
    assert 'found' in drive(localizer, [CUPBOARD], POSES, reckoned=AWAY)


def test_a_pose_that_is_told_ends_it():
    localizer = Probabilities(CONFIG, room([CUPBOARD]))
    drive(localizer, [CUPBOARD], POSES[:25], reckoned=AWAY)
    assert localizer.lost_probability > LIMIT
    localizer.forget()
    assert localizer.lost_probability == LAW.prior and localizer.search is None and localizer.told == ''
    localizer.start_anywhere()
    assert localizer.lost_probability == 1.0
    localizer.forget()
    localizer.set_map(room())
    assert localizer.lost_probability == LAW.prior


@pytest.mark.parametrize('way', [0.3, 20.0])
def test_dead_reckoning_that_jumps_ends_it(way):
    localizer = Probabilities(CONFIG, room([CUPBOARD]))
    drive(localizer, [CUPBOARD], POSES[:25], reckoned=AWAY)
    assert localizer.search is not None
    stamp, here = localizer.correction._trail.newest
    localizer.on_pose(stamp + 0.1, compose(here, (way, 0.0, 0.0)))
    assert localizer.lost_probability == LAW.prior and localizer.search is None and not localizer.searching


def test_a_map_without_room_is_searched_in_vain():
    narrow = np.full((80, 14), 100, np.int8)
    narrow[2:-2, 3:-3] = 0
    localizer = Probabilities(CONFIG, RangeMap.from_occupancy(narrow, CELL, (0.0, 0.0, 0.0), 65))
    for k in range(60):
        localizer.on_pose(10.0 + 0.1 * k, (0.35, 0.5 + 0.05 * k, math.pi / 2))
        for name, yaw, distance in (('left', math.pi / 2, 1.5), ('right', -math.pi / 2, math.inf)):
            localizer.on_range(RangeData(name, 10.0 + 0.1 * k, (0.0, 0.0, yaw), distance, 0.16, 2.5, CONE))
    assert localizer.lost_probability > LIMIT and localizer.search is None
    assert 'cannot be searched for: the map has no free place' in localizer.told


def test_a_robot_that_stands_and_faulty_readings_change_nothing():
    localizer = Probabilities(CONFIG, room([CUPBOARD]))
    good = RangeData('a', 10.0, (0.3, 0.3, math.pi / 2), 2.0, 0.16, 2.5, CONE)
    for k in range(50):
        localizer.on_pose(10.0 + 0.1 * k, POSES[0])
        localizer.on_range(good._replace(stamp=10.0 + 0.1 * k))
    for k in range(50):
        stamp = 20.0 + 0.1 * k
        localizer.on_pose(stamp, compose(POSES[0], (0.05 * k, 0.0, 0.0)))
        for change in ({'range': math.nan}, {'range': -math.inf}, {'range': 0.0}, {'mount': (math.nan, 0.0, 0.0)}):
            localizer.on_range(good._replace(stamp=stamp, **change))
    assert set(localizer.said) == {LAW.prior}
