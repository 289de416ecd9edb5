"""Distance zones: how fast the chair may drive, given raw ranges and no map.

An echo tells how far an obstacle is, not where in the sensor's cone, so every place on the arc counts. For a command
(v, w) each place moves around the chair on a circle (a line if w is 0). Where the circle first meets the body's
rectangle is the contact; the path to it is the free distance, and u = |velocity of the place relative to the chair| the
speed of approach. A speed is allowed if u t_react + u^2 / (2 a_brake) is below the free distance less the stop
distance. That holds ahead, astern and in turns alike. The command is scaled as a whole, so it keeps its curve.

A creep speed whose stopping distance is shorter than the stop distance is always allowed before the stop distance:
narrow doors, whose jambs stand in the cones, are passed slowly. An obstacle that approaches a sensor by itself
(approach_detector.py) at m counts as m (t_react + u / a_brake) nearer, and nothing creeps towards it.

There are two brakes: the gentle one sets the speed that is aimed at; the hard one is used where only it is in time.
Zones of this kind: nav2_collision_monitor's README (stop, slow-down, approach; several readings to trigger).
"""

import math
from collections import deque

import numpy as np

from sara_control.zones import zone_places
from sara_control.zones.approach_detector import REMEMBERED, ApproachDetector
from sara_control.zones.caution import Caution, CautionConfig, Motion
from sara_control.zones.lost_echoes import MOST, LostEchoes
from sara_control.zones.range_filter import RangeFilter
from sara_control.zones.scan_config import ScanConfig
from sara_control.zones.scan_zones import Echo, ScanZones
from sara_control.zones.walls_beside import WallsBeside
from sara_control.zones.zone_config import CRAWL, SLACK, ZoneConfig
from sara_control.zones.zone_places import Body, Stopping

RAYS = 13  # places in a cone
CAREFUL = 4.0  # s after a pedestrian approached: no faster than CRAWL up to the stop distance


