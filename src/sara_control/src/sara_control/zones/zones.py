"""How fast the chair may go before what its range sensors see: distance zones from raw ranges, without a map.

An echo says how far something is, not where in the sensor's cone: every place on the arc is reckoned with. For a
command (v, w) each such place moves round the chair on a circle (a line if w is 0); where that first meets the body's
rectangle is the contact, the way to it the free distance, u = |velocity of the place relative to the chair| the speed
of approach. Allowed is what keeps u t_react + u^2 / (2 a_brake) below the free distance less the stop distance; that
holds ahead, astern and in turns alike. The command is scaled as a whole, so that it stays on its curve. A creeping
speed whose way to rest is shorter than the stop distance is
always allowed before that: so narrow doors, whose jambs stand in the cones, are passed slowly. What comes towards a
sensor by itself (movers.py), at m, is reckoned with where it will be when the chair stands, m (t_react + u / a_brake)
nearer, and nothing creeps towards it.
Two brakes are reckoned with: the gentle one sets the speed that is aimed at; where only the hard one is left, it is
asked for.
Zones of this kind: nav2_collision_monitor's README (stop, slow-down, approach; several readings to trigger).
"""

import copy
import math
from collections import deque

import numpy as np

from sara_control.zones import zone_places
from sara_control.zones.caution import Caution, CautionConfig
from sara_control.zones.lost_echoes import MOST, LostEchoes
from sara_control.zones.moving_obstacles import REMEMBERED, Mover
from sara_control.zones.range_filter import BelievedRange
from sara_control.zones.zone_config import SLACK

RAYS = 13  # places in a cone
SAMPLES = 40  # of the way
CRAWL = 0.04  # m/s: no faster towards somebody who comes,
CAREFUL = 4.0  # s: and no faster than that up to the stop distance for so long afterwards
IN = 1e-6  # m: a place that comes nearer by less does not


class _Places:
    """Where something may be, one entry for each ray of each sensor and for each place that may be kept after its echo
    was lost: x, y (m), whether it stops the chair, whose echo it is, how far outside the body (m, +Inf on a ray without
    an echo) and from base_link (m), how fast it comes by itself (m/s), the ray's direction, the way (m) along it to the
    body, and how far along it the body ends. Of all: the nearest to the body, the farthest from base_link (m), and the
    fastest by itself (m/s).
    """

    def __init__(self, sensors):
        rays = RAYS * len(sensors) + MOST
        self.x, self.y, self.radius = np.zeros(rays), np.zeros(rays), np.zeros(rays)
        self.outside = np.full(rays, math.inf)
        self.stops = np.append(
            np.repeat(np.array([sensor.stops for sensor in sensors], bool), RAYS), np.ones(MOST, bool)
        )
        self.names = np.append(np.repeat(np.array([sensor.name for sensor in sensors], str), RAYS), np.full(MOST, ''))
        self.coming, self.way = np.zeros(rays), np.zeros(rays)
        self.directions, self.way_out = np.zeros((2, rays)), np.zeros(rays)
        self.nearest, self.farthest, self.fastest = math.inf, 0.0, 0.0


