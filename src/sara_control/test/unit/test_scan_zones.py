"""A laser scanner in the zones: what it may take from the sonars' echoes, and that its faults never make the chair
faster than it is without one.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_common.planar import advanced, compose
from sara_common.platforms import load, parameters
from sara_common.scans import Sweep
from sara_control.zones.caution import CautionConfig
from sara_control.zones.scan_config import ScanConfig
from sara_control.zones.zone_config import ZoneConfig
from sara_control.zones.zones import Zones

PARAMS = parameters('sara_control', 'safety.yaml', load('sara'))
ZONES, SCAN = ZoneConfig.from_params(PARAMS['zones']), ScanConfig.from_params({**PARAMS['scan'], 'enabled': True})
ANGLES = np.radians(np.arange(-135.0, 135.25, 0.5))
TICK, RAY_S = 0.05, 0.1 / 720
HALF_ROOM = 4.0
CONE = np.radians(np.linspace(-30.0, 30.0, 41))


def cast(places, discs):
    """(n,) m from places (n, 3: x, y, direction) to the room's walls or a disc (x, y, radius)."""
    x, y, angle = places.T
    dx, dy = np.cos(angle), np.sin(angle)
    with np.errstate(divide='ignore', invalid='ignore'):
        found = np.minimum(
            (np.copysign(HALF_ROOM, dx) - x) / np.where(dx == 0.0, 1e-12, dx),
            (np.copysign(HALF_ROOM, dy) - y) / np.where(dy == 0.0, 1e-12, dy),
        )
    for cx, cy, radius in discs:
        px, py = x - cx, y - cy
        along, inside = -(px * dx + py * dy), px * px + py * py - radius * radius
        square = along * along - inside
        reach = np.where((square >= 0.0) & (along > 0.0), along - np.sqrt(np.maximum(square, 0.0)), math.inf)
        found = np.minimum(found, np.where(inside <= 0.0, 0.0, reach))
    return found


class Ride:
    """A chair that moves exactly as it is told among discs in a room, with sonars at 5 Hz and a scanner at 10 Hz.

    `discs`: a function of the time (s) that gives [(x, y, radius)]. `scanner`: False: none is there. `spoil`: what
    becomes of a Sweep on its way; None: it is lost.
    """

    def __init__(self, discs, pose=(0.0, 0.0, 0.0), scanner=True, seed=0):
        self.zones = Zones(ZONES, CautionConfig(), SCAN if scanner else ScanConfig())
        self.discs, self.pose, self.t, self.way = discs, pose, 10.0, 0.0
        self.random, self.spoil, self.dropped = np.random.default_rng(seed), lambda sweep: sweep, []
        self.tick, self.past = 0, []
        self.nearest = {}  # of each sonar: m, and the place in the map of what it heard

    def run(self, v, w, seconds):
        for _ in range(round(seconds / TICK)):
            self.step(v, w)
        return self

    def step(self, v, w):
        self.t, self.tick, self.pose = self.t + TICK, self.tick + 1, advanced(*self.pose, v, w, TICK)
        self.way += v * TICK
        self.past = [*self.past[-20:], (self.t, self.pose)]
        scan = self.zones.scan
        if scan is not None and self.tick % 2 == 0:
            scan.reckoning.on_way(self.t, self.way)
        if scan is not None:
            scan.reckoning.on_turn(self.t, w)
        if self.tick % 4 == 0:
            self.hear(v, w)
        if self.tick % 2 == 0 and scan is not None and self.tick > 4:
            sweep = self.spoil(self.sweep())
            if sweep is not None:
                self.dropped.append(scan.on_scan(sweep, self.t))
        self.zones.see(self.t)

    def hear(self, v, w):
        for name, sensor in self.zones.sensors.items():
            x, y, yaw = compose(self.pose, (sensor.x, sensor.y, sensor.yaw))
            places = np.column_stack([np.full(len(CONE), x), np.full(len(CONE), y), yaw + CONE])
            far = cast(places, self.discs(self.t))
            k = int(far.argmin())
            self.nearest[name] = far[k], (x + far[k] * math.cos(places[k, 2]), y + far[k] * math.sin(places[k, 2]))
            self.zones.on_range(name, -math.inf if far[k] < 0.16 else float(far[k]), self.t, v, w)

    def sweep(self):
        """The sweep that ended now, each ray cast from where the chair was at its time."""
        begin = self.t - RAY_S * (len(ANGLES) - 1)
        times = begin + RAY_S * np.arange(len(ANGLES))
        at, poses = [t for t, _ in self.past], np.array([pose for _, pose in self.past])
        x, y = np.interp(times, at, poses[:, 0]), np.interp(times, at, poses[:, 1])
        yaw = np.interp(times, at, np.unwrap(poses[:, 2]))
        c, s = np.cos(yaw), np.sin(yaw)
        ranges = cast(np.column_stack([x + SCAN.x * c, y + SCAN.x * s, yaw + ANGLES]), self.discs(self.t))
        ranges = ranges + self.random.normal(0.0, 0.01, len(ranges))
        ranges[np.abs(ANGLES) > SCAN.view] = -math.inf
        return Sweep(begin, ANGLES[0], ANGLES[-1], math.radians(0.5), RAY_S, 0.05, 10.0, ranges)

    def places(self):
        """(n, 2) in the base frame: all that the gate goes by."""
        zones = self.zones
        outside = zones._places.outside if zones._carved is None else zones._carved[0]
        kept = np.isfinite(outside)
        echoes = np.column_stack([zones._places.x[kept], zones._places.y[kept]])
        if zones.scan is None:
            return echoes
        return np.vstack([echoes, np.column_stack([zones.scan.hits.x, zones.scan.hits.y])])

    def in_base(self, place):
        dx, dy = place[0] - self.pose[0], place[1] - self.pose[1]
        c, s = math.cos(self.pose[2]), math.sin(self.pose[2])
        return c * dx + s * dy, c * dy - s * dx


