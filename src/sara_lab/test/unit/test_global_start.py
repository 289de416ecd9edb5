"""Chairs that start anywhere: what a drive gives, and how the part judges what came of it."""

import math

import numpy as np
import pytest

from sara_lab.campaign.global_start import BESIDE, FURTHER, LATER, _summary, _verdict, judged, later, tracked
from sara_lab.studies.global_start import Start, Told, start, told
from sara_lab.studies.wandering import WAY, Recording, kept, record

KNOWN = Start(25.0, 3.0, 0.02, 0.01, (0.1, 0.05), (0.1, 0.05), '')
NOT_SURE = Start(25.0, None, math.nan, math.nan, None, None, 'not sure where the robot is: 2 places fit')


def test_a_start_is_judged():
    assert judged('flat', KNOWN)['known'] and not judged('flat', KNOWN)['faults']
    result = judged('hall', NOT_SURE)
    assert not result['known'] and not result['wrong'] and result['off'] is None
    for wrong in (
        KNOWN._replace(off=0.25),
        KNOWN._replace(turned=math.radians(6.0)),
        KNOWN._replace(at_most=(4.0, 0.05)),  # it was sure of another place on the way
        KNOWN._replace(at_most=(0.1, math.pi), told='not sure'),
    ):
        result = judged('flat', wrong)
        assert result['wrong'] and not result['known'] and 'sure after 3.0 m and wrong' in result['faults'][0]
    assert not judged('flat', KNOWN._replace(off=3.0, told='not sure'))['wrong']  # it says so


def test_the_part_asks_for_its_shares():
    good = [judged(name, NOT_SURE if name == 'hall' else KNOWN) for name in ('school', 'flat', 'hall')] * 67
    lines, figures = _summary(good)
    assert _verdict(figures) == [] and figures['all']['known'] == 134 and figures['hall']['not_sure'] == 67
    assert lines[-1].startswith('all     known 134, not sure 67, wrong 0 of 201; known after 3.0 m')
    one = good[1:] + [judged('flat', KNOWN._replace(off=2.0))]
    assert _verdict(_summary(one)[1]) == ['sure and wrong: 1 of 201, 0.1% is allowed']


def test_later_starts_count_for_the_share_of_wrong_ones():
    def drives(count, *wrong):
        each = [judged('flat', KNOWN)] * 4
        kept_ = [{'map': 'flat', 'starts': each, 'faults': []}] * count
        return kept_ + [{'map': 'flat', 'starts': [judged('flat', one)], 'faults': []} for one in wrong]

    first = [judged(name, KNOWN) for name in ('school', 'flat', 'hall')] * 67
    lines, figures = _summary(first + drives(201))
    assert lines[-1].startswith('later   known 804, not sure 0, wrong 0 of 804') and figures['all']['cases'] == 201
    wrong = KNOWN._replace(off=2.0)
    assert _verdict(_summary(first + drives(201, wrong))[1]) == []  # 1 of 1006
    assert _verdict(_summary(first + drives(201, wrong, wrong))[1]) == ['sure and wrong: 2 of 1007, 0.1% is allowed']


def test_a_start_anywhere_is_compared_with_one_that_is_told_on_the_same_drives():
    maps = ('school', 'flat', 'hall')
    firsts = [judged(name, NOT_SURE if name == 'hall' else KNOWN) for _ in range(10) for name in maps]
    tolds = [tracked(name, Told(0.015, 0.01, 0.3, 0.1)) for _ in range(10) for name in maps]
    firsts[0] = judged('school', NOT_SURE)
    tolds[0]['off'] = 5.0  # not the same drives: this one counts for neither
    lines, figures = _summary(firsts + tolds)
    assert figures['tracked_school'] == {'drives': 9, **dict(zip(BESIDE, ([0.02] * 2, [0.015] * 2, [0.3] * 2)))}
    assert figures['tracked_hall'] == {'drives': 10, **dict(zip(BESIDE[1:], ([0.015] * 2, [0.3] * 2)))}
    assert _verdict(figures) == [] and figures['all']['cases'] == 30
    assert lines[-1].startswith('hall    10 drives') and lines[-1].endswith('told 0.015, 0.015; reckoned 0.300, 0.300')
    worse = _summary(firsts + [dict(one, off=0.005) for one in tolds])[1]
    assert [sentence.split(':')[0] for sentence in _verdict(worse)] == ['school', 'flat']


def test_a_chair_that_is_driven_about_finds_its_place(tmp_path):
    made = record('flat', 1)
    assert isinstance(made, Recording) and 2.0 < made.way < WAY + 0.1 and len(made.sensors) == 9
    assert made.poses[0, 2:5].tolist() == [0.0, 0.0, 0.0] and (np.diff(made.poses[:, 0]) > 0.0).all()
    came = start(made, 'flat')
    assert judged('flat', came)['known'] and came.found < made.way
    np.savez(tmp_path / 'wander_flat_1.npz', **made._asdict())
    said = told(made, 'flat')
    end, begin = made.poses[-1], made.poses[0]
    assert said.off < 0.1 and said.turned < math.radians(3.0)
    driven = math.dist(end[2:4], (0.0, 0.0))
    assert driven == pytest.approx(math.dist(end[5:7], begin[5:7]), abs=said.reckoned_off + 1e-9)
    starts = later('flat', made)
    assert len(starts['starts']) == sum(since + FURTHER <= made.way for since in LATER) and starts['faults'] == []
    for since, one in zip(LATER, starts['starts']):
        left = made.way - since
        assert one['way'] <= left + 0.1
        assert not one['known'] or min(one['found'] + FURTHER, left) <= one['way'] + 0.1
    assert sum(one['known'] for one in starts['starts']) >= 3  # a few metres do not tell every place from its like
    again = kept('flat', 1, tmp_path)
    assert again.sensors == made.sensors and np.array_equal(again.ranges, made.ranges)