class Zones:
    """Ranges in, speed limits out. config: ZoneConfig. caution: CautionConfig. scan: ScanConfig. `sensors`: {name:
    RangeSensor}. `scan`: ScanZones, None without a scanner.
    """

    def __init__(
        self, config: ZoneConfig, caution: CautionConfig = CautionConfig(), scan: ScanConfig = ScanConfig()
    ) -> None:
        zone_places.warm()  # nothing compiles on the move
        self.config = config
        self.sensors = {sensor.name: sensor for sensor in config.sensors}
        self._body = Body(0.5 * config.length, 0.5 * config.width + float(config.side_margin))
        self._turning = self._body._replace(half_width=self._body.half_width + float(config.turning_margin))
        self._filters = {name: RangeFilter(config.trigger, config.release) for name in self.sensors}
        half = 0.5 * config.field_of_view
        self._detectors, self._raw_detectors = (
            {name: ApproachDetector(sensor, half) for name, sensor in self.sensors.items()} for _ in range(2)
        )
        # Filtered readings that their detector has not seen yet.
        self._kept_readings = {name: deque(maxlen=REMEMBERED) for name in self.sensors}
        self._lost, self._beside = LostEchoes(half), WallsBeside(config.sensors, half, self._body)
        places, self._names = zone_places.no_places(config.sensors, RAYS, MOST + self._beside.most)
        self._places, self._nearest, self._farthest = places, math.inf, 0.0  # m: outside the body, from base_link
        self._fastest = 0.0  # m/s, of what comes by itself
        self._rays_of = {name: slice(RAYS * k, RAYS * (k + 1)) for k, name in enumerate(self.sensors)}
        for name, rays in self._rays_of.items():
            sensor = self.sensors[name]
            angles = sensor.yaw + np.linspace(-half, half, RAYS)
            directions = np.stack([np.cos(angles), np.sin(angles)])
            places.directions[:, rays], places.inside[rays] = directions, self._inside(sensor, directions)
        self._kept = slice(RAYS * len(config.sensors), None)
        self._walls = np.zeros(len(places.x))  # the side of those that are of a wall beside
        self._edges = {name: places.directions[:, rays][:, [0, RAYS // 2, -1]] for name, rays in self._rays_of.items()}
        self._now = self._careful = -math.inf
        self.caution = Caution(caution, config.sensors, half, self._body)
        self.scan = ScanZones(scan, half, self._body) if scan.enabled else None
        self._carved = None  # `outside` of the places, and the least of it, while the scanner explains echoes

    def _inside(self, sensor, directions):
        """Length of each ray within the body: a nearer echo is of an obstacle at the body's edge."""
        place = np.array([[sensor.x], [sensor.y]])
        half = np.array(self._body)[:, None]
        with np.errstate(divide='ignore', invalid='ignore'):
            ways = (np.copysign(half, directions) - place) / directions
        ways[np.abs(directions) < 1e-12] = np.inf
        inside = np.all(np.abs(place) < half, axis=0)[0]
        return np.maximum(ways.min(axis=0), 0.0) if inside else np.zeros(directions.shape[1])

    def on_range(self, name: str, distance: float, stamp: float | None = None, v: float = 0.0, w: float = 0.0) -> bool:
        """Takes a filtered reading (m, REP-117: -Inf too near, +Inf nothing there). Returns False for NaN, a negative
        reading or an unknown name.

        stamp: s, of the reading, with the chair's speed v (m/s), w (rad/s) at that time. Without it the reading is not
        searched for an approach.
        """
        if name not in self.sensors or math.isnan(distance) or -math.inf < distance < 0.0:
            return False
        filtered = self._filters[name]
        before = filtered.range
        filtered.add(distance)
        moved = stamp is not None and self._lost.carry(stamp, v, w)
        if filtered.range != before:
            self._place(self.sensors[name], filtered.range)
            moved |= stamp is not None and self._lost.on_range_change(self.sensors[name], before, filtered.range)
        elif stamp is not None:
            moved |= self._lost.on_same_range(self.sensors[name], filtered.range)
        if moved:
            self._keep()
        if stamp is not None:
            self._detect_late(name, distance, stamp, v, w)
        return True

    def _detect_late(self, name, distance, stamp, v, w):
        """The filtered readings are searched for an approach where the raw ones are not trusted; until then they are
        kept, for the detector to catch up.
        """
        kept, detector = self._kept_readings[name], self._detectors[name]
        if self._raw_detectors[name].trusted(stamp):
            kept.append((stamp, distance, v, w))
            return
        while kept:
            detector.add(*kept.popleft())
        self._detect(detector, name, distance, stamp, v, w)

    def on_raw_range(
        self, name: str, distance: float, stamp: float, v: float = 0.0, w: float = 0.0, commanded: bool = False
    ) -> bool:
        """The same reading before any filter, which shows an approach one reading late. Where the raw reading is too
        noisy, the filtered one is searched.

        commanded: whether the wheels are told to turn; w is measured, and shows a turn that has just begun too late.
        """
        if name not in self.sensors or math.isnan(distance) or -math.inf < distance < 0.0:
            return False
        raw = self._raw_detectors[name]
        trusted = raw.trusted(stamp)
        if trusted:
            self._detect(raw, name, distance, stamp, v, w)
        else:
            raw.add(stamp, distance, v, w, self.caution.pedestrians_nearby(stamp))
        self.caution.on_range(name, distance, stamp, Motion(v, w, commanded), raw.sigma if trusted else math.inf)
        if self._beside.on_range(name, distance, stamp, v, w):
            self._keep()
        if trusted and raw.confirmed(stamp):
            self.caution.on_approach(name, distance, stamp)
        if raw.noisy:
            self.caution.on_noise(name, stamp)
        return True

    def _detect(self, detector, name, distance, stamp, v, w):
        """Searches a reading for an approach; that of a pedestrian is accepted at once."""
        speed = detector.add(stamp, distance, v, w, self.caution.pedestrians_nearby(stamp))
        self._set_approach(name, speed)
        self._now = stamp
        self._careful = min(self._careful, stamp + CAREFUL)  # the clock may have been set back
        if speed > 0.0:
            if detector.confirmed(stamp):
                self._careful = stamp + CAREFUL
            filtered = self._filters[name]
            if filtered.range is not None and distance < filtered.range:
                filtered.accept(distance)
                self._place(self.sensors[name], distance)

    def see(self, t: float) -> None:
        """With a scanner: work in what it saw, until t (s). To be called before the commands of each step."""
        self._carved = None
        pose = None if self.scan is None else self.scan.see(t)
        if pose is None or self.pedestrian_moving:  # who moves is where the sonars hear it
            return
        echoes = {
            name: Echo(sensor, self._filters[name].range)
            for name, sensor in self.sensors.items()
            if self._filters[name].range is not None
        }
        outside = self.scan.carved(self._places, self._rays_of, echoes, pose)
        self._carved = outside, float(outside.min())

    def range(self, name: str) -> float | None:
        """The accepted range (m), or None before the first reading."""
        return self._filters[name].range

    def scale(self, v: float, w: float, gentle: bool = True) -> tuple[float, str]:
        """(factor 0..1 on the command (v m/s, w rad/s), name of the sensor that asks for it or '').

        gentle: by the gentle brake and its `ease`; else by the hard one, and creeping always passes, because the gentle
        brake is in time for it.
        """
        if v == 0.0 and w == 0.0:
            return 1.0, ''
        factor, name = self._scale_by_echoes(v, w, gentle)
        if self.scan is not None and self.scan.live:
            ease = self.config.ease if gentle else 0.0
            allowed, side = self.scan.limit(float(v), float(w), self._stopping(gentle), ease)
            if allowed < factor:
                return allowed, f'scan {side}'
        return factor, name

    def side(self, name: str) -> str:
        """Of the chair, where what `scale` names is: front, rear, left or right."""
        return self.sensors[name].side if name in self.sensors else name.split()[-1]

    def _scale_by_echoes(self, v, w, gentle):
        """As `scale`, by the range sensors alone, as far as the scanner does not explain them."""
        places, nearest, body, stopping = self._places, self._nearest, self._body, self._stopping(gentle)
        if self._carved is not None and self._fastest == 0.0:
            outside, nearest = self._carved
            places = places._replace(outside=outside)
        turned = self._beside.turned_to(v, w)
        if turned:
            places = places._replace(outside=np.where(self._walls == turned, math.inf, places.outside))
        fastest = abs(v) + abs(w) * self._farthest  # no place is approached faster
        if self._fastest > 0.0:
            places, nearest = self._when_standing(stopping.reaction + fastest / stopping.braking)
            waits_for = self._waits_for(places, v, w)
            if waits_for:
                return 0.0, waits_for
        if abs(v) <= body.half_width * abs(w):  # a turn in place: between the cones of a side a corner meets what no
            wider, body = self._turning.half_width - body.half_width, self._turning  # echo comes from
            places, nearest = places._replace(outside=places.outside - wider), nearest - wider
        to_rest = stopping.stop_distance + fastest * stopping.reaction + fastest * fastest / (2.0 * stopping.braking)
        if nearest >= to_rest:
            return 1.0, ''
        factor, at = zone_places.limit(places, float(v), float(w), body, stopping)
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

    def caution_factor(self, v: float, w: float) -> float:
        """The factor 0..1 on the command (v m/s, w rad/s) while pedestrians are nearby or expected, 1 if not."""
        return self.caution.scale(v, w, self._now)

    def pedestrians_nearby(self, now: float) -> bool:
        """Whether a pedestrian was detected lately, see Caution."""
        return self.caution.pedestrians_nearby(now)

    @property
    def pedestrian_moving(self) -> bool:
        """Whether a sensor detects a pedestrian who moves, or has confirmed one lately."""
        return self._fastest > 0.0 or self._now < self._careful

    def _waits_for(self, places, v, w):
        """Name of a sensor with a pedestrian who approaches and reaches the body before the chair stands, and into
        whose cone a corner would move; '' if there is none.
        """
        half_x, half_y = self._body
        for name, rays in self._rays_of.items():
            if places.approach[rays.start] == 0.0 or places.outside[rays].min() >= self.config.stop_distance:
                continue
            edges_x, edges_y = self._edges[name]
            if (v * edges_x + abs(w) * (half_y * np.abs(edges_x) + half_x * np.abs(edges_y))).max() > CRAWL:
                return name
        return ''

    def _set_approach(self, name, speed):
        """The obstacle that a sensor measures approaches by itself at speed (m/s)."""
        places, rays = self._places, self._rays_of[name]
        if places.approach[rays.start] != speed:
            places.approach[rays] = speed
            self._fastest = float(places.approach.max())

    def _place(self, sensor, distance):
        """An obstacle is at this range (m) of a sensor, on any of its rays."""
        rays = self._rays_of[sensor.name]
        distance = float(sensor.near if distance == -math.inf else distance)
        zone_places.put(self._places, (rays.start, rays.stop), (float(sensor.x), float(sensor.y)), distance, self._body)
        self._nearest, self._farthest = zone_places.bounds(self._places)

    def _keep(self):
        """Moves the places whose echoes were lost, and those of walls, along with the chair."""
        places, kept = self._places, self._kept
        places.outside[kept], places.radius[kept] = math.inf, 0.0
        lost = ((place.x, place.y, place.name, 0.0) for place in self._lost.places)
        for i, (x, y, name, wall) in enumerate((*lost, *self._beside.places), kept.start):
            places.x[i], places.y[i], self._names[i], self._walls[i] = x, y, name, wall
            places.outside[i] = zone_places.outside_of(x, y, self._body)
            places.radius[i] = math.hypot(x, y)
        self._nearest, self._farthest = zone_places.bounds(places)

    def _when_standing(self, later):
        """The places after `later` s, and the least distance outside the body: an obstacle that approaches is nearer
        then, at the body's edge at most.
        """
        places = self._places
        nearer = np.minimum(places.approach * later, places.to_body)
        x, y = places.x - nearer * places.directions[0], places.y - nearer * places.directions[1]
        there = np.isfinite(places.outside)
        outside = np.where(there, zone_places.outside_of(x, y, self._body), math.inf)
        radius = np.where(there, np.hypot(x, y), 0.0)
        return places._replace(x=x, y=y, outside=outside, radius=radius), float(outside.min())