def outside(x, y):
    """m outside the body."""
    return np.maximum(np.abs(x) - 0.54, np.abs(y) - 0.31)


def unguarded(ride):
    """[(sensor, place)] of what a cone holds and for which the gate has no place near it that is as near to the body,
    give or take 0.10 m.
    """
    places, found = ride.places(), []
    for name, (far, place) in ride.nearest.items():
        held = ride.zones.range(name)
        if held is None or held != pytest.approx(far, abs=0.02) or far > 1.8:  # not held for two readings, or far off
            continue
        x, y = ride.in_base(place)
        near = np.hypot(places[:, 0] - x, places[:, 1] - y) <= 0.20 + 0.1 * far  # rays of a cone are 0.1 rad apart
        if not (near & (outside(places[:, 0], places[:, 1]) <= outside(x, y) + 0.10)).any():
            found.append((name, place))
    return found


discs_of = st.lists(
    st.tuples(st.floats(-2.5, 2.5), st.floats(-2.5, 2.5), st.floats(0.05, 0.4)).filter(
        lambda disc: math.hypot(disc[0], disc[1]) > 0.75 + disc[2]
    ),
    max_size=5,
)
moves = st.lists(st.tuples(st.floats(-0.2, 0.5), st.floats(-0.6, 0.6), st.floats(0.2, 1.5)), min_size=1, max_size=4)


