"""Worlds of pillars, and the false stops that are counted in them."""

import math
from types import SimpleNamespace

import numpy as np

from sara_control.gate.reasons import State
from sara_lab.campaign.travels import _pillars_summary, _pillars_verdict
from sara_lab.journeys import pillars
from sara_lab.judge.false_stops import FalseStops
from sara_nav.maps import map_io
from sara_sim.world.obstacles import Obstacle, Obstacles


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


def watched(moments, obstacles=(), state=State.SLOWED):
    """False stops of [(s, whether the gate takes something for a pedestrian), ...] with a chair at the origin, while
    the gate is in that state.
    """
    stops, zones = FalseStops(), SimpleNamespace(pedestrian_moving=False)
    world = SimpleNamespace(obstacles=Obstacles(obstacles))
    lockstep = SimpleNamespace(
        wheels=SimpleNamespace(guard=SimpleNamespace(zones=zones), decision=SimpleNamespace(state=state)),
        chair=SimpleNamespace(world=world, pose=(0.0, 0.0, 0.0)),
    )
    for lockstep.time, zones.pedestrian_moving in moments:
        world.obstacles.move_to(lockstep.time)
        stops.after(lockstep)
    return stops.count


def test_what_follows_within_a_second_is_the_same_stop():
    assert watched([(1.0, True), (1.01, True), (1.5, False), (1.9, True), (2.0, False)]) == 1
    assert watched([(1.0, True), (1.5, False), (2.1, True)]) == 2
    assert watched([(1.0, False)]) == 0


def test_a_detection_that_does_not_slow_the_chair_is_no_stop():
    assert watched([(1.0, True)], state=State.DRIVING) == 0
    assert watched([(1.0, True)], state=State.HELD) == 1


def test_a_stop_for_somebody_who_walks_there_is_none():
    near = Obstacle('person 1', radius=0.25, path=((3.0, 0.0), (3.0, 1.0)), speed=1.0)
    far = Obstacle('person 1', radius=0.25, path=((5.0, 0.0), (5.0, 1.0)), speed=1.0)
    box = Obstacle('box 1', size=(0.4, 0.4), at=(1.0, 0.0))
    gone = Obstacle('person 1', radius=0.25, path=((3.0, 0.0), (3.0, 1.0)), speed=1.0, disappears=0.5)
    assert watched([(1.0, True)], [near]) == 0
    for other in (far, box, gone):
        assert watched([(1.0, True)], [other]) == 1


def test_more_false_stops_than_are_allowed_are_named():
    judgement = {'seconds': 300.0, 'length': 60.0, 'discomfort': 120.0, 'gap_min': 0.1, 'false_stops': 1}
    results = [
        {'mode': mode, 'reached': 4, 'contacts': [], 'recoveries': 0, 'judgement': judgement}
        for mode in pillars.MODES
        for _ in range(2)
    ]
    _, figures = _pillars_summary(results)
    assert figures['true']['false_stops_in_10_min'] == 2.0 and figures['true']['speed'] == 0.2
    assert len(_pillars_verdict(figures)) == len(pillars.MODES)
    judgement['false_stops'] = 0
    assert _pillars_verdict(_pillars_summary(results)[1]) == []
