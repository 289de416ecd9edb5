"""A leg of a path as something to steer along: where the robot is on it, how far off, and which way it bends there and
ahead.

The points are resampled evenly and smoothed, so that the path has a heading and a curvature everywhere: by a Gaussian
applied twice as 2 G - G^2 (Tukey's twicing, Exploratory Data Analysis, 1977), which leaves straight lines as they are
and bends of the robot's scale within millimetres; corners become arcs. How far it may leave the points is limited.
"""

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_common.repeatable import directions
from sara_nav.pursuit.curvature_law import Bend

SPACING = 0.05
"""Way between two samples (m)."""
WIDE, FINE, ROUNDS = 0.15, 0.06, 6
"""Standard deviations (m) of the Gaussian: that which takes out what wavers, so often, and that which makes it smooth
at last.
"""
STEADY_BEND = 0.15
"""A bend (rad) from one sample to the next that is less than this is that of an arc, not a corner."""
UNSTEADY = 0.02
"""Bends of an arc differ by less than this (rad)."""


class Samples(NamedTuple):
    """A leg as kernels take it, at n points evenly spaced."""

    s: np.ndarray
    """(n,) m from the start, rising."""
    xy: np.ndarray
    """(n, 2) m."""
    direction: np.ndarray
    """(n - 1, 2), unit vectors from each point to the next."""
    heading: np.ndarray
    """(n,) rad of the motion, not wrapped."""
    curvature: np.ndarray
    """(n,) 1/m."""
    change: np.ndarray
    """(n,) 1/m2 of the curvature."""
    size_of_change: np.ndarray
    """(n,) 1/m2, >= 0."""


class Place(NamedTuple):
    """Where a robot is on a leg: m from the start, m to the end (negative beyond it), and whether it drives in
    reverse.
    """

    along: float
    left: float
    backward: bool


class Leg:
    """A path the robot drives without stopping, in reverse when ``backward``.

    points (n, 2) m. deviation: how far smoothing may move the path (m). After ``locate``: ``along`` (m from its start,
    never falling), ``left`` (m to its end, negative beyond), ``offset`` (m, the robot is to the left of the path, as it
    is driven).
    ``s``, ``xy``, ``heading``, ``curvature``, ``change``: of its ``samples``.
    """

    def __init__(self, points: np.ndarray, backward: bool = False, deviation: float = 0.02):
        self.points, self.backward = np.asarray(points, float), bool(backward)
        even, s = _evenly(self.points)
        xy = _smooth_within(even, deviation, s[1])
        steps = np.diff(xy, axis=0)
        length = np.hypot(*steps.T)
        self.s = np.append(0.0, length.cumsum())
        self.xy, self.length = xy, float(self.s[-1])
        direction = steps / length[:, None]
        heading = np.unwrap(directions(steps))
        middle = 0.5 * (self.s[1:] + self.s[:-1])
        self.heading = np.interp(self.s, middle, heading)  # of the motion, not wrapped
        for end, inner in ((0, 1), (-1, -2)):
            self.heading[end] += 0.5 * (heading[end] - heading[inner])
        bend = np.diff(heading) / np.diff(middle) if len(heading) > 1 else np.zeros(0)
        self.curvature = np.concatenate([bend[:1], bend, bend[-1:]]) if len(bend) else np.zeros(2)
        if len(bend):
            self.curvature[[0, -1]] = bend[[0, -1]]
        self.change = np.gradient(self.curvature, self.s) if len(self.s) > 2 else np.zeros(len(self.s))
        self.samples = Samples(
            self.s, self.xy, direction, self.heading, self.curvature, self.change, np.abs(self.change)
        )
        self.along, self.left, self.offset = 0.0, self.length, 0.0

    def locate(self, x: float, y: float) -> None:
        """Find the nearest point of the leg within 1 m of where the robot was, from there on."""
        self.along, self.offset, self.left = self.nearest(x, y, self.along)

    def nearest(self, x: float, y: float, start: float = 0.0) -> tuple[float, float, float]:
        """Return (along, offset, left) of the point (m) nearest to the path from ``start`` (m along it) to 1 m
        further.
        """
        samples = self.samples
        return nearest(samples.s, samples.xy, samples.direction, float(x), float(y), float(start))

    @property
    def place(self) -> Place:
        """Where the robot was located last."""
        return Place(float(self.along), float(self.left), self.backward)

    def bend(self, s: float) -> Bend:
        """Return the Bend at ``s`` m along."""
        s = float(s)
        return Bend(on_leg(s, self.s, self.curvature), on_leg(s, self.s, self.change))

    def poses(self, s: np.ndarray) -> np.ndarray:
        """Return the robot's poses (n, 3) at s (n,) m along; beyond the end it goes straight on."""
        return poses_at(self.samples, np.asarray(s, np.float64), self.backward)

    def heading_error(self, yaw: float, s: float) -> float:
        """Return the robot's heading less the path's at ``s`` (rad, wrapped)."""
        return heading_error(self.s, self.heading, self.backward, float(yaw), float(s))


def _evenly(points):
    """Return the polyline (n, 2) sampled about every SPACING (m, 2), and how far along it the samples are."""
    s = np.append(0.0, np.hypot(*np.diff(points, axis=0).T).cumsum())
    keep = np.append(True, np.diff(s) > 1e-9)
    at = np.linspace(0.0, s[-1], max(3, math.ceil(s[-1] / SPACING) + 1))
    return np.column_stack([np.interp(at, s[keep], points[keep, k]) for k in (0, 1)]), at


