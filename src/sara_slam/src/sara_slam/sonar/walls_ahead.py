"""What stands beside a robot, drawn on ahead of where its sensors hear it: sensors that face aside do not hear what the
robot's front comes to, and a map is drawn too seldom to tell in time.

Walls that are known go on as far as no sensor looked through them, to the next doorway of the map, and as far as the
body has not been where they would be. Other flat things do, too, if the robot comes nearer to them, but not what is
heard where a doorway's posts are, until the robot is past the wall. What is too near to be measured goes on as
it did when it was measured; where nothing is known of it, it is taken to stand beside the robot, square to the walls.
"""

from __future__ import annotations

import math
from collections import defaultdict, deque
from collections.abc import Sequence

import numpy as np

from sara_common.repeatable import cos_sin
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import FREE, OCCUPIED, GridMap
from sara_slam.sonar.doorways import NO_DOORWAYS, Doorways
from sara_slam.sonar.drawing import Pose
from sara_slam.sonar.face_search import face, points
from sara_slam.sonar.forward_model import EDGE
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.square_walls import heading_of, squared
from sara_slam.sonar.wall_filter import WallFilter, foot

WALL_BEYOND, FACE_BEYOND, BEHIND = 0.8, 0.4, 0.1
"""m that a wall, and another flat thing, goes on beyond the robot's front; that is shown behind where it is heard."""
NEAREST, NEAR = 0.1, 0.6
"""m from a sensor from which on and up to which something is shown."""
WALL_KEPT_S, FACE_KEPT_S = 1.0, 10.0
"""s that a wall, and another flat thing, has been heard since."""
THROUGH = 0.3
"""m farther than a wall that a reading must be to have come through it."""
SQUARE = 0.25
"""rad off a wall's normal up to which a sensor hears it for certain, if it is there."""
STEP, OPENS = 0.05, 2
"""m along a wall, of what is kept about where it is open; steps to both sides of where something was heard of it or
through it.
"""
LOOKS, LOOK_M, SURE = 60, 0.05, 4
"""Readings of sensors that face aside that are kept, to tell where other flat things are open; m between two of a
sensor; steps from where a thing is heard that stand whatever was heard there before.
"""
ASIDE = 0.7
"""Sine of the angle off the robot's axis from which on a sensor faces aside."""
TOO_NEAR, TAKEN_FOR = 1.5, 0.75
"""Of the sensors' least range: up to this something that was known is what is too near to be measured; where something
unknown is shown.
"""
TURNS_BACK = 0.01
"""m that the robot must have come back until it counts as driving the other way: less is rounding, or a tremble."""
TOGETHER, APART, RECENT, FACES = 0.4, 0.02, 30, 8
"""m of way in which a flat thing is looked for; m between two readings of a sensor that are kept for that; how many
readings, and flat things, are kept.
"""

WALLS_S = 0.2
"""s between two masks."""


