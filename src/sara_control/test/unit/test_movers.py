"""Movers: somebody who walks up is told from walls, and the zones stand still for them."""

import math
import random
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from sara_control.movers import HOLD, PAUSE, Mover
from sara_control.zone_config import RangeSensor, ZoneConfig
from sara_control.zones import Zones

CONFIG = ZoneConfig.from_params(yaml.safe_load((Path(__file__).parents[2] / 'config/safety.yaml').read_text())['zones'])

FRONT = RangeSensor('SDI', 0.54, 0.18, math.radians(10.0))
HALF = math.radians(30.0)


def hear(mover, distances, v=0.0, w=0.0, t=0.0, period=0.2):
    """Readings one after another; the speeds that were told."""
    return [mover.add(t + period * k, d, v, w) for k, d in enumerate(distances)]


@given(st.floats(0.4, 1.5), st.floats(0.0, 0.8), st.integers(0, 10**6))
@settings(max_examples=200, deadline=None)
def test_who_walks_up_is_told_within_three_readings_whatever_the_chair_does(walk, v, seed):
    noise = random.Random(seed)
    closing = walk + v * math.cos(math.radians(10.0))
    told = hear(Mover(FRONT, HALF), [3.0 - closing * 0.2 * k + noise.uniform(-0.01, 0.01) for k in range(4)], v)
    assert told[-1] == pytest.approx(walk, abs=0.12 + 0.02 * v)
    assert told[0] == told[1] == 0.0


@given(st.floats(-0.8, 0.8), st.integers(0, 10**6))
@settings(max_examples=300, deadline=None)
def test_walls_that_the_chair_drives_towards_or_along_are_no_movers(v, seed):
    noise = random.Random(seed)
    distances = [round(2.4 - v * 0.2 * k * noise.uniform(0.8, 1.0) + noise.uniform(-0.01, 0.01), 2) for k in range(8)]
    assert not any(hear(Mover(FRONT, HALF), distances, v))


@given(st.floats(-0.4, 0.4), st.floats(0.3, 2.0), st.floats(-0.9, 0.9))
@settings(max_examples=300, deadline=None)
def test_a_long_wall_is_no_mover_while_the_chair_turns(w, away, bearing):
    """What is heard of a wall is where it is nearest within the cone, up to 45 degrees off its normal."""
    def heard(t):
        normal = bearing - w * t
        edge = min(max(abs(normal) - HALF, 0.0), math.radians(44.0))
        return away / math.cos(edge)
    assert not any(hear(Mover(RangeSensor('X', 0.0, 0.0, 0.0), HALF), [heard(0.2 * k) for k in range(8)], 0.0, w))


def test_a_jamb_that_comes_into_the_cone_is_no_mover():
    assert not any(hear(Mover(FRONT, HALF), [2.2, 2.2, 0.6, 0.6, 0.6], 0.3))
    assert not any(hear(Mover(FRONT, HALF), [2.2, 2.2, 1.4, 0.6, 0.6], 0.3))     # and not if a median makes two steps of it: nobody runs so fast


def test_a_braking_chair_hears_late_what_it_did_and_meets_nobody():
    mover, distance, told = Mover(FRONT, HALF), 2.0, []
    speeds = [0.5, 0.5, 0.5, 0.34, 0.18, 0.02, 0.0, 0.0]
    for k, v in enumerate(speeds):
        told.append(mover.add(0.2 * k, round(distance, 2), v, 0.0))
        distance -= 0.2 * speeds[max(k - 1, 0)]
    assert not any(told)


def test_somebody_is_reckoned_with_for_a_while_and_then_no_more():
    mover = Mover(FRONT, HALF)
    assert hear(mover, [2.0, 1.8, 1.6])[-1] > 0.9
    assert mover.speed(0.4 + HOLD) > 0.9
    assert mover.speed(0.41 + HOLD) == 0.0
    assert mover.add(0.6, math.inf, 0.0, 0.0) > 0.9      # no echo: still there as far as anybody knows


def test_nearby_the_first_step_makes_it_wait_for_a_second():
    mover = Mover(FRONT, HALF)
    assert hear(mover, [0.9, 0.75])[-1] == pytest.approx(0.75)
    assert mover.speed(0.2 + PAUSE) > 0.0
    assert mover.add(0.4, 0.75, 0.0, 0.0) > 0.0 and mover.add(0.7, 0.75, 0.0, 0.0) == 0.0
    assert not any(hear(Mover(FRONT, HALF), [1.5, 1.35]))
    assert not any(hear(Mover(FRONT, HALF), [0.9, 0.5]))     # no walk: something came into the cone


@pytest.mark.parametrize('then', [0.1, -5.0])
def test_a_clock_set_back_forgets_everything(then):
    mover = Mover(FRONT, HALF)
    hear(mover, [2.0, 1.8, 1.6], t=1.0)
    assert mover.add(then, 1.4, 0.0, 0.0) == 0.0
    assert mover.add(then + 0.2, 1.2, 0.0, 0.0) == 0.0


def test_readings_with_a_pause_between_are_not_compared():
    mover = Mover(FRONT, HALF)
    for k, distance in enumerate((2.4, 2.0, 1.6, 1.2)):
        assert mover.add(1.0 * k, distance, 0.0, 0.0) == 0.0


def approached(walk, start=2.2, sensors=('SDI', 'SDD'), until=4):
    """Zones that hear somebody come."""
    result = Zones(CONFIG)
    for k in range(until):
        for sensor in CONFIG.sensors:
            near = start - walk * 0.2 * k if sensor.name in sensors else math.inf
            result.on_range(sensor.name, near, 0.2 * k, 0.0, 0.0)
    return result, start - walk * 0.2 * (until - 1)


@given(st.floats(0.4, 1.5), st.floats(0.05, 0.8))
@settings(max_examples=100, deadline=None)
def test_the_chair_stands_before_somebody_who_walks_up_has_come(walk, v):
    """The law: what is allowed ends, with the walker's way until then, before the stop distance; and nothing creeps towards them."""
    met, distance = approached(walk)
    factor, name = met.scale(v, 0.0)
    u = factor * v
    room = distance - CONFIG.stop_distance - walk * (CONFIG.reaction_time + CONFIG.ease + u / CONFIG.braking)
    if u > 0.0:
        assert u * (CONFIG.reaction_time + CONFIG.ease) + u * u / (2.0 * CONFIG.braking) <= room + 0.12 * (1.0 + walk)
    else:
        assert name in ('SDI', 'SDD')
    assert met.scale(-v, 0.0) == (1.0, '')   # away from them always


def test_nothing_creeps_towards_somebody_who_comes():
    met, distance = approached(0.8, start=1.0)
    assert distance > 0.5
    assert met.scale(0.05, 0.0)[0] == 0.0
    assert met.scale(0.05, 0.0, gentle=False)[0] < 1.0
    standing, _ = approached(0.0, start=distance)
    assert standing.scale(0.05, 0.0)[0] == 1.0


def test_a_turn_waits_for_who_comes_to_the_side_that_it_swings_out():
    met, distance = approached(0.8, start=1.4, sensors=('SLIT',))
    assert distance > 0.9
    assert met.scale(0.0, -0.4)[0] < 0.5
    assert met.scale(0.0, 0.4) == (1.0, '')      # the rear swings away from them
    standing, _ = approached(0.0, start=distance, sensors=('SLIT',))
    assert standing.scale(0.0, -0.4) == (1.0, '')
