"""How near an oriented outline comes to obstacles, standing and moving, and how long a move takes by that.

The gap of a pose is the least distance to an obstacle along the outline. Distances change by no more than one walks
(they are 1-Lipschitz), so a point far from everything clears its neighbours along the outline: the walk round it takes
steps as long as what it reads allows (sphere tracing; Hart 1996), and in the open one look at the centre does.

A move has one curvature: straight, an arc, or a turn in place. It is sampled as finely as its gap asks for. All lengths
in m, times in s.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_nav.grids.footprint import cover, radii
from sara_nav.lattice.field import distance_at

ENTRIES = 20
(
    SPEED,
    TURN_RATE,
    REVERSE,
    HARD,
    CAP,
    SOFT,
    WEIGHT,
    ROOM,
    ROOM_WEIGHT,
    TURN_COST,
    GEAR_COST,
    ORIGIN_X,
    ORIGIN_Y,
    RESOLUTION,
    SPACING,
    RADIUS,
    SENSE,
    NARROW,
    RUN_UP,
    RUN_UP_COST,
) = range(ENTRIES)
"""Entries of ``rules``: m/s and rad/s that moves are timed with; factor of reversing; the least gap; the greatest that
is told apart; the gap from which on nothing slows a drive, and what the least gap adds to its time; the same two of the
circle that turns in place sweep; s for beginning a turn and for changing between ahead and astern; the grid; m between
the outline's points; circumscribed radius; 1, or -1 where moves are looked for backwards in time, so that ahead is
astern; the gap that makes a place narrow; m of straight leg wished for before and after such places; s that its want
costs at either end.
"""
FINE = 0.045
"""m that any point of the body moves between two samples where it is tight; a quarter of that where it has less than
the margin.
"""
COARSE = 0.2
"""m between samples where nothing is near."""
ROUGH = 0.02
"""m that a gap may be told too great where it is well above what is allowed."""
TOUCHING = 0.002
"""m; the gap allowed about a start or a goal that itself has less than the margin."""
BEND = 0.35
"""rad; a lesser turn costs only its share of the beginning of a turn."""


class Body:
    """A footprint (k, 2), m, as the kernels want it. ``outline``: points in their order, ``spacing`` apart; ``inside``:
    points that cover it; ``inscribed``, ``circumscribed``: radii.
    """

    def __init__(self, corners, resolution):
        self.corners, self.resolution = np.ascontiguousarray(corners, dtype=np.float64), resolution
        self.inscribed, self.circumscribed = radii(self.corners)
        following = np.roll(self.corners, -1, axis=0)
        points, self.spacing = [], 0.0
        for a, b in zip(self.corners, following):
            length = math.hypot(*(b - a))
            n = max(1, math.ceil(length / (0.5 * resolution)))
            self.spacing = max(self.spacing, length / n)
            points.append(a + np.arange(n)[:, None] / n * (b - a))
        self.outline = np.ascontiguousarray(np.vstack(points))
        self.inside = cover(self.corners, 0.5 * resolution)


@kernel
def gap(field, rules, outline, inside, x, y, yaw, limit):
    """Return the least distance (m) of the outline at a pose to an obstacle, at most CAP.

    Between the outline's points, half a spacing may be missed. With a positive limit the result may be ROUGH too much,
    but for what is below the limit. Where it is less than ``limit`` the walk ends and something less than that is
    returned. A negative limit, of a body in contact,
    has contacts counted: the result is minus the number of points of ``inside`` on obstacles where there are any.
    """
    scale = 1.0 / rules[RESOLUTION]
    u0, v0 = (x - rules[ORIGIN_X]) * scale, (y - rules[ORIGIN_Y]) * scale
    least = rules[CAP]
    if distance_at(field, u0, v0) - rules[RADIUS] >= least:
        return least
    c, s = math.cos(yaw) * scale, math.sin(yaw) * scale
    if limit < 0.0:
        count = 0
        for k in range(len(inside)):
            a, b = inside[k, 0], inside[k, 1]
            if distance_at(field, u0 + c * a - s * b, v0 + s * a + c * b) <= 0.0:
                count += 1
        if count > 0:
            return -1.0 * count
    k, n, spacing = 0, len(outline), rules[SPACING]
    while k < n:
        a, b = outline[k, 0], outline[k, 1]
        d = distance_at(field, u0 + c * a - s * b, v0 + s * a + c * b)
        if d < least:
            least = d
            if d < limit:
                return d
        k += max(1, int((min(d - limit, d - least + ROUGH) if limit > 0.0 else d - least) / spacing))
    return least


@kernel
def margin_at(here):
    """Return the gap to be kept near where a way begins or ends with the gap ``here``: TOUCHING, or no more contacts
    than there are.

    A body that stands along a wall cannot leave it but by swinging its tail a little nearer first.
    """
    return (
        min(here, TOUCHING) if here > 0.0 else min(here, -0.5)
    )  # flush with something: no contact, but none is to come


@kernel
def slowness(rules, least):
    """Return by what factor a gap (m) makes a drive take longer."""
    if least >= rules[SOFT]:
        return 1.0
    share = (rules[SOFT] - max(least, 0.0)) / rules[SOFT]
    return 1.0 + rules[WEIGHT] * share * share * share * share


@kernel
def slowness_about(field, rules, x, y):
    """Return by what factor the room about a place makes a turn there take longer.

    It goes by the circle that turning about sweeps, not by what this turn sweeps of it: sensors that tell how far
    something is but hardly where make a robot as careful.
    """
    spare = (
        distance_at(field, (x - rules[ORIGIN_X]) / rules[RESOLUTION], (y - rules[ORIGIN_Y]) / rules[RESOLUTION])
        - rules[RADIUS]
    )
    share = min(max(0.0, 1.0 - spare / rules[ROOM]), 2.0)
    return 1.0 + rules[ROOM_WEIGHT] * share * share


@kernel
def place(x, y, yaw, length, turn, share):
    """Return (x, y, yaw) after a share of a move."""
    heading, dyaw = yaw + 0.5 * share * turn, share * turn
    chord = share * length
    if abs(dyaw) > 1e-9:
        chord *= math.sin(0.5 * dyaw) / (0.5 * dyaw)
    return x + chord * math.cos(heading), y + chord * math.sin(heading), yaw + dyaw


@kernel
def move(field, rules, outline, inside, x, y, yaw, length, turn, limit):
    """Return (seconds, limit) of a move from a pose; seconds is inf where the body may not go.

    length: m along the way, negative astern. turn: rad. limit: the least gap allowed; where that is below HARD, because
    the body stands so near to something, things get no worse than that, and the limit is HARD again once the gap is.
    Contacts only get fewer.
    """
    way = abs(length) + rules[RADIUS] * abs(turn)
    turning = length == 0.0
    seconds = max(abs(length) / rules[SPEED], abs(turn) / rules[TURN_RATE])
    if length * rules[SENSE] < 0.0:
        seconds *= rules[REVERSE]
    hard = rules[HARD]
    here = gap(field, rules, outline, inside, x, y, yaw, limit)
    if here < limit:
        return np.inf, limit
    if way <= 0.0:
        return 0.0, limit
    about = slowness_about(field, rules, x, y) if turning else 1.0
    slow = about if turning else slowness(rules, here)
    total, done = 0.0, 0.0
    first, last = (0.0, 0.0) if here < rules[NARROW] else (2.0, -1.0)  # shares of the way between which it is narrow
    while done < 1.0:
        step = min(max(here - hard, 0.25 * FINE if 0.0 < limit < hard else FINE), COARSE) / way
        if done + step > 1.0 - 1e-9:
            step = 1.0 - done
            done = 1.0
        else:
            done += step
        px, py, pyaw = place(x, y, yaw, length, turn, done)
        here = gap(field, rules, outline, inside, px, py, pyaw, limit)
        if here < limit:
            return np.inf, limit
        if limit < hard:
            limit = hard if here >= hard else max(limit, margin_at(here))
        then = about if turning else slowness(rules, here)
        total += 0.5 * (slow + then) * step
        slow = then
        if here < rules[NARROW]:
            first, last = min(first, done), done
    seconds *= total
    if turn == 0.0 and rules[RUN_UP_COST] > 0.0 and first <= 1.0:
        before, after = first * way / rules[RUN_UP], (1.0 - last) * way / rules[RUN_UP]
        seconds += rules[RUN_UP_COST] * (max(0.0, 1.0 - before) + max(0.0, 1.0 - after))
    return seconds, limit


@kernel
def arrive(field, rules, outline, inside, x, y, yaw, length, turn, limit):
    """Return the seconds of the move that ends at a pose (x, y, yaw) where the gap may be as little as ``limit``: a
    move away from there, backwards in time, so that things only get worse as they must.
    """
    seconds, _ = move(field, rules, outline, inside, x, y, yaw, -length, -turn, limit)
    if length > 0.0:
        return seconds / rules[REVERSE]
    return seconds * rules[REVERSE] if length < 0.0 else seconds


@kernel
def turn_to(field, rules, outline, inside, x, y, yaw, target, limit):
    """Return (seconds, turn, limit) of turning in place to ``target`` (rad): the short way, the long one where that is
    blocked.
    """
    turn = wrap(target - yaw)
    if abs(turn) < 1e-6:
        return 0.0, 0.0, limit
    seconds, after = move(field, rules, outline, inside, x, y, yaw, 0.0, turn, limit)
    if seconds == np.inf:
        about = turn - math.copysign(2.0 * math.pi, turn)
        seconds, after = move(field, rules, outline, inside, x, y, yaw, 0.0, about, limit)
        turn = about if seconds < np.inf else turn
    return seconds + rules[TURN_COST] * min(1.0, abs(turn) / BEND), turn, after


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    rules, points = np.ones(ENTRIES), np.zeros((4, 2))
    turn_to(np.zeros((4, 4), np.float32), rules, points, points, 1.0, 1.0, 0.0, 1.0, 0.0)
    arrive(np.zeros((4, 4), np.float32), rules, points, points, 1.0, 1.0, 0.0, 1.0, 0.0, 0.0)
    gap(np.zeros((4, 4), np.float32), rules, points, points, 1.0, 1.0, 0.0, 1.0)
    margin_at(0.1)
    place(0.0, 0.0, 0.0, 1.0, 0.0, 1.0)