class Zones:
    """Ranges in, speed limits out."""

    def __init__(self, config, caution=CautionConfig()):
        zone_places.warm()  # nothing compiles on the move
        self.config = config
        self.sensors = {sensor.name: sensor for sensor in config.sensors}
        self._half = 0.5 * config.length, 0.5 * config.width + float(config.side_margin)
        self._believed = {name: BelievedRange(config.trigger, config.release) for name in self.sensors}
        half = 0.5 * config.field_of_view
        self._movers, self._raw_movers = (
            {name: Mover(sensor, half) for name, sensor in self.sensors.items()} for _ in range(2)
        )
        self._untold = {
            name: deque(maxlen=REMEMBERED) for name in self.sensors
        }  # filtered readings that the Mover was not told of
        self._places = places = _Places(config.sensors)
        self._rays_of = {name: slice(RAYS * k, RAYS * (k + 1)) for k, name in enumerate(self.sensors)}
        for name, rays in self._rays_of.items():
            sensor = self.sensors[name]
            angles = sensor.yaw + np.linspace(-half, half, RAYS)
            directions = np.stack([np.cos(angles), np.sin(angles)])
            places.directions[:, rays], places.way_out[rays] = directions, self._way_out(sensor, directions)
        self._lost = LostEchoes(half)
        self._kept = slice(RAYS * len(config.sensors), None)
        self._edges = {name: places.directions[:, rays][:, [0, RAYS // 2, -1]] for name, rays in self._rays_of.items()}
        self._now = self._careful = -math.inf
        self.caution = Caution(caution, config.sensors, half, self._half)

    def _way_out(self, sensor, directions):
        """How far along each ray the body ends: an echo within it is of what stands at its edge."""
        place = np.array([[sensor.x], [sensor.y]])
        half = np.array(self._half)[:, None]
        with np.errstate(divide='ignore', invalid='ignore'):
            ways = (np.copysign(half, directions) - place) / directions
        ways[np.abs(directions) < 1e-12] = np.inf
        inside = np.all(np.abs(place) < half, axis=0)[0]
        return np.maximum(ways.min(axis=0), 0.0) if inside else np.zeros(directions.shape[1])

    def on_range(self, name, distance, stamp=None, v=0.0, w=0.0):
        """A reading in m after REP-117: -Inf too near, +Inf nothing there. Returns False for NaN, a negative one or an
        unknown name.

        stamp: s, of the reading, with the chair's speed v (m/s), w (rad/s) at that time; without it nothing is known of
        what moves by itself.
        """
        if name not in self.sensors or math.isnan(distance) or -math.inf < distance < 0.0:
            return False
        believed = self._believed[name]
        before = believed.range
        believed.add(distance)
        moved = stamp is not None and self._lost.carry(stamp, v, w)
        if believed.range != before:
            self._place(self.sensors[name], believed.range)
            moved |= stamp is not None and self._lost.heard(self.sensors[name], before, believed.range)
        if moved:
            self._keep()
        if stamp is not None:
            self._listen_late(name, distance, stamp, v, w)
        return True

    def _listen_late(self, name, distance, stamp, v, w):
        """A filtered reading tells of movers where the raw ones do not; until then it is kept, and told to the Mover
        when it is asked.
        """
        kept = self._untold[name]
        if self._raw_movers[name].trusted(stamp):
            kept.append((stamp, distance, v, w))
            return
        while kept:
            self._movers[name].add(*kept.popleft())
        self._listen(self._movers[name], name, distance, stamp, v, w)

    def on_raw_range(self, name, distance, stamp, v=0.0, w=0.0, told=False):
        """The same reading as it came, before any filter, which tells a reading late of who moves by themselves; where
        it scatters, the filtered one has to tell.

        told: whether the wheels are told to move; w is measured, and tells of a turn that has just begun too late.
        """
        if name not in self.sensors or math.isnan(distance) or -math.inf < distance < 0.0:
            return False
        raw = self._raw_movers[name]
        trusted = raw.trusted(stamp)
        if trusted:
            self._listen(raw, name, distance, stamp, v, w)
        else:
            raw.add(stamp, distance, v, w, self.caution.about(stamp))
        self.caution.add(name, distance, stamp, v, w, raw.sigma if trusted else math.inf, told)
        if trusted and raw.sure(stamp):
            self.caution.mover(name, distance, stamp)
        if raw.coarse:
            self.caution.doubted(name, stamp)
        return True

    def _listen(self, mover, name, distance, stamp, v, w):
        """Whether somebody comes by themselves; they are believed at once."""
        speed = mover.add(stamp, distance, v, w, self.caution.about(stamp))
        self._come(name, speed)
        self._now = stamp
        if speed > 0.0:
            if mover.sure(stamp):
                self._careful = stamp + CAREFUL
            believed = self._believed[name]
            if believed.range is not None and distance < believed.range:
                believed.at_once(distance)
                self._place(self.sensors[name], distance)

    def range(self, name):
        """The range (m) that is believed, or None before the first reading."""
        return self._believed[name].range

    def scale(self, v, w, gentle=True):
        """(factor 0..1 on the command (v m/s, w rad/s), name of the sensor that asks for it or '').

        gentle: by the gentle brake and its `ease`; else by the hard one, and creeping always passes: it comes to rest
        gently in time.
        """
        if v == 0.0 and w == 0.0:
            return 1.0, ''
        places = self._places
        config = self.config
        reaction, braking, creep = config.reaction_time, config.hard_braking, SLACK * config.creep_speed
        if gentle:
            reaction, braking, creep = reaction + config.ease, config.braking, config.creep_speed
        # No place is nearer than `nearest` nor approaches faster than this: mostly that says enough.
        fastest = abs(v) + abs(w) * places.farthest
        farthest_way = config.stop_distance + fastest * reaction + fastest * fastest / (2.0 * braking)
        if self._now < self._careful:
            creep = min(creep, CRAWL)
        if places.fastest > 0.0:
            places = self._when_standing(places, reaction + fastest / braking)
            waits_for = self._waits_for(places, v, w)
            if waits_for:
                return 0.0, waits_for
        if places.nearest >= farthest_way or not self._matters(places, v, w, reaction, braking):
            return 1.0, ''
        swept = self._swept(places, v, w)
        if not swept.any():
            return 1.0, ''
        x, y = places.x[swept], places.y[swept]
        u = np.hypot(v - w * y, w * x)
        matters = config.stop_distance + u * reaction + u * u / (2.0 * braking)
        near = (places.outside[swept] < matters) & (u > 1e-9)
        if not near.any():
            return 1.0, ''
        x, y, u, matters = x[near], y[near], u[near], matters[near]
        stops, names, coming = places.stops[swept][near], places.names[swept][near], places.coming[swept][near]
        room = self._free(x, y, v, w, u, matters) - config.stop_distance
        allowed = braking * (np.sqrt(reaction**2 + 2.0 * np.maximum(room, 0.0) / braking) - reaction)
        creeps = ((room > 0.0) | ~stops | (not gentle)) & (coming == 0.0)
        allowed = np.where(creeps, np.maximum(allowed, creep), np.where(room > 0.0, allowed, 0.0))
        factors = allowed / u
        worst = int(np.argmin(factors))
        return (1.0, '') if factors[worst] >= 1.0 else (float(factors[worst]), str(names[worst]))

    def slowly(self, v, w):
        """The factor 0..1 on the command (v m/s, w rad/s) where people are about, 1 if not."""
        return self.caution.scale(v, w, self._now)

    def people(self, now):
        """Whether people are about."""
        return self.caution.about(now)

    @property
    def somebody_moves(self):
        """Whether a sensor hears somebody move, or has been sure of it lately."""
        return self._places.fastest > 0.0 or self._now < self._careful

    def _waits_for(self, places, v, w):
        """Name of a sensor that hears somebody come, who is at the body when the chair stands, and into whose cone a
        corner would move; ''.
        """
        half_x, half_y = self._half
        for name, rays in self._rays_of.items():
            if places.coming[rays.start] == 0.0 or places.outside[rays].min() >= self.config.stop_distance:
                continue
            edges_x, edges_y = self._edges[name]
            if (v * edges_x + abs(w) * (half_y * np.abs(edges_x) + half_x * np.abs(edges_y))).max() > CRAWL:
                return name
        return ''

    def _come(self, name, speed):
        """What a sensor hears comes by itself at speed (m/s)."""
        places, rays = self._places, self._rays_of[name]
        if places.coming[rays.start] != speed:
            places.coming[rays] = speed
            places.fastest = float(places.coming.max())

    def _place(self, sensor, distance):
        """Something is at this range (m) of a sensor, on any of its rays."""
        places, rays = self._places, self._rays_of[sensor.name]
        places.nearest, places.farthest = zone_places.put(
            places.x,
            places.y,
            places.outside,
            places.radius,
            places.way,
            places.directions,
            places.way_out,
            rays.start,
            rays.stop,
            float(sensor.x),
            float(sensor.y),
            float(sensor.near if distance == -math.inf else distance),
            *self._half,
        )

    def _keep(self):
        """Places whose echoes were lost are where they are by now."""
        places, kept = self._places, self._kept
        places.outside[kept], places.radius[kept] = math.inf, 0.0
        for i, lost in enumerate(self._lost.places, kept.start):
            places.x[i], places.y[i], places.names[i] = lost.x, lost.y, lost.name
            places.outside[i], places.radius[i] = self._outside(lost.x, lost.y), math.hypot(lost.x, lost.y)
        places.nearest, places.farthest = float(places.outside.min()), float(places.radius.max())

    def _when_standing(self, places, later):
        """The places after `later` s: what comes by itself is nearer then, at the body's edge at most."""
        then = copy.copy(places)
        nearer = np.minimum(places.coming * later, places.way)
        then.x, then.y = places.x - nearer * places.directions[0], places.y - nearer * places.directions[1]
        there = np.isfinite(places.outside)
        then.outside = np.where(there, self._outside(then.x, then.y), math.inf)
        then.radius = np.where(there, np.hypot(then.x, then.y), 0.0)
        then.nearest = float(then.outside.min())
        return then

    def _outside(self, x, y):
        """How far outside the body (m), by the axis on which it is farther; negative within."""
        return np.maximum(np.abs(x) - self._half[0], np.abs(y) - self._half[1])

    def _matters(self, places, v, w, reaction, braking):
        """Whether there is any place that needs a closer look, at the command (v m/s, w rad/s) with so many s until it
        brakes, at so many m/s2.
        """
        half_x, half_y = self._half
        return zone_places.matters(
            places.x,
            places.y,
            places.outside,
            places.radius,
            float(v),
            float(w),
            half_y,
            half_y**2,
            half_x**2 + half_y**2,
            float(self.config.stop_distance),
            float(reaction),
            float(braking),
        )

    def _swept(self, places, v, w):
        """Which places the body meets sooner or later on its curve, ahead or astern; the others need no closer look.

        On the curve every place keeps its distance from the centre of rotation (0, c), c = v / w; the body is met by
        distances between those of its nearest and its farthest point. Squared, less c^2 and times |w|, that holds for a
        straight line too.
        """
        half_x, half_y = self._half
        reach = abs(w) * places.radius**2 - 2.0 * v * math.copysign(1.0, w) * places.y
        meets = reach <= abs(w) * (half_x**2 + half_y**2) + 2.0 * half_y * abs(v)
        if abs(v) > half_y * abs(w):  # else the centre is within the body's width, and its nearest point is no limit
            meets &= reach >= abs(w) * half_y**2 - 2.0 * half_y * abs(v)
        return meets

    def _free(self, x, y, v, w, u, way):
        """The way (m) of each place until it meets the body, +Inf where it does not within `way`."""
        ways = way[:, None] * (np.arange(1, SAMPLES + 1) / SAMPLES)
        times = ways / u[:, None]
        half_turn = 0.5 * w * times
        chord = v * times * np.sinc(half_turn / math.pi)
        dx, dy = x[:, None] - chord * np.cos(half_turn), y[:, None] - chord * np.sin(half_turn)
        c, s = np.cos(2.0 * half_turn), np.sin(2.0 * half_turn)
        outside = self._outside(c * dx + s * dy, c * dy - s * dx)
        before = np.concatenate([self._outside(x, y)[:, None], outside[:, :-1]], axis=1)
        met = (outside <= 0.0) & (outside < before - IN)
        first = met.argmax(axis=1)
        step = way / SAMPLES
        return np.where(met.any(axis=1), first * step, math.inf)
