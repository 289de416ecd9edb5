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

import math
from collections import deque

import numpy as np

from sara_control.zones import zone_places
from sara_control.zones.caution import Caution, CautionConfig
from sara_control.zones.lost_echoes import MOST, LostEchoes
from sara_control.zones.moving_obstacles import REMEMBERED, Mover
from sara_control.zones.range_filter import BelievedRange
from sara_control.zones.zone_config import SLACK
from sara_control.zones.zone_places import Body, Places, Stopping

RAYS = 13  # places in a cone
CRAWL = 0.04  # m/s: no faster towards somebody who comes,
CAREFUL = 4.0  # s: and no faster than that up to the stop distance for so long afterwards


def _no_places(sensors):
    """Places without an echo on any ray of any sensor, and none kept; with the names of their sensors."""
    rays = RAYS * len(sensors) + MOST
    stops = np.append(np.repeat(np.array([sensor.stops for sensor in sensors], bool), RAYS), np.ones(MOST, bool))
    x, y, radius, to_body, approach, inside = np.zeros((6, rays))
    outside = np.full(rays, math.inf)
    places = Places(x, y, outside, radius, to_body, approach, stops, np.zeros((2, rays)), inside)
    return places, [sensor.name for sensor in sensors for _ in range(RAYS)] + [''] * MOST


class Zones:
    """Ranges in, speed limits out."""

    def __init__(self, config, caution=CautionConfig()):
        zone_places.warm()  # nothing compiles on the move
        self.config = config
        self.sensors = {sensor.name: sensor for sensor in config.sensors}
        self._body = Body(0.5 * config.length, 0.5 * config.width + float(config.side_margin))
        self._believed = {name: BelievedRange(config.trigger, config.release) for name in self.sensors}
        half = 0.5 * config.field_of_view
        self._movers, self._raw_movers = (
            {name: Mover(sensor, half) for name, sensor in self.sensors.items()} for _ in range(2)
        )
        self._untold = {
            name: deque(maxlen=REMEMBERED) for name in self.sensors
        }  # filtered readings that the Mover was not told of
        places, self._names = _no_places(config.sensors)
        self._places, self._nearest, self._farthest = places, math.inf, 0.0  # m: outside the body, from base_link
        self._fastest = 0.0  # m/s, of what comes by itself
        self._rays_of = {name: slice(RAYS * k, RAYS * (k + 1)) for k, name in enumerate(self.sensors)}
        for name, rays in self._rays_of.items():
            sensor = self.sensors[name]
            angles = sensor.yaw + np.linspace(-half, half, RAYS)
            directions = np.stack([np.cos(angles), np.sin(angles)])
            places.directions[:, rays], places.inside[rays] = directions, self._inside(sensor, directions)
        self._lost = LostEchoes(half)
        self._kept = slice(RAYS * len(config.sensors), None)
        self._edges = {name: places.directions[:, rays][:, [0, RAYS // 2, -1]] for name, rays in self._rays_of.items()}
        self._now = self._careful = -math.inf
        self.caution = Caution(caution, config.sensors, half, self._body)

    def _inside(self, sensor, directions):
        """How far along each ray the body ends: an echo within it is of what stands at its edge."""
        place = np.array([[sensor.x], [sensor.y]])
        half = np.array(self._body)[:, None]
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
        places, nearest, stopping = self._places, self._nearest, self._stopping(gentle)
        fastest = abs(v) + abs(w) * self._farthest  # no place is approached faster
        if self._fastest > 0.0:
            places, nearest = self._when_standing(stopping.reaction + fastest / stopping.braking)
            waits_for = self._waits_for(places, v, w)
            if waits_for:
                return 0.0, waits_for
        to_rest = stopping.stop_distance + fastest * stopping.reaction + fastest * fastest / (2.0 * stopping.braking)
        if nearest >= to_rest:
            return 1.0, ''
        factor, at = zone_places.limit(places, float(v), float(w), self._body, stopping)
        return (factor, self._names[at]) if factor < 1.0 else (1.0, '')

    def _stopping(self, gentle):
        """How the chair is to stop now."""
        config = self.config
        creep = config.creep_speed if gentle else SLACK * config.creep_speed
        if self._now < self._careful:
            creep = min(creep, CRAWL)
        return Stopping(
            float(config.stop_distance),
            float(config.reaction_time + config.ease if gentle else config.reaction_time),
            float(config.braking if gentle else config.hard_braking),
            float(creep),
            not gentle,
        )

    def slowly(self, v, w):
        """The factor 0..1 on the command (v m/s, w rad/s) where people are about, 1 if not."""
        return self.caution.scale(v, w, self._now)

    def people(self, now):
        """Whether people are about."""
        return self.caution.about(now)

    @property
    def somebody_moves(self):
        """Whether a sensor hears somebody move, or has been sure of it lately."""
        return self._fastest > 0.0 or self._now < self._careful

    def _waits_for(self, places, v, w):
        """Name of a sensor that hears somebody come, who is at the body when the chair stands, and into whose cone a
        corner would move; ''.
        """
        half_x, half_y = self._body
        for name, rays in self._rays_of.items():
            if places.approach[rays.start] == 0.0 or places.outside[rays].min() >= self.config.stop_distance:
                continue
            edges_x, edges_y = self._edges[name]
            if (v * edges_x + abs(w) * (half_y * np.abs(edges_x) + half_x * np.abs(edges_y))).max() > CRAWL:
                return name
        return ''

    def _come(self, name, speed):
        """What a sensor hears comes by itself at speed (m/s)."""
        places, rays = self._places, self._rays_of[name]
        if places.approach[rays.start] != speed:
            places.approach[rays] = speed
            self._fastest = float(places.approach.max())

    def _place(self, sensor, distance):
        """Something is at this range (m) of a sensor, on any of its rays."""
        rays = self._rays_of[sensor.name]
        distance = float(sensor.near if distance == -math.inf else distance)
        zone_places.put(self._places, (rays.start, rays.stop), (float(sensor.x), float(sensor.y)), distance, self._body)
        self._nearest, self._farthest = zone_places.bounds(self._places)

    def _keep(self):
        """Places whose echoes were lost are where they are by now."""
        places, kept = self._places, self._kept
        places.outside[kept], places.radius[kept] = math.inf, 0.0
        for i, lost in enumerate(self._lost.places, kept.start):
            places.x[i], places.y[i], self._names[i] = lost.x, lost.y, lost.name
            places.outside[i] = zone_places.outside_of(lost.x, lost.y, self._body)
            places.radius[i] = math.hypot(lost.x, lost.y)
        self._nearest, self._farthest = zone_places.bounds(places)

    def _when_standing(self, later):
        """The places after `later` s, and the least distance outside the body: what comes by itself is nearer then, at
        the body's edge at most.
        """
        places = self._places
        nearer = np.minimum(places.approach * later, places.to_body)
        x, y = places.x - nearer * places.directions[0], places.y - nearer * places.directions[1]
        there = np.isfinite(places.outside)
        outside = np.where(there, zone_places.outside_of(x, y, self._body), math.inf)
        radius = np.where(there, np.hypot(x, y), 0.0)
        return places._replace(x=x, y=y, outside=outside, radius=radius), float(outside.min())
