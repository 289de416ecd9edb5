"""Remembers close obstacles ahead or astern that have left a sensor's cone because the chair moved.

A range sensor measures only inside its cone. When the chair approaches a door at an angle, the jamb comes nearer and
nearer; then the chair turns by a degree and the echo is gone. The jamb is still there, beside the cone and in front of
the body's corner. So the outer end of the last arc is kept and moved along with the chair, until a cone finds the place
free or the chair has driven on; a chair that stands learns nothing new about it. What was too near to be measured just
before may be nearer than that: then a place half as far is kept, too. (An obstacle that leaves by the inner end is
between two cones that look the same way; both have measured it from afar.) An echo is not kept if it ends while the
chair does not approach it (the chair stands, turns in place, or drives away): the obstacle has moved, or the cone has
turned past it.

That the beginning and the end of an echo tell the place of an obstacle is from J. Leonard, H. Durrant-Whyte, Directed
sonar sensing for mobile robot navigation, 1992.
"""

import math
from typing import NamedTuple

from sara_control.zones.zone_config import RangeSensor

# m: a nearer echo is kept; farther away, the jambs of a door that is passed in its middle leave the cones, too
CLOSE = 0.25
NEAREST = 0.16  # m: an echo nearer than a sensor measures (-Inf) is no farther than this
GONE = 0.15  # m by which a range jumps when an echo is lost
MOVING = 0.005  # m/s in the direction of a sensor: the chair approaches the echo
LATELY = 1.5  # s: delay of the median and of the release
KEPT = 1.5  # m that are driven until the odometry has drifted too much
INSIDE = math.radians(4.0)  # an obstacle this far inside a cone gives an echo
FREE = 0.1  # m: an echo this much farther than the place shows that the place is free
MOST = 8  # places that are kept
LONGEST_GAP = 0.5  # s without a reading: how the chair moved meanwhile is not known
DISORDER = 0.05  # s by which a reading may come after a later one of another sensor
NOT_FREE = '', math.inf  # no sensor has found a place free


class LostPlace(NamedTuple):
    """x, y: place in the base frame now, m. name: of the sensor that lost it. driven: m since then. free: which sensor
    has found it free, and since when (s).
    """

    x: float
    y: float
    name: str
    driven: float = 0.0
    free: tuple[str, float] = NOT_FREE


class LostEchoes:
    """half_angle: of a sensor's cone, rad. `places`: list of LostPlace."""

    def __init__(self, half_angle: float) -> None:
        self._half = half_angle
        self.places = []
        self._last, self._moved = None, {1.0: -math.inf, -1.0: -math.inf}  # s: when it last drove ahead, astern
        self._too_near: dict[str, float] = {}  # s: when a sensor last heard again what had been too near

    def carry(self, stamp: float, v: float, w: float) -> bool:
        """The chair moved at v (m/s), w (rad/s) until stamp (s). Returns whether `places` changed."""
        if self._last is not None and -DISORDER <= stamp - self._last < 0.0:
            return False  # sensors are heard in threads of their own, now and then in another order
        before, self._last = self._last, stamp
        dt = 0.0 if before is None else stamp - before
        if abs(v) > MOVING:
            self._moved[math.copysign(1.0, v)] = stamp
        if not 0.0 <= dt <= LONGEST_GAP:
            self._moved = dict.fromkeys(self._moved, -math.inf)
            changed, self.places = bool(self.places), []
            return changed
        if not self.places or dt == 0.0:
            return False
        c, s = math.cos(w * dt), math.sin(w * dt)
        moved = [(p.x - v * dt, p) for p in self.places if p.driven <= KEPT]
        self.places = [
            p._replace(x=c * x + s * p.y, y=c * p.y - s * x, driven=p.driven + abs(v) * dt) for x, p in moved
        ]
        return True

    def on_same_range(self, sensor: RangeSensor, now: float) -> bool:
        """A sensor's filtered range (m, +-Inf) has stayed as it was. What it finds free so for LATELY is. Returns
        whether `places` changed.
        """
        kept = []
        for place in self.places:
            if sensor.stops and self._free(sensor, now, place):
                since = place.free[1] if place.free[0] == sensor.name else self._last
                if self._last - since <= LATELY:
                    kept.append(place._replace(free=(sensor.name, since)))
            else:
                kept.append(place._replace(free=NOT_FREE) if place.free[0] == sensor.name else place)
        changed = len(kept) != len(self.places)
        self.places = kept
        return changed

    def on_range_change(self, sensor: RangeSensor, before: float | None, now: float) -> bool:
        """A sensor's filtered range (m, +-Inf as in REP-117) has changed. Returns whether `places` changed."""
        count = len(self.places)
        self.places = [p for p in self.places if not self._free(sensor, now, p)]
        changed = len(self.places) != count
        if before is None:
            return changed
        if before < NEAREST and self._last is not None:
            self._too_near[sensor.name] = self._last
        if not self._left_by_the_edge(sensor, before, now):
            return changed
        away = max(before, NEAREST)
        # The outer end of a left sensor's arc is on its left if the sensor looks ahead, on its right if astern.
        angle = sensor.yaw + math.copysign(self._half, sensor.y * math.cos(sensor.yaw))
        was_too_near = self._last - self._too_near.get(sensor.name, -math.inf) <= LATELY
        for far in (away, 0.5 * NEAREST) if was_too_near else (away,):
            x, y = sensor.x + far * math.cos(angle), sensor.y + far * math.sin(angle)
            self.places.append(LostPlace(x, y, sensor.name))
        del self.places[:-MOST]
        return True

    def _left_by_the_edge(self, sensor, before, now):
        along = math.cos(sensor.yaw)
        return (
            self._last is not None
            and sensor.stops
            and abs(along) > 0.7
            and before <= CLOSE
            and now > max(before, NEAREST) + GONE
            and self._last - self._moved[math.copysign(1.0, along)] <= LATELY
        )

    def _free(self, sensor, distance, place):
        """Whether a sensor that measures `distance` shows that the place is free."""
        dx, dy = place.x - sensor.x, place.y - sensor.y
        off = math.remainder(math.atan2(dy, dx) - sensor.yaw, 2.0 * math.pi)
        return abs(off) < self._half - INSIDE and distance > math.hypot(dx, dy) + FREE