def clear(pose, discs):
    """Whether the body at a pose touches nothing."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    corners = [(pose[0] + c * x - s * y, pose[1] + s * x + c * y) for x in (-0.54, 0.54) for y in (-0.29, 0.29)]
    if any(max(abs(x), abs(y)) >= HALF_ROOM for x, y in corners):
        return False
    for x, y, radius in discs:
        dx, dy = x - pose[0], y - pose[1]
        along, across = c * dx + s * dy, c * dy - s * dx
        if math.hypot(max(abs(along) - 0.54, 0.0), max(abs(across) - 0.29, 0.0)) <= radius:
            return False
    return True


@settings(max_examples=6)
@given(discs_of, moves, st.integers(0, 99))
def test_what_a_cone_holds_keeps_a_place_wherever_the_chair_came_from(discs, way, seed):
    ride = Ride(lambda _: discs, seed=seed)
    ride.run(0.0, 0.0, 0.6)
    for v, w, seconds in way:
        for _ in range(round(seconds / 0.1)):
            if clear(advanced(*ride.pose, v, w, 0.1), discs):
                ride.run(v, w, 0.1)
    for _ in range(6):
        ride.run(0.0, 0.0, 0.2)
        assert unguarded(ride) == []


@settings(max_examples=6)
@given(discs_of, st.floats(-math.pi, math.pi), st.floats(0.6, 1.6), st.floats(0.3, 1.0), st.floats(0.0, 1.0))
def test_who_walks_about_a_standing_chair_keeps_a_place(discs, bearing, distance, speed, begin):
    """Somebody of 0.25 m radius passes it on a straight line, in whatever direction, behind its back too."""
    c, s = math.cos(bearing), math.sin(bearing)

    def walker(t):
        along = speed * (t - 10.0) - 2.0 - begin
        x, y = c * (distance + 0.25) - s * along, s * (distance + 0.25) + c * along
        return [*discs, (x, y, 0.25)] if max(abs(x), abs(y)) < HALF_ROOM else discs

    ride = Ride(walker)
    for _ in range(round((4.0 / speed) / 0.2)):
        ride.run(0.0, 0.0, 0.2)
        if clear(ride.pose, walker(ride.t)):
            assert unguarded(ride) == []


def allowed(ride):
    """The factors on commands ahead, astern and in turns."""
    return [ride.zones.scale(v, w)[0] for v, w in ((0.8, 0.0), (0.4, 0.3), (-0.2, 0.0), (0.0, 0.6), (0.0, -0.6))]


def beside_a_jamb(scanner=True):
    """Something stands beside the way: in the cone of a front sonar, and no obstacle to the scanner."""
    return Ride(lambda _: [(1.3, -0.55, 0.1)], scanner=scanner)


def test_what_stands_beside_the_way_no_longer_holds_the_chair():
    with_scanner, without = beside_a_jamb().run(0.0, 0.0, 1.5), beside_a_jamb(False).run(0.0, 0.0, 1.5)
    assert without.zones.scale(0.8, 0.0)[0] < 0.5
    assert with_scanner.zones.scale(0.8, 0.0) == (1.0, '')


def test_what_stands_in_the_way_still_does_and_its_side_is_told():
    ride = Ride(lambda _: [(1.2, 0.0, 0.1)]).run(0.0, 0.0, 1.5)
    factor, name = ride.zones.scale(0.8, 0.0)
    assert 0.0 < factor < 0.9 and ride.zones.side(name) == 'front'
    at_once = Ride(lambda _: [(0.64, 0.0, 0.05)]).run(0.0, 0.0, 1.5)
    assert at_once.zones.scale(0.8, 0.0)[0] == 0.0


def test_before_who_comes_the_chair_is_slower_than_before_what_stands():
    """1.2 m before the chair: a post, and somebody who has walked there, towards it."""
    stands = Ride(lambda _: [(1.84, 0.0, 0.1)]).run(0.0, 0.0, 2.0)
    walks = Ride(lambda t: [(3.24 - 0.7 * max(t - 10.0, 0.0), 0.0, 0.1)]).run(0.0, 0.0, 2.0)
    gentle, reaction = stands.zones._stopping(True), SCAN.reaction_time + ZONES.ease
    post, person = (0.8 * ride.zones.scan.limit(0.8, 0.0, gentle, ZONES.ease)[0] for ride in (stands, walks))
    assert len(walks.zones.scan.movers.x) > 3 and len(stands.zones.scan.movers.x) == 0
    assert post > 0.7 and 0.0 < person < 0.3
    goes = person * reaction + person**2 / (2.0 * gentle.braking)
    comes = SCAN.approach * (reaction + person / gentle.braking)
    assert goes + comes == pytest.approx(1.2 - SCAN.stop_distance, abs=0.1)


@pytest.mark.parametrize('aside, slowly', [(0.2, True), (0.5, False)])
def test_who_has_walked_to_a_place_beside_the_way_is_passed_slowly_and_what_stands_there_is_not(aside, slowly):
    y = 0.5 * ZONES.width + ZONES.side_margin + aside + 0.1
    stands = Ride(lambda _: [(1.0, y, 0.1)]).run(0.0, 0.0, 2.0)
    walks = Ride(lambda t: [(1.0, y + 0.7 * max(12.0 - t, 0.0), 0.1)]).run(0.0, 0.0, 2.0)
    gentle = stands.zones._stopping(True)
    post, person = (0.8 * ride.zones.scan.limit(0.8, 0.0, gentle, ZONES.ease)[0] for ride in (stands, walks))
    assert len(walks.zones.scan.movers.x) > 3 and post >= 0.8
    assert person == pytest.approx(SCAN.passing_speed) if slowly else person >= 0.8
    assert walks.zones.scan.limit(-0.2, 0.0, gentle, ZONES.ease)[0] >= 1.0, 'away from them'


def test_a_jamb_that_the_front_has_passed_is_known_after_a_wait_in_the_door():
    ride = Ride(lambda _: [(1.2, 0.45, 0.05)]).run(0.5, 0.0, 2.6).run(0.0, 0.0, 8.0)
    gentle = ride.zones._stopping(True)
    assert ride.in_base((1.2, 0.45))[0] < 0.0, 'it is beside the rear'
    assert ride.zones.scan.limit(0.0, -0.5, gentle, ZONES.ease) < (0.5, 'left')
    assert ride.zones.scan.limit(0.3, 0.0, gentle, ZONES.ease)[0] >= 1.0


def test_an_echo_that_no_hit_explains_keeps_all_its_places():
    """A table's edge: the sonar hears it at 1 m, and the scanner looks below it."""
    ride = Ride(lambda _: [])
    table = ride.zones.sensors['SDI']
    hear = ride.hear

    def heard(v, w):
        hear(v, w)
        ride.zones.on_range(table.name, 1.0, ride.t, v, w)

    ride.hear = heard
    ride.zones.on_range(table.name, 1.0)
    for _ in range(30):
        ride.step(0.0, 0.0)
        ride.zones._filters[table.name].accept(1.0)
        ride.zones._place(table, 1.0)
    ride.zones.see(ride.t)
    assert ride.zones.scan.live and np.isfinite(ride.zones._carved[0][ride.zones._rays_of['SDI']]).all()


