"""Worlds of pillars, and the false stops that are allowed in them."""

import math

import numpy as np

from sara_lab.campaign.travels import _pillars_summary, _pillars_verdict
from sara_lab.journeys import pillars
from sara_lab.journeys.travel import POSES
from sara_nav.maps import map_io


def test_a_world_has_gaps_that_the_body_passes_and_is_the_same_every_time():
    grid, poses = pillars.world(3)
    again, poses_again = pillars.world.__wrapped__(3)
    assert np.array_equal(grid.data, again.data) and poses == poses_again
    places = pillars._places(np.random.default_rng([3, 7]))
    apart = [math.dist(a, b) for i, a in enumerate(places) for b in places[:i]]
    assert len(places) == pillars.PILLARS and min(apart) >= pillars.GAP + pillars.DIAMETER
    inside = grid.data[pillars.WALL : -pillars.WALL, pillars.WALL : -pillars.WALL]
    area = pillars.PILLARS * math.pi * (0.5 * pillars.DIAMETER) ** 2
    assert abs(np.count_nonzero(inside != map_io.FREE) * pillars.CELL**2 / area - 1.0) < 0.05
    assert all(math.dist(a[:2], b[:2]) > pillars.FAR for a, b in zip(poses, poses[1:])) and len(poses) == 5


def test_more_false_stops_than_are_allowed_are_named():
    judgement = {'seconds': 300.0, 'length': 60.0, 'discomfort': 120.0, 'gap_min': 0.1, 'meetings': {'false_stops': 1}}
    results = [
        {'mode': mode, 'reached': 4, 'contacts': [], 'recoveries': 0, 'judgement': judgement}
        for mode in POSES
        for _ in range(2)
    ]
    _, figures = _pillars_summary(results)
    assert figures['true']['false_stops_in_10_min'] == 2.0 and figures['true']['speed'] == 0.2
    assert len(_pillars_verdict(figures)) == len(POSES)
    judgement['meetings']['false_stops'] = 0
    assert _pillars_verdict(_pillars_summary(results)[1]) == []
