"""Makes a map of odometry and of the readings of range sensors with wide cones."""

from __future__ import annotations

import math
from collections import Counter, deque
from typing import NamedTuple

import numpy as np

from sara_common.planar import between, compose, inverse, wrap
from sara_nav.maps.map_io import GridMap
from sara_slam.sonar import arrow_system, wall_search
from sara_slam.sonar.evidence_grid import draw
from sara_slam.sonar.forward_model import Heard, thinned
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.wall_filter import POSE, WallFilter
from sara_slam.sonar.wall_graph import Evidence, Solved, optimise

Pose = tuple[float, float, float]
NODE_M, NODE_RAD = 0.15, 0.15
"""Between two poses of the graph."""
RECENT_M, RECENT_N = 4.0, 400
"""Way, and readings, in which new walls are searched for."""
SEARCH_M, SEARCH_RAD = 0.15, 0.3
"""Between two searches."""


class Kept(NamedTuple):
    """A reading: the graph's pose it hangs on, the sensor there (x, y, yaw), range (m; REP-117), its wall, or -1, and
    the sensor's number.
    """

    node: int
    sensor: Pose
    range: float
    wall: int
    name: int


class SonarSlam:
    """`counts`: what became of the readings. The frame of everything that it makes is the robot's first pose."""

    def __init__(self, config: SonarConfig):
        arrow_system.warm()
        self.config, self.filter, self.counts = config, WallFilter(config), Counter()
        self._odometry = deque()  # (stamp, pose)
        self._waiting = deque()  # (stamp, name, mount, range)
        self._here = None  # odometry of the filter's pose
        self.nodes: list[Pose] = []  # odometry of the graph's poses
        self.first_guess: list[Pose] = []
        self.stamps: list[float] = []
        self.kept: list[Kept] = []
        self._numbers = {}  # of the sensors
        self._recent = deque()  # (number in kept, odometry of the sensor, range)
        self._searched = None
        self._used, self._passed = {}, {}

    def on_pose(self, stamp: float, pose: Pose) -> None:
        """The odometry has the robot at (x, y, yaw) at a time (s)."""
        if not (math.isfinite(stamp) and all(map(math.isfinite, pose))):
            self.counts['bad_pose'] += 1
            return
        if self._odometry and stamp <= self._odometry[-1][0]:
            return
        self._odometry.append((stamp, tuple(pose)))
        while self._waiting and self._waiting[0][0] <= stamp:
            self._take(*self._waiting.popleft())

    def on_range(self, stamp: float, name: str, mount: Pose, distance: float) -> None:
        """A sensor at a mount (x, y, yaw) in the robot said a range (m, REP-117) at a time (s)."""
        if math.isnan(distance) or not math.isfinite(stamp):
            self.counts['bad_range'] += 1
            return
        self._waiting.append((stamp - self.config.range_delay, name, mount, distance))

    def _take(self, stamp, name, mount, distance):
        odometry = self._odometry
        while len(odometry) > 1 and odometry[1][0] <= stamp:
            odometry.popleft()
        if len(odometry) < 2 or odometry[0][0] > stamp:
            self.counts['no_pose'] += 1
            return
        (t0, a), (t1, b) = odometry[0], odometry[1]
        here = between(a, b, (stamp - t0) / (t1 - t0))
        if self._here is not None:
            self.filter.move(compose(inverse(self._here), here))
        self._here = here
        self._node(stamp, here)
        wall = -1
        if self.config.range_min_range <= distance <= self.config.range_max_range:
            wall = self._match(name, mount, distance, here)
        elif distance > self.config.range_max_range:
            self.counts['no_echo'] += 1
        in_node = compose(inverse(self.nodes[-1]), compose(here, mount))
        number = self._numbers.setdefault(name, len(self._numbers))
        self.kept.append(Kept(len(self.nodes) - 1, in_node, distance, wall, number))
        if wall < 0 and self.config.range_min_range <= distance <= self.config.range_max_range:
            self._recent.append((len(self.kept) - 1, compose(here, mount), distance))
            self._search(here)

    def _node(self, stamp, here):
        if self.nodes and not _apart(self.nodes[-1], here, NODE_M, NODE_RAD):
            return
        self.nodes.append(here)
        self.first_guess.append(self.filter.pose)
        self.stamps.append(stamp)

    def _match(self, name, mount, distance, here):
        wall = self.filter.matched(mount, distance)
        before, self._passed[name] = self._passed.get(name), wall
        if wall < 0:
            self.counts['unexplained'] += 1
            return -1
        if before != wall:
            self.counts['first'] += 1
            return -1
        last = self._used.get(name)
        if last is None or _apart(last, here, self.config.update_min_d, self.config.update_min_a):
            self._used[name] = here
            self.filter.see(wall, mount, distance)
            self.counts['used'] += 1
        self.filter.extend(wall, mount)
        return wall

    def _search(self, here):
        if self._searched is not None and not _apart(self._searched, here, SEARCH_M, SEARCH_RAD):
            return
        self._searched = here
        recent = self._recent
        while len(recent) > RECENT_N or (recent and math.dist(recent[0][1][:2], here[:2]) > RECENT_M):
            recent.popleft()
        while recent:
            back = inverse(here)
            sensors = np.array([compose(back, sensor) for _, sensor, _ in recent])
            ranges = np.array([distance for _, _, distance in recent])
            half = 0.5 * self.config.field_of_view
            found = wall_search.search(sensors, ranges, half, self.config.range_sigma_hit)
            if found is None:
                return
            wall = self.filter.add((found.theta, found.rho), found.covariance, found.span)
            members = set(found.members.tolist())
            for number in (recent[place][0] for place in members):
                self.kept[number] = self.kept[number]._replace(wall=wall)
            self._recent = recent = deque(entry for place, entry in enumerate(recent) if place not in members)

    def solved(self) -> Solved:
        """All poses and walls as all readings agree best on them. There must have been a reading."""
        nodes = self.nodes
        relations = np.array([compose(inverse(a), b) for a, b in zip(nodes, nodes[1:])]).reshape(-1, 3)
        seen = [kept for kept in self.kept if kept.wall >= 0]
        evidence = Evidence(
            relations,
            np.array([kept.node for kept in seen], int),
            np.array([kept.wall for kept in seen], int),
            np.array([kept.sensor[:2] for kept in seen]).reshape(-1, 2),
            np.array([kept.range for kept in seen]),
        )
        state = self.filter
        first = Solved(np.array(self.first_guess), state.walls.copy(), state.x[3:POSE].copy())
        return optimise(self.config, first, evidence)

    def map(self, solved: Solved | None = None) -> GridMap:
        """The map. solved: what `solved` gave, where that is known. Raises ValueError before the first reading."""
        if not self.kept:
            raise ValueError('there is no map before the first reading of a sensor that has a pose')
        poses, walls, _ = solved or self.solved()
        sensors = np.array([compose(poses[kept.node], kept.sensor) for kept in self.kept])
        heard = Heard(sensors, np.array([kept.range for kept in self.kept]))
        names = np.array([kept.name for kept in self.kept])
        return draw(self.config, thinned(heard, names), walls, poses[:, :2])


def _apart(a, b, metres, radians):
    return math.dist(a[:2], b[:2]) >= metres or abs(wrap(a[2] - b[2])) >= radians
