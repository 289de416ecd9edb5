"""Legs of a path: where the robot is along one, how far off, how far from its end, and the point ahead of it."""
import math

from sara_nav.geometry import wrap
from sara_nav.planning import simplify


class Leg:
    """A polyline the robot drives without stopping; ``backward`` when it drives it in reverse.

    After ``locate``: ``along`` (m from its start, never falling), ``left`` (m to its end, negative beyond),
    ``offset`` (distance from it, m).
    """

    def __init__(self, vertices, backward=False):
        self.vertices = [(float(x), float(y)) for x, y in vertices]
        self.backward = backward
        self._start = [0.0]
        for (x0, y0), (x1, y1) in zip(self.vertices, self.vertices[1:]):
            self._start.append(self._start[-1] + math.hypot(x1 - x0, y1 - y0))
        self.length = self._start[-1]
        self._segment = 0
        self.along = 0.0
        self.offset = 0.0
        self.left = self.length

    def _direction(self, segment):
        (x0, y0), (x1, y1) = self.vertices[segment:segment + 2]
        length = self._start[segment + 1] - self._start[segment]
        return ((x1 - x0) / length, (y1 - y0) / length) if length > 0.0 else (1.0, 0.0)

    def locate(self, x, y, window=1.0):
        """Find the nearest point of the leg within ``window`` m of where the robot was, from there on."""
        best = None
        last = len(self.vertices) - 2
        for segment in range(self._segment, last + 1):
            if segment > self._segment and self._start[segment] > self.along + window:
                break
            x0, y0 = self.vertices[segment]
            dx, dy = self._direction(segment)
            length = self._start[segment + 1] - self._start[segment]
            free = (x - x0) * dx + (y - y0) * dy
            held = min(max(free, 0.0), length)
            offset = math.hypot(x - x0 - held * dx, y - y0 - held * dy)
            if best is None or offset <= best[0]:
                best = offset, segment, self._start[segment] + held, free, dx * (y - y0) - dy * (x - x0)
        self.offset, self._segment, along, free, across = best
        self.along = max(self.along, along)
        self.left = self.length - self.along
        if self._segment == last and free > self.length - self._start[last]:
            self.left = self.length - self._start[last] - free
            self.offset = abs(across)

    def point_ahead(self, distance):
        """Return the point (x, y) ``distance`` m further along; beyond the end the last line goes straight on."""
        s = self.along + distance
        segment = self._segment
        while segment < len(self.vertices) - 2 and s > self._start[segment + 1]:
            segment += 1
        x0, y0 = self.vertices[segment]
        dx, dy = self._direction(segment)
        s -= self._start[segment]
        return x0 + s * dx, y0 + s * dy


def split_legs(plan, corner_angle, tolerance=0.02):
    """Return the Legs of a plan (n, 2 or more): split where the simplified path bends by more than corner_angle."""
    vertices = [tuple(v) for v in simplify(plan, tolerance)]
    kept = [vertices[0]]
    for vertex in vertices[1:]:
        if math.hypot(vertex[0] - kept[-1][0], vertex[1] - kept[-1][1]) > 1e-6:
            kept.append(vertex)
    if len(kept) == 1:
        kept.append(kept[0])
    legs, current = [], kept[:2]
    for before, corner, after in zip(kept, kept[1:], kept[2:]):
        bend = wrap(math.atan2(after[1] - corner[1], after[0] - corner[0])
                    - math.atan2(corner[1] - before[1], corner[0] - before[0]))
        if abs(bend) > corner_angle:
            legs.append(Leg(current))
            current = [corner]
        current.append(after)
    legs.append(Leg(current))
    return legs
