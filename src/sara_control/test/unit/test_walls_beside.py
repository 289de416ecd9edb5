"""A wall that closes in beside the chair stops it before its corner meets it, though no sensor ahead hears it."""

import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.platforms import load, parameters
from sara_control.zones.tangents import Line, tangent
from sara_control.zones.walls_beside import LONGEST, SPAN, Reading, WallsBeside, fitted
from sara_control.zones.zone_config import ZoneConfig
from sara_control.zones.zone_places import Body
from sara_control.zones.zones import Zones

HALF, STEEPEST = math.radians(30.0), math.radians(60.0)
STEP, PERIOD, DELAY = 0.02, 0.2, 0.1  # s: a cycle, between bursts, until a range is there
ACCELERATION, BRAKING = 0.4, 1.5  # m/s2


def config_of(platform):
    return ZoneConfig.from_params(parameters('sara_control', 'safety.yaml', load(platform))['zones'])


def heard(sensor, x, wall, rng, wrong):
    """The range of a sensor of a chair at x (m) that drives along the x axis; wall: (side, gap at x = 0, slant). wrong:
    share of ranges that are too near.
    """
    side, gap, slant = wall
    off = math.remainder(side * (math.pi / 2 - slant) - sensor.yaw, math.tau)  # the wall's normal from the axis
    if abs(off) > STEEPEST or rng.random() < 0.02:
        return math.inf
    away = gap * math.cos(slant) - (x + sensor.x) * math.sin(slant) - side * sensor.y * math.cos(slant)
    distance = away / math.cos(max(abs(off) - HALF, 0.0)) + rng.gauss(0.0, 0.01)
    if wrong and rng.random() < wrong:
        distance -= 0.12
    return -math.inf if distance < 0.16 else distance


def corner_gap(config, x, wall, sense):
    """m from the corner that leads to the wall."""
    side, gap, slant = wall
    return (
        gap * math.cos(slant)
        - (x + sense * 0.5 * config.length) * math.sin(slant)
        - 0.5 * config.width * math.cos(slant)
    )


def drive(platform, speed, wall, seed, seconds=16.0, wrong=0.0):
    """(least gap between corner and wall, way; m) of a chair told to drive straight on at a speed."""
    config, rng, sense = config_of(platform), random.Random(seed), math.copysign(1.0, speed)
    zones = Zones(config)
    x = v = 0.0
    least, waiting = math.inf, []
    for k in range(round(seconds / STEP)):
        t = k * STEP
        for number, sensor in enumerate(config.sensors):
            if (k + 2 * number) % round(PERIOD / STEP) == 0:
                waiting.append((t + DELAY, sensor.name, heard(sensor, x, wall, rng, wrong)))
        for stamp, name, distance in [entry for entry in waiting if entry[0] <= t]:
            zones.on_raw_range(name, distance, stamp, v, 0.0)
            zones.on_range(name, distance, stamp, v, 0.0)
        waiting = [entry for entry in waiting if entry[0] > t]
        aim = abs(speed) * min(zones.scale(speed, 0.0)[0], 1.0)
        v = sense * max(min(aim, abs(v) + ACCELERATION * STEP), abs(v) - BRAKING * STEP)
        x += v * STEP
        least = min(least, corner_gap(config, x, wall, sense))
    return least, x


def contacts(platform, drives=60, wrong=0.0):
    """How many of so many drawn drives end in a wall that closes in by 8 to 19 deg."""
    rng, half_width, met = random.Random(1), 0.5 * config_of(platform).width, 0
    for seed in range(drives):
        side, speed, slant = rng.choice((-1.0, 1.0)), rng.uniform(0.1, 0.8), math.radians(rng.uniform(8.0, 19.0))
        gap = rng.uniform(0.5, 0.9)
        if rng.random() < 0.3:  # backwards
            speed, slant = -0.5 * speed, -slant
        met += drive(platform, speed, (side, half_width + gap, slant), seed, wrong=wrong)[0] <= 0.0
    return met


