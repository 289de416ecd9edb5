"""What came of meetings with pedestrians: false stops and yields counted, how near and how fast."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sara_common.platforms import load
from sara_control.gate.reasons import State
from sara_lab.judge.encounters import Encounters
from sara_sim.config import ChairConfig
from sara_sim.world.obstacles import Obstacle
from sara_sim.world.world import World

SARA = load('sara')


def lockstep_of(obstacles, state=State.SLOWED, velocity=(0.0, 0.0), occupied=None):
    """SARA at the origin of a map of 10 x 10 m that begins at (-5, -5), with the gate in that state."""
    cells = np.zeros((200, 200), bool) if occupied is None else occupied
    world = World(cells, origin=(-5.0, -5.0), obstacles=obstacles)
    zones = SimpleNamespace(pedestrian_moving=False)
    return SimpleNamespace(
        wheels=SimpleNamespace(guard=SimpleNamespace(zones=zones), decision=SimpleNamespace(state=state)),
        chair=SimpleNamespace(
            world=world, pose=(0.0, 0.0, 0.0), velocity=velocity, config=ChairConfig.of(SARA), platform=SARA
        ),
        time=0.0,
    )


def watched(moments, obstacles=(), **how):
    """The Meetings of [(s, whether the gate takes something for a pedestrian), ...]."""
    lockstep, encounters = lockstep_of(obstacles, **how), Encounters()
    for lockstep.time, lockstep.wheels.guard.zones.pedestrian_moving in moments:
        lockstep.chair.world.obstacles.move_to(lockstep.time)
        encounters.after(lockstep)
    return encounters.meetings


def walker(x, y, **how):
    """Somebody who has not set out yet."""
    return Obstacle('person 1', radius=0.25, path=((x, y), (x, y + 1.0)), speed=1.0, start=100.0, **how)


def test_what_follows_within_a_second_is_the_same_stop():
    assert watched([(1.0, True), (1.01, True), (1.5, False), (1.9, True), (2.0, False)]).false_stops == 1
    assert watched([(1.0, True), (1.5, False), (2.1, True)]).false_stops == 2
    assert watched([(1.0, False)]).false_stops == 0


def test_a_detection_that_does_not_slow_the_chair_is_no_stop():
    assert watched([(1.0, True)], state=State.DRIVING).false_stops == 0
    assert watched([(1.0, True)], state=State.HELD).false_stops == 1


def test_a_stop_for_somebody_who_walks_there_is_a_yield():
    found = watched([(1.0, True)], [walker(3.0, 0.0)])
    assert (found.false_stops, found.yields) == (0, 1)
    box = Obstacle('box 1', size=(0.4, 0.4), at=(1.0, 0.0))
    for other in (walker(5.0, 0.0), box, walker(3.0, 0.0, disappears=0.5)):
        found = watched([(1.0, True)], [other])
        assert (found.false_stops, found.yields) == (1, 0)


def test_the_end_of_a_stop_for_somebody_who_has_left_is_not_false():
    somebody = walker(3.0, 0.0, disappears=2.0)
    found = watched([(1.0, True), (1.9, True), (2.5, True), (3.4, True)], [somebody])
    assert (found.false_stops, found.yields) == (0, 1)
    found = watched([(1.0, True), (3.4, True)], [somebody])
    assert (found.false_stops, found.yields) == (1, 1)


def test_the_nearest_is_measured_from_edge_to_edge():
    assert watched([(1.0, False)], [walker(1.54, 0.0)]).nearest == pytest.approx(1.54 - 0.54 - 0.25)
    assert watched([(1.0, False)], [walker(0.0, -0.79)]).nearest == pytest.approx(0.25)
    assert watched([(1.0, False)], [walker(0.1, 0.0)]).nearest == 0.0
    assert math.isnan(watched([(1.0, False)], [walker(4.0, 0.0)]).nearest)


def test_pressing_on_somebody_near_counts_where_a_sensor_could_hear_them():
    ahead, beside = walker(0.99, 0.0), walker(0.0, 0.75)
    assert watched([(1.0, False)], [ahead], velocity=(0.4, 0.0)).pressed == pytest.approx(0.4)
    assert watched([(1.0, False)], [ahead], velocity=(-0.4, 0.0)).pressed == 0.0
    assert watched([(1.0, False)], [walker(1.2, 0.0)], velocity=(0.4, 0.0)).pressed == 0.0  # 0.41 m away
    assert watched([(1.0, False)], [beside], velocity=(0.4, 0.0)).pressed == pytest.approx(0.0, abs=1e-12)
    wall = np.zeros((200, 200), bool)
    wall[:, 112] = True  # at 0.60 to 0.65 m, between the sensors and them
    assert watched([(1.0, False)], [ahead], velocity=(0.4, 0.0), occupied=wall).pressed == 0.0
