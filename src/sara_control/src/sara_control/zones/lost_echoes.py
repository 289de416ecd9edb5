"""What was heard close ahead or astern and is heard no more, though only the chair has moved: it has left the cone by
its edge, and stands there still.

A sensor tells of what is in its cone alone. A chair that creeps up to a door aslant hears the jamb nearer and nearer,
turns by a degree, and hears it no more: the jamb is beside the cone then, and before the corner of the body. So the
outer end of the last arc is kept, carried along as the chair moves, until a cone finds it free, or the chair has gone
on; one that stands learns nothing more of it. (What leaves by the inner end stands between the two cones that look the
same way, and both have heard it from afar.) An echo that ends while the chair does not drive up to it (it stands, turns
in place, or drives away) is not kept: it has gone away by itself, or the cone has been swung past it. (Range-only sonar
tells of a place by where its echo begins and ends: J. Leonard, H. Durrant-Whyte, Directed sonar sensing for mobile
robot navigation, 1992.)
"""

import math
from typing import NamedTuple

# m: what is heard nearer than this is kept; farther away, the jambs of a door that is passed in its middle leave the
# cones
CLOSE = 0.25
NEAREST = 0.16  # m: what is heard nearer than a sensor measures (-Inf) is no farther than this
GONE = 0.15  # m by which a range is farther at once when what was heard is heard no more
MOVING = 0.005  # m/s towards where a sensor looks: the chair drives up to what is heard
LATELY = 1.5  # s: median and release may be so late
KEPT = 1.5  # m of way, for which the chair knows well enough how it moved
INSIDE = math.radians(4.0)  # within a cone by so much, a place would be heard
FREE = 0.1  # m: if what is heard there is farther than the place by so much, the place is free
MOST = 8  # places that are kept
LONGEST_GAP = 0.5  # s without a reading after which nobody knows how the chair moved


class LostPlace(NamedTuple):
    """Where it is, x, y (m), in the base frame now; name: of the sensor that had heard it; way: m that were driven
    since.
    """

    x: float
    y: float
    name: str
    way: float = 0.0


class LostEchoes:
    """half_angle: of a cone, rad. `places`: the LostPlaces."""

    def __init__(self, half_angle):
        self._half = half_angle
        self.places = []
        self._last, self._moved = None, {1.0: -math.inf, -1.0: -math.inf}  # s at which it drove ahead, astern

    def carry(self, stamp, v, w):
        """The chair moved at v (m/s), w (rad/s) until stamp (s). Returns whether `places` changed."""
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
        moved = [(p.x - v * dt, p.y, p.name, p.way + abs(v) * dt) for p in self.places if p.way <= KEPT]
        self.places = [LostPlace(c * x + s * y, c * y - s * x, name, way) for x, y, name, way in moved]
        return True

    def heard(self, sensor, before, now):
        """A sensor's believed range (m, +-Inf as in REP-117) has become another. Returns whether `places` changed."""
        count = len(self.places)
        self.places = [p for p in self.places if not self._free(sensor, now, p)]
        changed = len(self.places) != count
        if before is None or not self._left_by_the_edge(sensor, before, now):
            return changed
        away = max(before, NEAREST)
        angle = sensor.yaw + math.copysign(
            self._half, sensor.y * math.cos(sensor.yaw)
        )  # on the left the outer end is left ahead, right astern
        self.places.append(LostPlace(sensor.x + away * math.cos(angle), sensor.y + away * math.sin(angle), sensor.name))
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
        """Whether a sensor that hears nothing nearer than `distance` would hear the place."""
        dx, dy = place.x - sensor.x, place.y - sensor.y
        off = math.remainder(math.atan2(dy, dx) - sensor.yaw, 2.0 * math.pi)
        return abs(off) < self._half - INSIDE and distance > math.hypot(dx, dy) + FREE
