"""Places about the chair where a range sensor's echo may come from, and the limit that they set to a command.

An echo tells a distance, not a direction: on every ray of the sensor's cone there may be a place. The gate asks for
the limit at every command, 50 times a second, so the functions are compiled. Lengths in m, speeds in m/s and rad/s, in
the base frame.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_control.zones.zone_config import RangeSensor

SAMPLES = 40  # of the path to a place
NEARER = 1e-6  # m: a place that comes nearer by less does not come nearer
RESTING = 1e-9  # m/s: a place approached no faster than this is on the axis of the turn


class Body(NamedTuple):
    """Half the length and half the width of the body, centred on base_link."""

    half_length: float
    half_width: float


class Places(NamedTuple):
    """Arrays (n,), one entry for each ray of each sensor, then one for each echo that may be kept after it was lost.

    x, y: of the place. outside: how far it is outside the body, by the axis on which it is farther; +Inf where there is
    none. radius: its distance from base_link, 0 where there is none. to_body: how far it is from the body along its
    ray. approach: speed at which it comes by itself. stops: whether it may stop the chair. directions (2, n): unit
    vectors of the rays. inside: length of the ray within the body.
    """

    x: np.ndarray
    y: np.ndarray
    outside: np.ndarray
    radius: np.ndarray
    to_body: np.ndarray
    approach: np.ndarray
    stops: np.ndarray
    directions: np.ndarray
    inside: np.ndarray


def no_places(sensors: Sequence[RangeSensor], rays: int, kept: int) -> tuple[Places, list[str]]:
    """Places without an echo on any of so many rays of any sensor, and none kept (at most so many); with the names of
    their sensors.
    """
    n = rays * len(sensors) + kept
    stops = np.append(np.repeat(np.array([sensor.stops for sensor in sensors], bool), rays), np.ones(kept, bool))
    x, y, radius, to_body, approach, inside = np.zeros((6, n))
    places = Places(x, y, np.full(n, math.inf), radius, to_body, approach, stops, np.zeros((2, n)), inside)
    return places, [sensor.name for sensor in sensors for _ in range(rays)] + [''] * kept


class Stopping(NamedTuple):
    """How the chair stops: at `stop_distance` (m) before contact, `reaction` s after the echo, at `braking` m/s2.
    creep: speed that is allowed up to the stop distance; creeps_everywhere: and beyond it.
    """

    stop_distance: float
    reaction: float
    braking: float
    creep: float
    creeps_everywhere: bool


@kernel
def outside_of(x: float, y: float, body: Body) -> float:
    """How far (x, y), numbers or arrays, is outside the body, by the axis on which it is farther; negative within."""
    return np.maximum(np.abs(x) - body.half_length, np.abs(y) - body.half_width)


@kernel
def put(places: Places, rays: tuple[int, int], sensor: tuple[float, float], distance: float, body: Body) -> None:
    """Puts an echo at `distance` (+Inf: nothing) of a sensor at (x, y) on its rays, (first, last) of `places`."""
    for i in range(rays[0], rays[1]):
        if distance == math.inf:
            places.outside[i], places.radius[i] = math.inf, 0.0
            continue
        along = max(distance, places.inside[i])
        x, y = sensor[0] + along * places.directions[0, i], sensor[1] + along * places.directions[1, i]
        places.x[i], places.y[i] = x, y
        places.outside[i], places.radius[i] = outside_of(x, y, body), math.hypot(x, y)
        places.to_body[i] = along - places.inside[i]


@kernel
def bounds(places: Places) -> tuple[float, float]:
    """(least distance of all places outside the body, greatest from base_link)."""
    nearest, farthest = math.inf, 0.0
    for i in range(len(places.x)):
        nearest, farthest = min(nearest, places.outside[i]), max(farthest, places.radius[i])
    return nearest, farthest


@kernel
def is_swept(place: tuple[float, float, float], v: float, w: float, body: Body) -> bool:
    """Whether the body meets a place (x, y, radius) sooner or later on the curve of (v, w), ahead or astern.

    On the curve a place keeps its distance from the centre of rotation (0, c), c = v / w; the body is met by distances
    between those of its nearest and its farthest point. Squared, less c^2 and times |w|, that holds for a straight line
    too.
    """
    _, y, radius = place
    turn, half_width = abs(w), body.half_width
    reach = turn * (radius * radius) - 2.0 * v * math.copysign(1.0, w) * y
    if reach > turn * (body.half_length * body.half_length + half_width * half_width) + 2.0 * half_width * abs(v):
        return False
    if abs(v) <= half_width * turn:  # the centre is within the body's width, and its nearest point is no limit
        return True
    return reach >= turn * (half_width * half_width) - 2.0 * half_width * abs(v)


@kernel
def free_distance(place: tuple[float, float], v: float, w: float, within: float, body: Body) -> float:
    """How far a place (x, y) moves relative to the chair until it meets the body; +Inf if not `within` that."""
    x, y = place
    speed = math.hypot(v - w * y, w * x)
    before = outside_of(x, y, body)
    for k in range(SAMPLES):
        t = within * ((k + 1) / SAMPLES) / speed
        half_turn = 0.5 * w * t
        chord = v * t * (math.sin(half_turn) / half_turn if half_turn != 0.0 else 1.0)
        dx, dy = x - chord * math.cos(half_turn), y - chord * math.sin(half_turn)
        c, s = math.cos(2.0 * half_turn), math.sin(2.0 * half_turn)
        outside = outside_of(c * dx + s * dy, c * dy - s * dx, body)
        if outside <= 0.0 and outside < before - NEARER:
            return k * (within / SAMPLES)
        before = outside
    return math.inf


@kernel
def allowed_speed(room: float, stopping: Stopping) -> float:
    """The speed u from which the chair comes to rest within `room`: u reaction + u^2 / (2 braking) = room."""
    reaction, braking = stopping.reaction, stopping.braking
    return braking * (math.sqrt(reaction * reaction + 2.0 * max(room, 0.0) / braking) - reaction)


@kernel
def limit(places: Places, v: float, w: float, body: Body, stopping: Stopping) -> tuple[float, int]:
    """(factor that the places allow on the command (v, w), +Inf if none limits it; index of the place that asks for
    it, -1 if none).
    """
    worst, at = math.inf, -1
    for i in range(len(places.x)):
        x, y = places.x[i], places.y[i]
        if places.outside[i] == math.inf or not is_swept((x, y, places.radius[i]), v, w, body):
            continue
        u = math.hypot(v - w * y, w * x)
        to_rest = stopping.stop_distance + u * stopping.reaction + u * u / (2.0 * stopping.braking)
        if u <= RESTING or places.outside[i] >= to_rest:
            continue
        room = free_distance((x, y), v, w, to_rest, body) - stopping.stop_distance
        allowed = allowed_speed(room, stopping) if room > 0.0 else 0.0
        if places.approach[i] == 0.0 and (room > 0.0 or not places.stops[i] or stopping.creeps_everywhere):
            allowed = max(allowed, stopping.creep)
        if allowed / u < worst:
            worst, at = allowed / u, i
    return worst, at


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    body = Body(0.5, 0.3)
    x, y, outside, radius, to_body, approach, inside = np.ones((7, 3))
    places = Places(x, y, outside, radius, to_body, approach, np.ones(3, bool), np.ones((2, 3)), inside)
    put(places, (0, 3), (0.0, 0.0), 1.0, body)
    bounds(places)
    limit(places, 0.1, 0.1, body, Stopping(0.1, 0.2, 0.5, 0.1, False))
    outside_of(x, y, body)
    outside_of(1.0, 1.0, body)
