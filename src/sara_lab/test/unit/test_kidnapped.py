"""Robots that are carried away: what a drive gives, and how the part judges it."""

import json

import pytest

from sara_lab.campaign.kidnapped import _summary, _verdict, judged
from sara_lab.studies.carried import CARRIED, GROUPS, Case, Step, drive
from sara_lab.studies.consistency import QUANTILE, reliability

CASE = Case('flat', 3)


def step(way, after, off, probability):
    return Step(way, after, off, 0.0, probability, nees=QUANTILE * probability)


def result(noticed=2.0, found=8.0, people=False, heading='gyro'):
    steps = [step(1.0, None, 0.1, 0.05), step(2.0, None, 0.1, 0.6)]
    if noticed is not None:
        steps.append(step(3.0, noticed, 4.0, 0.95))
    steps.append(step(4.0, found or 10.0, 0.1 if found else 4.0, 0.05))
    return judged(Case('flat', 0, people, heading=heading), steps)


def test_a_drive_is_judged():
    found = result()
    assert (found['noticed'], found['found'], found['before'], found['alarms']) == (2.0, 8.0, 2, 1)
    assert found['moments'] == [[0.05, False], [0.6, False], [0.95, True], [0.05, False]]
    assert result(noticed=None)['noticed'] is None and result(found=None)['found'] is None


def test_found_has_the_hysteresis_of_move_base():
    known = [step(1.0, 1.0, 4.0, 0.9), step(2.0, 2.0, 0.1, 0.4), step(3.0, 3.0, 0.1, 0.1), step(4.0, 4.0, 0.1, 0.4)]
    found = lambda *more: judged(Case('flat', 0), [*known, *more])['found']
    assert found() == 3.0
    assert found(step(5.0, 5.0, 0.1, 0.6)) is None and found(step(5.0, 5.0, 4.0, 0.1)) is None
    assert found(step(5.0, 5.0, 4.0, 0.1), step(6.0, 6.0, 0.1, 0.1)) == 6.0


def test_the_part_asks_for_its_shares():
    good = [result(people=people) for people in (False, True) for _ in range(20)]
    good += [result(found=None, heading='wheels')]
    assert not [s for s in _verdict(_summary(good)[1]) if 'calibration' not in s]
    late = good[:18] + [result(noticed=5.5)] * 2 + good[20:]
    assert _verdict(_summary(late)[1])[:1] == ['gyro_alone_all: noticed 18 of 20, 95% are asked for']
    gone = good[:37] + [result(found=None, people=True)] * 3 + good[40:]
    assert not [s for s in _verdict(_summary(gone)[1]) if 'found' in s]
    gone = good[:36] + [result(found=None, people=True)] * 4 + good[40:]
    assert [s for s in _verdict(_summary(gone)[1]) if s.startswith('gyro_people_all: found 16 of 20, 85%')]


def test_without_a_gyro_only_noticing_is_asked_for():
    each = [result(people=people, heading=heading) for heading, people in GROUPS]
    late = each + [result(noticed=None, found=None, heading='wheels')] * 2
    (sentence,) = [s for s in _verdict(_summary(late)[1]) if 'calibration' not in s]
    assert sentence == 'wheels_alone_all: noticed 1 of 3, 95% are asked for'


def test_poses_that_are_more_wrong_than_they_claim_are_told():
    each = [result(people=people, heading=heading) for heading, people in GROUPS]
    assert not [s for s in _verdict(_summary(each)[1]) if 'claim' in s]
    each[0]['nees'] = [0.5 * QUANTILE] * 9 + [2.0 * QUANTILE]
    (sentence,) = [s for s in _verdict(_summary(each)[1]) if 'claim' in s]
    assert sentence == 'gyro_alone_all: 90.0% of the poses are as right as they claim, 95% are asked for'


def test_reliability_of_a_known_set():
    rows, error = reliability([(0.05, False)] * 90 + [(0.95, True)] * 5 + [(0.95, False)] * 5)
    assert rows == [(90, pytest.approx(0.05), 0.0), (10, pytest.approx(0.95), 0.5)]
    assert error == pytest.approx(0.9 * 0.05 + 0.1 * 0.45)


def test_a_robot_is_carried_away_notices_and_finds_its_place():
    steps = list(drive(CASE))
    before, after = ([s for s in steps if (s.after is None) == first] for first in (True, False))
    assert max(s.off for s in before) < 0.5 and not any(s.wrong for s in before)
    assert after[1].off > 0.5 * CARRIED[0] and max(s.probability for s in after) > 0.9
    assert not after[-1].wrong and after[-1].after > 29.0
    kept = judged(CASE, steps)
    assert json.loads(json.dumps(kept)) == kept and kept['noticed'] < 5.0 and kept['found'] < 25.0


def test_a_robot_that_is_not_carried_away_tracks_among_pedestrians():
    steps = list(drive(Case('school', 1, people=True, carried=False)))
    assert all(s.after is None for s in steps) and not any(s.wrong for s in steps)
