"""Journeys with the laser scanner: one in the flat, on which it fails; and what the campaign's part asks for."""

from pathlib import Path

import pytest

from sara_lab.campaign.scanned import scan
from sara_lab.journeys import travel


@pytest.mark.parametrize('fault', ['scan_silent', 'scan_frozen'])
def test_a_journey_in_the_flat_ends_well_whatever_becomes_of_the_scanner(fault):
    seen = []

    def watch(lockstep):
        live = lockstep.wheels.guard.zones.scan.live
        seen.append(live)
        if live and seen.count(True) == 300:
            lockstep.chair.faults.add(fault)

    outcome = travel.drive('flat', 'true', 0, watch=watch, scan=True)
    assert outcome.reached and not outcome.contacts and not outcome.faults
    assert not seen[-1] and seen.count(True) >= 300


def row(reached, **more):
    return {'reached': reached, 'cases': 150, **more}


def test_the_part_asks_for_goals_and_for_time():
    part = scan(1, Path('nowhere'))
    assert len(part.cases) == 300
    good = {'true_all': row(149, time_ratio=1.2), 'pedestrians_all': row(147)}
    assert part.verdict(good) == []
    for change, word in (
        ({'true_all': row(148, time_ratio=1.2)}, 'true: 148'),
        ({'true_all': row(150, time_ratio=1.3)}, '1.30'),
        ({'pedestrians_all': row(146)}, 'pedestrians: 146'),
    ):
        (sentence,) = part.verdict({**good, **change})
        assert word in sentence
