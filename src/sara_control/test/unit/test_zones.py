"""Zones against a chair that is really driven: whatever a reading may mean, what is allowed ends before the contact."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_common.platforms import folders, load, parameters
from sara_control.zones import zone_places
from sara_control.zones.zone_config import RangeSensor, ZoneConfig
from sara_control.zones.zone_places import Body
from sara_control.zones.zones import RAYS, Zones

INF = math.inf
PLACES = {
    'SDI': (0.54, 0.18, 10),
    'SDD': (0.54, -0.18, -10),
    'SLID': (0.35, 0.29, 90),
    'SLIT': (-0.35, 0.29, 90),
    'SLDD': (0.35, -0.29, -90),
    'SLDT': (-0.35, -0.29, -90),
    'STI': (-0.54, 0.18, 170),
    'STD': (-0.54, -0.18, -170),
}
SENSORS = tuple(
    RangeSensor(name, x, y, math.radians(yaw), 0.10 if name.startswith('SL') else 0.0)
    for name, (x, y, yaw) in PLACES.items()
) + (RangeSensor('SJO', 0.30, -0.25, 0.0, 0.0, False),)
CONFIG = ZoneConfig.of(load('sara'), sensors=SENSORS)
ROBOTS = [
    ZoneConfig.from_params(parameters('sara_control', 'safety.yaml', load(robot))['zones']) for robot in folders()
]


def zones(config=CONFIG, /, **ranges):
    """Zones that believe these ranges, all others free."""
    result = Zones(config)
    for name in result.sensors:
        result.on_range(name, ranges.get(name, INF))
    return result


def drive_until_contact(v, w, x, y, limit, config=CONFIG, step=0.002):
    """The way (m) that a place makes relative to the chair until it is inside the body's rectangle, by small steps;
    else limit.
    """
    way = 0.0
    u = math.hypot(v - w * y, w * x)
    if u < 1e-9:
        return limit
    dt = step / u
    while way < limit:
        x, y = x - v * dt + w * y * dt, y - w * x * dt
        way += step
        if abs(x) < 0.5 * config.length and abs(y) < 0.5 * config.width:
            return way
    return limit


@pytest.mark.parametrize('config', ROBOTS, ids=folders())
@given(st.data(), st.floats(0.02, 2.4), st.floats(-30, 30), st.floats(-0.8, 0.8), st.floats(-0.8, 0.8))
def test_from_what_is_allowed_a_robot_comes_to_rest_before_contact(config, data, distance, angle, v, w):
    """The law: u t_react + u^2 / (2 a) stays below the way to any place that the echo may come from."""
    sensor = data.draw(st.sampled_from([sensor for sensor in config.sensors if sensor.stops]))
    bearing = sensor.yaw + math.radians(angle)
    x, y = sensor.x + distance * math.cos(bearing), sensor.y + distance * math.sin(bearing)
    u = math.hypot(v - w * y, w * x)
    assume(u > 0.01)
    factor, _ = zones(config, **{sensor.name: distance}).scale(v, w, gentle=False)
    allowed = factor * u * config.reaction_time + (factor * u) ** 2 / (2.0 * config.hard_braking)
    if factor * u <= 1.25 * config.creep_speed + 1e-9:  # passes always
        return
    # The cone is reckoned with at 13 places, 5 degrees apart: between them the corner of a body may be nearer by the
    # sagitta.
    assert drive_until_contact(v, w, x, y, allowed + 0.2, config) > allowed - 0.02


@given(st.floats(0.16, 2.4), st.floats(0.05, 0.8))
def test_straight_ahead_exactly(distance, v):
    ahead = zones(SDI=distance, SDD=distance)
    factor, sensor = ahead.scale(v, 0.0)
    nearest = min(
        distance * math.cos(math.radians(a))
        for a in range(-20, 45, 5)
        if 0.18 + distance * math.sin(math.radians(a)) <= 0.31
    )
    room = nearest - 0.15
    if room <= 0.0:
        assert factor == 0.0
    elif factor < 1.0:
        assert v * factor == pytest.approx(max(0.1, 0.8 * (math.sqrt(1.35**2 + 2 * room / 0.8) - 1.35)), abs=0.03)
        assert sensor in ('SDI', 'SDD') and ahead.sensors[sensor].side == 'front'
    else:
        assert CONFIG.way_to_rest(v) + 0.6 * v <= room + 0.05 or v <= 0.1


@given(st.floats(0.3, 2.4), st.floats(0.11, 0.8))
def test_what_is_aimed_at_keeps_the_law(distance, v):
    """v t_react + v^2 / (2 a_brake) below the free distance, with the gentle brake."""
    factor, _ = zones(SDI=distance, SDD=distance).scale(v, 0.0)
    assert CONFIG.way_to_rest(v * factor) < distance


def test_creeping_is_never_braked_hard():
    for distance in (-INF, 0.0, 0.1, 0.3):
        assert zones(SDI=distance).scale(0.12, 0.03, gentle=False) == (1.0, '')
        assert zones(SDI=distance).scale(0.2, 0.0, gentle=False)[0] < 1.0 or distance == 0.3


@given(
    st.sampled_from([s.name for s in SENSORS]),
    st.floats(0.1, 2.4),
    st.floats(0.0, 0.3),
    st.floats(-0.8, 0.8),
    st.floats(-0.8, 0.8),
)
def test_nearer_never_allows_more(name, distance, less, v, w):
    near, far = zones(**{name: max(distance - less, 0.0)}), zones(**{name: distance})
    # The places of the two cones are samples: what falls between them may differ by a sample's width.
    assert near.scale(v, w)[0] <= far.scale(v, w)[0] + 0.25


@given(st.floats(0.1, 2.4), st.floats(-0.8, 0.8), st.floats(-0.8, 0.8))
@settings(max_examples=100)
def test_left_and_right_alike(distance, v, w):
    assert zones(SDI=distance).scale(v, w)[0] == pytest.approx(zones(SDD=distance).scale(v, -w)[0], abs=1e-9)
    assert zones(SLIT=distance).scale(v, w)[0] == pytest.approx(zones(SLDT=distance).scale(v, -w)[0], abs=1e-9)
    assert zones(STI=distance).scale(v, w)[0] == pytest.approx(zones(SDI=distance).scale(-v, -w)[0], abs=1e-9)


def test_gentle_asks_sooner():
    ahead = zones(SDI=0.8)
    assert ahead.scale(0.8, 0.0)[0] < ahead.scale(0.8, 0.0, gentle=False)[0] < 1.0


def test_only_the_direction_of_travel_counts():
    ahead, behind = zones(SDI=0.2), zones(STD=0.2)
    assert ahead.scale(0.4, 0.0)[0] < 0.3 and ahead.scale(-0.4, 0.0) == (1.0, '')
    assert behind.scale(-0.4, 0.0)[0] < 0.3 and behind.scale(0.4, 0.0) == (1.0, '')
    assert behind.scale(-0.4, 0.0)[1] == 'STD'
    assert zones(SDI=-INF).scale(0.0, 0.0) == (1.0, '')


def test_too_near_stops_and_way_back_is_open():
    for name, v in (('SDI', 0.1), ('STI', -0.1)):
        touching = zones(**{name: -INF})
        assert touching.scale(v, 0.0) == (0.0, name) and touching.scale(-v, 0.0) == (1.0, '')


def test_turning_in_place():
    beside = zones(SLID=0.17)
    assert beside.scale(0.0, 0.4)[0] < 1.0 or beside.scale(0.0, -0.4)[0] < 1.0
    assert zones(SLID=0.6).scale(0.0, 0.6) == (1.0, '')  # beyond the corners' circle
    assert zones(SLID=0.6).scale(0.3, 0.0) == (1.0, '')  # a wall alongside
    corner = zones(SLID=-INF)
    assert corner.scale(0.0, 0.3)[0] == 0.0 or corner.scale(0.0, -0.3)[0] == 0.0
    assert corner.scale(0.0, 0.3)[1] in ('', 'SLID')


def sonar(x, y, yaw, corners):
    """The nearest of some corners (m) in a cone of 60 degrees, as a range after REP-117."""
    best = INF
    for cx, cy in corners:
        bearing = math.remainder(math.atan2(cy - y, cx - x) - yaw, math.tau)
        if abs(bearing) <= math.radians(30):
            best = min(best, math.hypot(cx - x, cy - y))
    return -INF if best < 0.16 else best if best <= 2.5 else INF


@pytest.mark.parametrize('offset, yaw', [(0.0, 0.0), (0.03, 0.0), (-0.03, 0.0), (0.0, 0.05), (0.05, 0.0)])
def test_a_door_of_80_cm_is_passed_slowly(offset, yaw):
    """Jambs 0.10 m deep at +-0.40 m; the chair is driven through at what the zones allow, sonars at 5 Hz."""
    corners = [
        (dx, side * (0.40 + dy)) for side in (1, -1) for dx in np.linspace(0.0, 0.10, 6) for dy in (0.0, 0.01, 0.02)
    ]
    corners += [(dx, side * y) for side in (1, -1) for dx in (0.0, 0.10) for y in np.linspace(0.40, 1.5, 60)]
    passed = Zones(CONFIG)
    x, y, t, slowest = -1.8, offset - 1.8 * yaw, 0.0, 1.0
    while x < 0.9:
        if round(t / 0.05) % 4 == 0:
            for sensor in SENSORS:
                sx = x + sensor.x * math.cos(yaw) - sensor.y * math.sin(yaw)
                sy = y + sensor.x * math.sin(yaw) + sensor.y * math.cos(yaw)
                passed.on_range(sensor.name, sonar(sx, sy, yaw + sensor.yaw, corners))
        v = 0.5 * passed.scale(0.5, 0.0)[0]
        slowest = min(slowest, v)
        x, y, t = x + v * 0.05 * math.cos(yaw), y + v * 0.05 * math.sin(yaw), t + 0.05
        assert t < 60.0, f'stuck at {x:.2f}'
    assert 0.09 < slowest < 0.4, 'not slowly'


@pytest.mark.parametrize('w', [0.2, 0.8, -0.8])
@pytest.mark.parametrize('away', np.arange(0.585, 0.640, 0.005).round(3))
def test_no_corner_turns_into_a_wall_beside(away, w):
    """In place, with sonars at 5 Hz. A corner swings out to 0.613 m, between the two cones of a side."""
    wall = [(x, away) for x in np.arange(-1.0, 1.0, 0.005)]
    beside, yaw = Zones(CONFIG), 0.0
    for tick in range(400):
        c, s = math.cos(yaw), math.sin(yaw)
        if tick % 4 == 0:
            for sensor in SENSORS:
                x, y = c * sensor.x - s * sensor.y, s * sensor.x + c * sensor.y
                beside.on_range(sensor.name, sonar(x, y, yaw + sensor.yaw, wall))
        yaw += 0.05 * w * beside.scale(0.0, w)[0]
        assert abs(s) * 0.54 + abs(c) * 0.29 < away, f'turned by {yaw:.2f} rad'
    assert abs(yaw) > 0.3


def test_one_flickering_echo_changes_nothing():
    ahead = zones()
    ahead.on_range('SDI', 0.3)
    assert ahead.scale(0.8, 0.0) == (1.0, '')
    ahead.on_range('SDI', 0.35)
    assert ahead.range('SDI') == 0.35 and ahead.scale(0.8, 0.0)[0] < 1.0
    for lost in (INF, INF):
        ahead.on_range('SDI', lost)
        assert ahead.range('SDI') == 0.35
    ahead.on_range('SDI', 1.0)
    assert ahead.range('SDI') == 1.0


@given(st.lists(st.sampled_from([-INF, 0.2, 0.5, 1.0, INF]), min_size=1, max_size=30))
def test_believed_is_borne_out(readings):
    """A range is believed that was reached by 2 in a row from above or by 3 in a row from below."""
    one = Zones(CONFIG)
    believed = None
    for count, reading in enumerate(readings, 1):
        one.on_range('SDI', reading)
        before, believed = believed, one.range('SDI')
        if before is None:
            assert believed == reading
        elif believed < before:
            assert count >= 2 and all(r <= believed for r in readings[count - 2 : count])
        elif believed > before:
            assert count >= 3 and all(r >= believed for r in readings[count - 3 : count])
        else:
            assert not (count >= 2 and all(r < believed for r in readings[count - 2 : count]))
            assert not (count >= 3 and all(r > believed for r in readings[count - 3 : count]))


def test_what_is_no_reading():
    one = Zones(CONFIG)
    assert not one.on_range('SDI', math.nan) and not one.on_range('SDI', -0.1) and not one.on_range('nose', 1.0)
    assert one.range('SDI') is None and one.scale(0.8, 0.0) == (1.0, '')
    assert one.on_range('SDI', 0.0) and one.scale(0.8, 0.0)[0] == 0.0


@given(st.floats(0.25, 2.4), st.floats(-30, 30), st.floats(0.05, 0.8), st.floats(-0.4, 0.4), st.booleans())
def test_what_the_sensor_inside_the_outline_allows_ends_before_contact(distance, angle, v, w, gentle):
    """By the hard brake; and where it aims for less, the gentle limit is below the hard one."""
    sensor = SENSORS[8]
    bearing = sensor.yaw + math.radians(angle)
    x, y = sensor.x + distance * math.cos(bearing), sensor.y + distance * math.sin(bearing)
    assume(abs(x) > 0.54 or abs(y) > 0.31)
    slowed = zones(SJO=distance)
    factor, _ = slowed.scale(v, w, gentle)
    u = factor * math.hypot(v - w * y, w * x)
    if u > 1.25 * CONFIG.creep_speed + 1e-9:  # what passes always
        to_rest = u * CONFIG.reaction_time + u * u / (2.0 * CONFIG.hard_braking)
        assert drive_until_contact(factor * v, factor * w, x, y, to_rest + 0.2) > to_rest - 0.02
    if gentle:
        assert factor <= slowed.scale(v, w, False)[0] + 1e-12


def test_the_sensor_inside_the_outline_slows_but_does_not_stop():
    factor, sensor = zones(SJO=0.26).scale(0.5, 0.0)
    assert sensor == 'SJO' and 0.5 * factor == pytest.approx(0.1)
    assert zones(SJO=-INF).scale(-0.3, 0.0) == (1.0, '')


def test_a_point_on_the_axis_of_the_turn_does_not_matter():
    lone = Zones(ZoneConfig.of(load('sara'), sensors=(RangeSensor('up', 0.54, 0.0, 0.0),), field_of_view=1e-6))
    lone.on_range('up', 0.5)
    lone.on_range('up', 0.5)
    assert lone.scale(0.0, 0.4)[0] == 1.0


def test_sides():
    assert [RangeSensor('a', 0, 0, math.radians(yaw)).side for yaw in (10, -10, 170, -170, 90, -90)] == [
        'front',
        'front',
        'rear',
        'rear',
        'left',
        'right',
    ]


def test_config_names_every_fault():
    with pytest.raises(ConfigError) as error:
        ZoneConfig.from_params(
            {
                'length': 0,
                'ease': -1,
                'trigger': 0,
                'release': 2.5,
                'depth': 1,
                'field_of_view_deg': 'wide',
                'sensors': {'a': {'x': 'far', 'y': 0, 'yaw_deg': 0, 'near': -1, 'stops': 1, 'z': 3}, 'b': 5},
            }
        )
    text = str(error.value)
    for part in (
        'length is 0',
        'ease is -1',
        'trigger is 0',
        'release is 2.5',
        'depth is 1',
        "field_of_view is 'wide'",
        "sensors/a/x is 'far'",
        'sensors/a/near is -1',
        'sensors/a/stops is 1',
        'sensors/a/z is 3',
        'sensors/b/x is None',
    ):
        assert part in text, part
    with pytest.raises(ConfigError, match='creep_speed is 0.2'):
        ZoneConfig.of(sensors=(), creep_speed=0.2)
    with pytest.raises(ConfigError, match='sensors is 3'):
        ZoneConfig.from_params({'sensors': 3})
    config = ZoneConfig.from_params(
        {
            'length': 1.0,
            'width': 0.6,
            'sensors': {'a': {'x': 1, 'y': 0, 'yaw_deg': 180, 'near': 0.1, 'stops': False}},
            'field_of_view_deg': 90,
        }
    )
    assert config.sensors == (RangeSensor('a', 1, 0, math.pi, 0.1, False),) and config.field_of_view == pytest.approx(
        math.pi / 2
    )


@given(
    st.lists(st.sampled_from([-INF, INF]) | st.floats(0.0, 2.5), min_size=9, max_size=9),
    st.floats(-1.0, 1.0),
    st.floats(-1.0, 1.0),
    st.sampled_from(('both', 'straight', 'turn')),
    st.booleans(),
)
def test_places_that_are_too_far_to_be_looked_at_change_nothing(ranges, v, w, kind, gentle):
    v, w = (0.0 if kind == 'turn' else v), (0.0 if kind == 'straight' else w)
    limits = zones(**dict(zip(PLACES, ranges)), SJO=ranges[8])
    quick = limits.scale(v, w, gentle)
    limits._nearest = -INF  # a look at every place
    assert limits.scale(v, w, gentle) == quick


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_the_body_never_meets_a_place_that_it_does_not_sweep(x, y, v, w):
    """Nor is it stopped for it."""
    body = Body(0.54, 0.31)
    assume(zone_places.outside_of(x, y, body) > 0.0 and math.hypot(v, w) > 0.1)
    if not zone_places.is_swept((x, y, math.hypot(x, y)), v, w, body):
        assert drive_until_contact(v, w, x, y, 10.0) == 10.0
        assert zone_places.free_distance((x, y), v, w, 10.0, body) == INF


@given(
    st.lists(
        st.tuples(st.sampled_from(sorted(PLACES)), st.sampled_from([-INF, INF]) | st.floats(0.0, 6.0)),
        min_size=1,
        max_size=12,
    )
)
def test_places_are_where_the_echoes_say(readings):
    """On the rays of the sensor's cone, at the echo's distance, and not within the body."""
    zones, echoes = Zones(CONFIG), {}
    for name, distance in readings:
        zones._place(zones.sensors[name], distance)
        echoes[name] = distance
    places = zones._places
    for name, distance in echoes.items():
        sensor, rays = zones.sensors[name], zones._rays_of[name]
        if distance == INF:
            assert (places.outside[rays] == INF).all() and (places.radius[rays] == 0.0).all()
            continue
        angles = sensor.yaw + np.linspace(-0.5, 0.5, RAYS) * CONFIG.field_of_view
        along = np.maximum(sensor.near if distance == -INF else distance, places.inside[rays])
        x, y = sensor.x + along * np.cos(angles), sensor.y + along * np.sin(angles)
        expected = {
            'x': x,
            'y': y,
            'outside': np.maximum(np.abs(x) - 0.54, np.abs(y) - 0.31),
            'radius': np.hypot(x, y),
            'to_body': along - places.inside[rays],
        }
        for part, values in expected.items():
            np.testing.assert_allclose(getattr(places, part)[rays], values, rtol=0, atol=1e-12, err_msg=part)
        assert (places.outside[rays] >= -1e-12).all() or not sensor.stops
    assert (zones._nearest, zones._farthest) == (places.outside.min(), places.radius.max())