def test_places_that_the_scanner_cannot_see_stay_though_a_hit_explains_the_echo():
    """What stands at the edge of its view is heard by a sonar at the side, half of whose arc lies behind that edge."""
    ride = Ride(lambda _: [(0.45, 0.95, 0.1)]).run(0.0, 0.0, 1.5)
    rays = ride.zones._rays_of['SLID']
    x, y = ride.zones._places.x[rays], ride.zones._places.y[rays]
    carved = np.isinf(ride.zones._carved[0][rays])
    unseen = np.arctan2(y, x - SCAN.x) > SCAN.view + math.radians(4.0)
    assert carved.any() and unseen.any() and not (carved & unseen).any()


def changed(**fields):
    return lambda sweep: sweep._replace(**{name: change(getattr(sweep, name)) for name, change in fields.items()})


def frozen():
    kept = []

    def spoil(sweep):
        kept.append(sweep.ranges)
        return sweep._replace(ranges=kept[0])

    return spoil


FAULTS = {
    'silent': (lambda sweep: None, ''),
    'frozen': (frozen(), 'the same'),
    'late': (changed(stamp=lambda t: t - 0.5), 'late'),
    'of the future': (changed(stamp=lambda t: t + 1.0), 'late'),
    'stamps back': (changed(stamp=lambda t: 20.0 - t), 'scan'),
    'stamps NaN': (changed(stamp=lambda t: math.nan), 'none'),
    'all NaN': (changed(ranges=lambda r: np.full(len(r), math.nan)), 'without a reading'),
    'all too near': (changed(ranges=lambda r: np.full(len(r), -math.inf)), 'without a reading'),
    'empty': (changed(ranges=lambda r: r[:0]), 'without rays'),
    'wrong size': (changed(ranges=lambda r: r[:-5]), 'wrong size'),
    'no increment': (changed(angle_increment=lambda _: 0.0), 'without sense'),
    'limits': (changed(range_max=lambda _: math.inf), 'none'),
}