class WallsAhead:
    """`walls`: the filter that knows them."""

    def __init__(self, config: SonarConfig, walls: WallFilter) -> None:
        self._config, self._filter = config, walls
        self._square_cos = math.cos(0.5 * config.field_of_view - EDGE)
        self._heard: dict[str, tuple[float, int, Pose]] = {}  # (s, wall, mount) of a sensor's newest echo of a wall
        self._open: dict[int, set[int]] = defaultdict(set)
        self._recent: dict[float, deque[tuple[str, float, float, float, float]]] = {}  # of the sensors of one side
        self._faces: deque[tuple[float, np.ndarray]] = deque(maxlen=FACES)
        self._face_of: dict[str, np.ndarray] = {}  # the newest that a sensor found
        self._looks: deque[tuple[str, float, float, float, float]] = deque(maxlen=LOOKS)  # sensor, x, y, axis, m
        # (s, points, points if it stood square to the walls) of what a sensor cannot measure
        self._too_near: dict[str, tuple[float, np.ndarray, np.ndarray]] = {}
        self._toward, self._back, self._now = 1.0, 0.0, -math.inf  # the way it drives; m that it has come back

    def moved(self, forward: float) -> None:
        """The robot moved so many m forward."""
        self._back = max(0.0, self._back - forward * self._toward)
        if self._back > TURNS_BACK:
            self._toward, self._back = -self._toward, 0.0

    def on_range(self, stamp: float, name: str, mount: Pose, distance: float, wall: int) -> None:
        """A reading (s, m) of a sensor at a mount (x, y, yaw), and the wall that it is of; -1: of none."""
        self._now = stamp
        ahead, along, steep = foot(self._filter.walls, *self._filter.sensor(mount))
        steps = np.round(along / STEP).astype(int)
        if abs(math.sin(mount[2])) >= ASIDE:
            self._look(name, mount, distance)
        before = self._too_near.pop(name, None)
        if before is not None and distance >= self._config.range_min_range:
            self._face_of.pop(name, None)
        if wall >= 0:
            self._heard[name] = stamp, wall, mount
            self._open[wall].difference_update(_about(steps[wall]))
            return
        self._find_faces(stamp, name, mount, distance)
        _, last, _ = self._heard.get(name, (0.0, -1, mount))
        nearest = self._config.range_min_range
        if distance < nearest:
            if last >= 0 and 0.0 < ahead[last] < TOO_NEAR * nearest and steep[last] <= self._config.steepest:
                self._heard[name] = stamp, last, mount
            elif abs(math.sin(mount[2])) >= ASIDE:
                square = self._beside(before[2] if before else None, mount)
                self._face_of[name] = self._beside(self._face_of.get(name), mount)
                self._too_near[name] = stamp, self._face_of[name], square
        through = (ahead > 0.0) & (ahead < NEAR) & (steep < SQUARE) & (distance > ahead + THROUGH)
        for passed in np.flatnonzero(through).tolist():
            self._open[passed].update(_about(steps[passed]))
            if passed == last:
                del self._heard[name]

    def _look(self, name, mount, distance):
        x, y, axis = self._filter.sensor(mount)
        looks = self._looks
        last = next((at for at in range(len(looks) - 1, -1, -1) if looks[at][0] == name), None)
        if last is not None and math.dist(looks[last][1:3], (x, y)) < LOOK_M:
            looks[last] = (*looks[last][:3], axis, distance)
        else:
            looks.append((name, x, y, axis, distance))

    def _find_faces(self, stamp, name, mount, distance):
        x, y, axis = self._filter.sensor(mount)
        yaw = self._filter.pose[2]
        if not NEAREST <= distance <= NEAR or abs(math.sin(mount[2])) < ASIDE:
            return
        recent, newest = self._recent.setdefault(round(mount[2], 2), deque(maxlen=RECENT)), (x, y, axis, distance)
        own = [row[1:] for row in recent if row[0] == name and math.dist(row[1:3], (x, y)) <= TOGETHER]
        others = [row[1:] for row in recent if row[0] != name]
        if not own or math.dist(own[-1][:2], (x, y)) >= APART:
            recent.append((name, *newest))
        own.append(newest)
        end = self._to_front(mount) + FACE_BEYOND
        for rows in (own, others[-len(own) :] + own):
            found = face(np.array(rows), yaw, self._toward)
            if found is not None:
                self._face_of[name] = points(found, (x, y, axis), STEP, end)
                self._faces.append((stamp, self._face_of[name]))

    def _to_front(self, mount):
        """m from a sensor on to the robot's front, as it drives."""
        return 0.5 * self._config.body_length - self._toward * mount[0]

    def _beside(self, line, mount):
        """(n, 2) points m of what is too near to be measured by a sensor: of a line (k, 2) that is known of it; where
        that is none, or is not as near, as if it stood square to the walls.
        """
        x, y, axis = self._filter.sensor(mount)
        if line is not None and len(line) > 1:
            dx, dy = (line[1] - line[0]) / math.dist(*line[:2])
            rx, ry = line[0, 0] - x, line[0, 1] - y
            along, facing = -rx * dx - ry * dy, math.cos(axis) * dy - math.sin(axis) * dx
            if 0.0 < (rx * dy - ry * dx) * math.copysign(1.0, facing) < TOO_NEAR * self._config.range_min_range:
                end = along + self._to_front(mount) + FACE_BEYOND
                return line[0] + np.arange(along - BEHIND, end, STEP)[:, None] * (dx, dy)
        far = TAKEN_FOR * self._config.range_min_range
        yaw = float(squared(self._filter.pose[2], heading_of(self._filter.walls[:, 0])))
        end = math.copysign(1.0, mount[0])
        dx, dy = end * math.cos(yaw), end * math.sin(yaw)
        begin = x + far * math.cos(axis), y + far * math.sin(axis)
        return begin + np.arange(0.0, 0.5 * self._config.body_length - abs(mount[0]), STEP)[:, None] * (dx, dy)

    def _pieces(self, trail, doorways):
        """Points (n, 2) m of each thing beside the robot, STEP apart; trail: where it has been; doorways: Doorways."""
        found = []
        for since, wall, mount in self._heard.values():
            theta, rho = self._filter.walls[wall].tolist()
            ahead, along, _ = foot(self._filter.walls[wall : wall + 1], *self._filter.sensor(mount))
            if self._now - since > WALL_KEPT_S or not 0.0 < ahead[0] < NEAR:
                continue
            toward = math.copysign(1.0, self._toward * math.sin(self._filter.pose[2] - theta))
            end = self._to_front(mount) + WALL_BEYOND
            places = along[0] + toward * np.arange(-BEHIND, end, STEP)
            c, s = math.cos(theta), math.sin(theta)
            shut = ~np.isin(np.round(places / STEP).astype(int), list(self._open[wall]))
            line = np.column_stack((c * rho - s * places, s * rho + c * places))
            shut &= ~doorways.hold(line, self._config.body_width)
            found.append(line[: int(np.argmin(np.append(shut, False)))])
        found += [self._shut(line, doorways) for since, line in self._faces if self._now - since <= FACE_KEPT_S]
        too_near = [of for since, *of in self._too_near.values() if self._now - since <= WALL_KEPT_S]
        found += [self._shut(line, doorways, square) for line, square in too_near]
        found = [line for line in found if len(line)]
        near = _near(np.concatenate(found), np.array(trail), self._config) if found and len(trail) else np.empty((0, 3))
        return [line[: int(np.argmax(np.append(self._walked(line, near), True)))] for line in found]

    def _shut(self, line, doorways, square=None):
        """A flat thing's points (n, 2) up to where a sensor looked through it squarely. A doorway's post has none: it
        seems to come nearer as the robot drives up to it. square: points of what is too near to be measured, for it may
        be longer than a post, such as a table beside another one.
        """
        if len(line) < 2:
            return line
        along = (line[1] - line[0]) / math.dist(*line[:2])
        at_post = doorways.with_post_at(line[0], along)
        if len(at_post.middles):
            line = line[:0] if square is None else square[at_post.behind_posts(square, along)]
        if not (len(line) and self._looks):
            return line
        x, y, axis, distance = np.array([look[1:] for look in self._looks]).T
        dx, dy = line[0, 0] - x, line[0, 1] - y
        step = np.round(-(dx * along[0] + dy * along[1]) / STEP)
        across = dy * along[0] - dx * along[1]  # to the left of the line's way
        facing = (np.cos(axis) * -along[1] + np.sin(axis) * along[0]) * np.sign(across)
        through = (facing > self._square_cos) & (distance > np.abs(across) + THROUGH)
        opened = step[through & (step > SURE) & (step < len(line))]
        return line[: int(opened.min()) - OPENS] if len(opened) else line

    def _walked(self, places, trail):
        """bool (n,): which places (n, 2) lie where the body was."""
        c, s = cos_sin(trail[:, 2])
        dx, dy = (places[:, None, axis] - trail[:, axis] for axis in (0, 1))
        length, width = 0.5 * self._config.body_length, 0.5 * self._config.body_width
        return ((np.abs(c * dx + s * dy) < length) & (np.abs(c * dy - s * dx) < width)).any(1)

    def mask(self, trail: Sequence[Pose], settled: Pose, doorways: Doorways = NO_DOORWAYS) -> GridMap:
        """What stands beside the robot at the newest reading, as a map. trail: where it has been; settled: the frame of
        the filter in the map's; doorways: the map's, in the frame of the filter.
        """
        places = np.vstack((*self._pieces(trail, doorways), np.empty((0, 2))))
        c, s = math.cos(settled[2]), math.sin(settled[2])
        resolution = self._config.resolution
        cells = np.floor((settled[:2] + places @ np.array(((c, s), (-s, c)))) / resolution).astype(int)
        corner = cells.min(0) if len(cells) else np.zeros(2, int)
        columns, rows = (cells - corner).T
        data = np.full((rows.max(initial=0) + 1, columns.max(initial=0) + 1), FREE, np.int8)
        data[rows, columns] = OCCUPIED
        height, width = data.shape
        x, y = (corner * resolution).tolist()
        return GridMap(data, GridGeometry(width, height, resolution, x, y))


def same(mask: GridMap | None, other: GridMap) -> bool:
    """Whether two masks say the same; None says nothing yet."""
    return mask is not None and mask.geometry == other.geometry and np.array_equal(mask.data, other.data)


def _near(places, trail, config):
    """Those of the poses of a trail (k, 3), which grows with the way, where the body may have been at places (n, 2)."""
    reach = 0.5 * math.hypot(config.body_length, config.body_width)
    inside = (trail[:, :2] >= places.min(0) - reach) & (trail[:, :2] <= places.max(0) + reach)
    return trail[inside.all(1)]


def _about(step):
    return range(step - OPENS, step + OPENS + 1)