@pytest.mark.parametrize('normal', (-3.0, 0.4, 1.5))
def test_a_line_is_told_by_the_circles_that_it_touches_and_by_no_other_places(normal):
    line = Line(normal, 2.0)
    places = [(0.1 * k, 0.3 - 0.05 * k * k) for k in range(5)]
    found = tangent([(x, y, line.distance(x, y)) for x, y in places], normal + 0.2)
    assert math.dist(found.line, line) < 1e-6 and max(map(abs, found.off)) < 1e-3
    assert tangent([(0.1, 0.2, 1.0)] * 4, normal) is None


@pytest.mark.parametrize('platform', ('sara', 'kate'))
def test_the_corner_does_not_meet_a_wall_that_closes_in(platform, monkeypatch):
    assert contacts(platform) == 0
    monkeypatch.setattr(WallsBeside, '_closing', lambda _: ())
    assert contacts(platform, 20) > 10, 'nothing else keeps it from there'


@pytest.mark.parametrize('wrong', (0.02, 0.05))
def test_a_range_that_is_too_near_now_and_then_makes_it_lose_no_wall(wrong):
    assert contacts('sara', wrong=wrong) == 0


@pytest.mark.parametrize('platform', ('sara', 'kate'))
@settings(max_examples=20, deadline=None)
@given(st.floats(0.12, 0.6), st.floats(-2.0, 2.0), st.integers(0, 99))
def test_along_a_wall_it_drives_on(platform, gap, slant, seed):
    wall = 1.0, 0.5 * config_of(platform).width + gap, math.radians(slant)
    _, way = drive(platform, 0.5, wall, seed, seconds=3.0)
    assert way == pytest.approx(0.5 * (3.0 - 0.5 * 0.5 / ACCELERATION), abs=0.02)


@given(st.floats(-3.0, 3.0), st.floats(0.2, 1.2), st.floats(-0.45, 0.45), st.floats(SPAN + 0.01, LONGEST))
def test_a_line_is_found_exactly(yaw, away, slant, way):
    normal = yaw + math.pi / 2 - slant
    readings = []
    for k in range(6):
        x, y = (math.cos(yaw) * way * k / 5, math.sin(yaw) * way * k / 5)
        distance = away - math.cos(normal) * x - math.sin(normal) * y
        readings.append(Reading(x, y, yaw + math.pi / 2, distance, way * k / 5, way * k / 5))
    wall = fitted(readings, HALF)
    assert math.remainder(wall.normal - normal, math.tau) == pytest.approx(0.0, abs=1e-6)
    assert wall.away == pytest.approx(away, abs=1e-6)


@given(st.floats(0.12, 0.45), st.floats(-0.1, 0.3))
def test_an_edge_that_is_passed_is_no_wall(away, ahead):
    """A jamb, a post: its ranges lie on no line once it has been passed half-way through the cone."""
    readings = []
    for k in range(12):
        x = k * 0.05
        if abs(math.atan2(ahead - x, away)) < HALF:
            readings.append(Reading(x, 0.0, math.pi / 2, math.hypot(ahead - x, away), x, x))
    wall = fitted(readings, HALF)
    assert wall is None or abs(math.cos(wall.normal)) < 0.35


def test_one_lost_echo_changes_nothing_and_the_end_of_the_wall_does():
    beside = WallsBeside(config_of('sara').sensors, HALF, Body(0.54, 0.31))
    t, x, slant = 0.0, 0.0, math.radians(12.0)
    for _ in range(8):
        t, x = t + 0.2, x + 0.08
        beside.on_range('SLID', 0.5 - x * math.tan(slant), t, 0.4, 0.0)
    assert beside.places
    for k in range(3):
        assert beside.places, 'it is there until it was not heard three times'
        beside.on_range('SLID', math.inf, t + 0.2 * (k + 1), 0.0, 0.0)
    assert not beside.places


def test_a_wall_that_was_heard_on_the_way_back_is_known_on_the_way_on():
    beside = WallsBeside(config_of('sara').sensors, HALF, Body(0.54, 0.31))
    slant = math.radians(12.0)
    t, x = 0.0, 0.0
    for v in [-0.25] * 10 + [0.25] * 2:
        t, x = t + 0.2, x + 0.2 * v
        for sensor in config_of('sara').sensors:
            beside.on_range(
                sensor.name, heard(sensor, x - DELAY * v, (1.0, 0.9, slant), random.Random(3), 0.0), t, v, 0.0
            )
    assert beside.places and all(y > 0.0 for _, y, _, _ in beside.places)