@pytest.mark.parametrize('name', FAULTS)
def test_a_fault_of_the_scanner_leaves_the_sonars_limits(name):
    spoil, word = FAULTS[name]
    ride, without = beside_a_jamb(), beside_a_jamb(False)
    ride.run(0.0, 0.0, 1.5)
    without.run(0.0, 0.0, 1.5)
    assert allowed(ride) != allowed(without)
    ride.spoil, ride.dropped = spoil, []
    ride.run(0.0, 0.0, SCAN.timeout + 0.05 if name == 'silent' else 0.2)
    assert not ride.zones.scan.live and allowed(ride) == allowed(without)
    assert name == 'silent' or word in ride.dropped[-1]
    ride.spoil = lambda sweep: sweep
    ride.run(0.0, 0.0, 0.4)
    assert ride.zones.scan.live


@settings(max_examples=6)
@given(
    discs_of,
    st.lists(st.one_of(st.floats(allow_nan=True), st.just(math.inf)), max_size=600),
    st.tuples(*(st.floats(allow_nan=True),) * 6),
)
def test_nonsense_never_makes_it_faster(discs, ranges, numbers):
    ride, without = Ride(lambda _: discs), Ride(lambda _: discs, scanner=False)
    ride.spoil = lambda _: Sweep(*numbers[:5], 0.05, numbers[5], np.array(ranges))
    ride.run(0.0, 0.0, 0.8)
    without.run(0.0, 0.0, 0.8)
    assert all(a <= b for a, b in zip(allowed(ride), allowed(without)))


def test_a_clock_that_comes_after_the_scan_is_no_fault():
    ride = beside_a_jamb().run(0.0, 0.0, 1.0)
    ride.dropped, ride.spoil = [], changed(stamp=lambda t: t + 0.03)
    ride.run(0.0, 0.0, 0.6)
    assert set(ride.dropped) == {''} and ride.zones.scan.live


def test_without_wheels_nothing_is_known_of_the_way():
    ride = beside_a_jamb().run(0.0, 0.0, 1.0)
    ride.zones.scan.reckoning.on_way = lambda *_: None
    ride.run(0.0, 0.0, 1.0)
    assert not ride.zones.scan.live and ride.dropped[-1] == 'scan on an unknown way'


def test_who_is_heard_to_walk_is_not_carved_away():
    ride = beside_a_jamb().run(0.0, 0.0, 1.0)
    ride.zones._set_approach('SDD', 0.8)
    ride.zones.see(ride.t)
    assert ride.zones._carved is None


@pytest.mark.parametrize(
    'change',
    [
        {'memory': 0},
        {'still_memory': 0},
        {'approach': -1},
        {'passing_distance': -0.1},
        {'passing_speed': 0},
        {'enabled': 1},
        {'view_deg': 'wide'},
        {'x': math.nan},
        {'colour': 1},
        {'yaw': 0.0},
    ],
)
def test_what_is_wrong_is_named(change):
    with pytest.raises(ConfigError) as error:
        ScanConfig.from_params({**PARAMS['scan'], **change})
    assert next(iter(change)).removesuffix('_deg') in str(error.value)


def test_the_reaction_time_is_what_it_is_derived_from():
    ray, sweep, cycle, wheels = 0.1, 540 * RAY_S, 0.02, 0.15
    assert SCAN.reaction_time == pytest.approx(ray + sweep + cycle + wheels, abs=0.006)
    assert SCAN.reaction_time >= ray + sweep + cycle + wheels - 1e-9


def test_a_scanner_may_count_its_angles_from_0_to_2_pi():
    """Its hits on the right are those of one that counts from -pi to pi."""
    found = []
    for turned in (0.0, math.tau):
        ride = Ride(lambda _: [(1.2, -0.2, 0.1)])

        def counted(sweep, turned=turned):
            right = (ANGLES < 0.0) & (ANGLES > -2.0)
            return sweep._replace(
                angle_min=float(ANGLES[right][0] + turned),
                angle_max=float(ANGLES[right][-1] + turned),
                ranges=np.asarray(sweep.ranges)[right],
            )

        ride.spoil = counted
        ride.run(0.0, 0.0, 2.0)
        assert not any(ride.dropped) and len(ride.zones.scan.hits.x) > 1
        found.append(ride.zones.scan.hits.x.tolist())
    assert found[0] == pytest.approx(found[1])
