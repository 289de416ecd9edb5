"""What was heard close and is heard no more since the chair moved stands beside the cone still."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.platforms import load, parameters
from sara_control.zones.lost_echoes import CLOSE, KEPT, LATELY, NEAREST, LostEchoes
from sara_control.zones.zone_config import ZoneConfig
from sara_control.zones.zones import Zones

CONFIG = ZoneConfig.from_params(parameters('sara_control', 'safety.yaml', load('sara'))['zones'])
HALF = 0.5 * CONFIG.field_of_view
SENSORS = {sensor.name: sensor for sensor in CONFIG.sensors}


def losing(name='SDI', distance=0.2, v=0.05, w=0.0):
    """LostEchoes of a chair that moved at v, w when a sensor lost what it had heard at a distance, at 1.0 s."""
    lost = LostEchoes(HALF)
    for stamp in (0.6, 0.8, 1.0):
        lost.carry(stamp, v, w)
    lost.on_range_change(SENSORS[name], distance, math.inf)
    return lost


@pytest.mark.parametrize('name', ('SDI', 'SDD', 'STI', 'STD'))
@given(distance=st.floats(0.0, CLOSE) | st.just(-math.inf))
@settings(max_examples=50)
def test_the_outer_end_of_the_arc_is_kept(name, distance):
    sensor, away = SENSORS[name], max(distance, NEAREST)
    ahead = math.copysign(1.0, math.cos(sensor.yaw))
    place, *nearer = losing(name, distance, 0.05 * ahead).places
    assert bool(nearer) == (distance < NEAREST)
    assert place.name == name and math.dist((place.x, place.y), (sensor.x, sensor.y)) == pytest.approx(away)
    assert place.x * ahead > 0.54 and place.y * sensor.y > sensor.y**2
    assert abs(
        math.remainder(math.atan2(place.y - sensor.y, place.x - sensor.x) - sensor.yaw, math.tau)
    ) == pytest.approx(HALF)


@pytest.mark.parametrize('before', ((-math.inf,), (0.2, -math.inf), (-math.inf, 0.17), (0.2, 0.17)))
def test_what_was_too_near_just_before_may_be_nearer(before):
    """A jamb that is too near, and then heard once more as it leaves the cone: it stands before the corner."""
    lost, sensor = LostEchoes(HALF), SENSORS['SDI']
    for k, (a, b) in enumerate(zip((None, *before), (*before, math.inf))):
        lost.carry(0.2 * k, 0.05, 0.0)
        lost.on_range_change(sensor, a, b)
    away = [math.dist((place.x, place.y), (sensor.x, sensor.y)) for place in lost.places]
    far = max(before[-1], NEAREST)
    assert away == pytest.approx([far, 0.5 * NEAREST] if -math.inf in before else [far])
    assert len(away) == 1 or lost.places[1].y < 0.29, 'in the way of the body'


def test_what_is_not_driven_up_to_or_farther_off_or_beside_the_chair_or_moves_on_is_not_kept():
    assert (
        not losing(v=0.0).places
        and not losing(v=-0.1).places
        and not losing(v=0.0, w=0.3).places
        and not losing('STI').places
    )
    assert not losing(distance=CLOSE + 0.01).places
    assert not any(losing(name).places for name in ('SLID', 'SLIT', 'SLDD', 'SLDT', 'SJO'))
    lost = losing(distance=0.4)
    assert (
        not lost.on_range_change(SENSORS['SDI'], 0.2, 0.3)
        and not lost.on_range_change(SENSORS['SDI'], -math.inf, 0.2)
        and not lost.places
    )


@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.integers(1, 20))
def test_a_place_stays_where_it_is_while_the_chair_moves(v, w, steps):
    lost = losing()
    before = [(place.x, place.y) for place in lost.places]
    x = y = yaw = 0.0
    for k in range(1, steps + 1):
        lost.carry(1.0 + 0.05 * k, v, w)
        x, y, yaw = x + 0.05 * v * math.cos(yaw), y + 0.05 * v * math.sin(yaw), yaw + 0.05 * w
    for (px, py), place in zip(before, lost.places):
        now = (
            x + math.cos(yaw) * place.x - math.sin(yaw) * place.y,
            y + math.sin(yaw) * place.x + math.cos(yaw) * place.y,
        )
        assert now == pytest.approx((px, py), abs=1e-9)


def test_it_is_forgotten_when_a_cone_finds_it_free_and_after_some_way():
    lost = losing()
    lost.carry(1.4, -0.8, 0.0)  # back by 0.32 m: it is well within the cone again
    assert not lost.on_range_change(SENSORS['SDI'], 0.6, 0.5) and len(lost.places) == 1
    assert lost.on_range_change(SENSORS['SDI'], 0.5, 2.0) and not lost.places
    lost = losing()
    for k in range(1, 600):
        lost.carry(1.0 + 0.2 * k, 0.0, 0.0)
    assert lost.places  # a chair that stands learns nothing of it
    for k in range(600, 600 + round(KEPT / 0.02)):
        assert lost.places
        lost.carry(1.0 + 0.2 * k, 0.1, 0.0)
    for k in (2, 3):
        lost.carry(1.0 + 0.2 * (600 + k) + KEPT / 0.1, 0.1, 0.0)
    assert not lost.places


@pytest.mark.parametrize('stops', (True, False))
def test_a_place_that_a_cone_finds_free_for_a_while_is_forgotten_though_its_range_does_not_change(stops):
    """In open space a sensor says +Inf all the time."""
    lost, sensor = losing(), SENSORS['SDI']
    lost.carry(1.4, -0.8, 0.0)
    for stamp in [1.4 + 0.1 * k for k in range(1, 20)]:
        lost.carry(stamp, 0.0, 0.0)
        assert lost.places or stamp > 1.5 + LATELY
        lost.on_same_range(sensor if stops else replace(sensor, name='SLID', stops=False), math.inf)
    assert bool(lost.places) != stops


def test_a_place_that_is_found_free_with_a_break_is_kept():
    lost = losing()
    lost.carry(1.4, -0.8, 0.0)
    for k in range(1, 40):
        lost.carry(1.4 + 0.1 * k, 0.0, 0.0)
        lost.on_same_range(SENSORS['SDI'], 0.3 if k % 10 == 0 else math.inf)
    assert lost.places


@pytest.mark.parametrize('pause', (0.6, -0.1))
def test_when_nobody_knows_how_the_chair_moved_all_is_forgotten(pause):
    lost = losing()
    assert lost.carry(1.0 + pause, 0.0, 0.0) and not lost.places


def creeping(jamb_y, yaw_rate, forgets, seconds=25.0):
    """A chair that wants to go straight on at 0.2 m/s, its heading wavering, with a jamb 0.5 m before it, and obeys 0.3
    s late; the gap to it (m) until 8 s after it was stopped first.

    forgets: the gate keeps nothing.
    """
    zones, jamb = Zones(CONFIG), (1.04, jamb_y)
    if forgets:
        zones._lost.on_range_change = lambda *_: False
    x = y = yaw = t = v = w = 0.0
    last, stopped, gap = {name: [] for name in SENSORS}, math.inf, math.inf
    while t < min(seconds, stopped + 8.0):
        wanted = yaw_rate * math.sin(2.0 * t)
        factor, _ = zones.scale(0.2, wanted)
        if factor == 0.0:
            stopped = min(stopped, t)
        v, w = 0.5 * v + 0.1 * factor, 0.5 * w + 0.5 * wanted * factor
        for _ in range(4):
            x, y, yaw = x + 0.05 * v * math.cos(yaw), y + 0.05 * v * math.sin(yaw), yaw + 0.05 * w
        t += 0.2
        dx, dy = jamb[0] - x, jamb[1] - y
        px, py = math.cos(yaw) * dx + math.sin(yaw) * dy, math.cos(yaw) * dy - math.sin(yaw) * dx
        gap = min(gap, max(abs(px) - 0.54, abs(py) - 0.29))
        for name, sensor in SENSORS.items():
            off = math.remainder(math.atan2(py - sensor.y, px - sensor.x) - sensor.yaw, math.tau)
            away = math.hypot(px - sensor.x, py - sensor.y)
            last[name].append(math.inf if abs(off) > HALF else -math.inf if away < 0.16 else away)
            zones.on_range(name, sorted(last[name][-3:])[len(last[name][-3:]) // 2], t, v, w)
    return gap


@given(st.floats(0.18, 0.285), st.floats(0.0, 0.06))
@settings(max_examples=60)
def test_a_jamb_that_is_in_the_way_is_not_touched_though_it_leaves_the_cone(jamb_y, yaw_rate):
    assert creeping(jamb_y, yaw_rate, forgets=False) > 0.0


def test_one_that_forgets_touches_it():
    assert min(creeping(0.2 + 0.01 * k, 0.01 * m, forgets=True) for k in range(9) for m in range(6)) <= 0.0


def test_a_reading_that_comes_a_little_late_forgets_nothing():
    """Each topic is heard in a thread of its own."""
    lost = losing()
    (kept,) = lost.places
    assert not lost.carry(0.999, 0.05, 0.0) and lost.places == [kept]
    lost.carry(1.05, 0.05, 0.0)
    assert lost.places[0].x == pytest.approx(kept.x - 0.05 * 0.05)
    assert lost.carry(0.9, 0.05, 0.0) and not lost.places  # the clock was set back