def _smooth_within(points, deviation, spacing):
    """Return the points (n, 2) smoothed, each moved by about ``deviation`` (m) at most: smoothed and moved back into
    that reach in turns.
    """
    xy = points
    for _ in range(ROUNDS if deviation > 0.0 else 0):
        moved = _smooth(xy, WIDE, spacing) - points
        size = np.hypot(*moved.T)
        if size.max() <= deviation:
            return points + moved
        xy = points + moved * np.minimum(1.0, deviation / np.maximum(size, 1e-12))[:, None]
    return _smooth(xy, FINE, spacing) if deviation > 0.0 else points


def _smooth(points, sigma, spacing):
    """Return the points (n, 2) smoothed as if they went on beyond both ends."""
    reach = min(math.ceil(6.0 * sigma / spacing), len(points) - 1)
    half = reach // 2
    if half < 1:
        return points
    g = np.exp(-0.5 * (np.arange(-half, half + 1) * (spacing / sigma)) ** 2)
    g /= g.sum()
    kernel = -np.convolve(g, g)
    kernel[half:-half] += 2.0 * g
    longer = np.vstack([_beyond(points, 2 * half)[::-1], points, _beyond(points[::-1], 2 * half)])
    return np.column_stack([np.convolve(longer[:, k], kernel, 'valid') for k in (0, 1)])


def _beyond(points, n):
    """Return n points (n, 2) that go on beyond the first of some evenly spaced ones: round the same bend where they
    begin with an arc, else straight on.

    Mirrored at the normal of the path an arc goes on as an arc; turned about the first point a path goes on in its
    direction.
    """
    steps = points[:4] - points[1:5] if len(points) > 4 else points[:1] - points[1:2]
    heading = np.unwrap(directions(steps))
    bends = -np.diff(heading)
    off = points[1 : n + 1] - points[0]
    if not len(bends) or np.abs(bends).max() > STEADY_BEND or np.ptp(bends) > UNSTEADY:
        return points[0] - off
    direction = heading[0] + 0.5 * bends[0]
    along = np.array([math.cos(direction), math.sin(direction)])
    return points[0] + off - 2.0 * (off @ along)[:, None] * along


@kernel
def _before(s, value):
    """Return the last index of s (n,), rising, at which it is not above the value; -1 where it is above from the
    first.
    """
    low, high = 0, len(s)
    while low < high:
        middle = (low + high) // 2
        if s[middle] <= value:
            low = middle + 1
        else:
            high = middle
    return low - 1


@kernel
def between(value: float, s: np.ndarray, heights: np.ndarray) -> float:
    """Return np.interp(value, s, heights) of one value."""
    k = _before(s, value)
    if k < 0:
        return heights[0]
    if k >= len(s) - 1 or s[k] == value:
        return heights[min(k, len(s) - 1)]
    return (heights[k + 1] - heights[k]) / (s[k + 1] - s[k]) * (value - s[k]) + heights[k]


@kernel
def on_leg(at: float, s: np.ndarray, heights: np.ndarray) -> float:
    """Return heights (n,) of a leg's samples, which are s (n,) m along, at ``at`` m along; 0.0 beyond the end, where it
    goes straight on.
    """
    return 0.0 if at > s[-1] else between(at, s, heights)


@kernel
def heading_error(s: np.ndarray, heading: np.ndarray, backward: bool, yaw: float, at: float) -> float:
    """See Leg.heading_error: s, heading: of the samples; at ``at`` m along."""
    return wrap((yaw + math.pi if backward else yaw) - between(at, s, heading))


@kernel
def poses_at(samples: Samples, at: np.ndarray, backward: bool) -> np.ndarray:
    """See Leg.poses: at ``at`` (n,) m along."""
    poses = np.empty((len(at), 3))
    x, y = np.ascontiguousarray(samples.xy[:, 0]), np.ascontiguousarray(samples.xy[:, 1])
    s, heading = samples.s, samples.heading
    for i in range(len(at)):
        over = max(at[i] - s[-1], 0.0)
        direction = between(at[i], s, heading)
        poses[i, 0] = between(at[i], s, x) + over * math.cos(direction)
        poses[i, 1] = between(at[i], s, y) + over * math.sin(direction)
        poses[i, 2] = direction + (math.pi if backward else 0.0)
    return poses


@kernel
def nearest(s: np.ndarray, xy: np.ndarray, direction: np.ndarray, x: float, y: float, start: float) -> tuple:
    """See Leg.nearest. s, xy, direction: of the samples."""
    lines = len(direction)
    first = min(max(_before(s, start), 0), lines - 1)
    best = first
    distance, held, free, across, length = math.inf, 0.0, 0.0, 0.0, 0.0
    for k in range(first, lines):
        if k > first and s[k - 1] >= start + 1.0:
            break
        dx, dy = x - xy[k, 0], y - xy[k, 1]
        on, off = dx * direction[k, 0] + dy * direction[k, 1], direction[k, 0] * dy - direction[k, 1] * dx
        line = s[k + 1] - s[k]
        kept = min(max(on, 0.0), line)
        away = math.hypot(off, on - kept)
        if away < distance:
            best, distance, held, free, across, length = k, away, kept, on, off, line
    along = max(s[best] + held, start)
    offset, left = math.copysign(distance, across), s[lines] - along
    if best == lines - 1 and free > length:  # beyond the end the last line goes on
        offset, left = across, length - free
    elif best == 0 and free < 0.0:
        offset = across
    return along, offset, left


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    s, points = np.array([0.0, 1.0]), np.array([[0.0, 0.0], [1.0, 0.0]])
    samples = Samples(s, points, points[1:], s, s, s, s)
    on_leg(0.5, s, s)
    heading_error(s, s, False, 0.0, 0.5)
    poses_at(samples, s, False)
    nearest(s, points, points[1:], 0.5, 0.5, 0.0)
