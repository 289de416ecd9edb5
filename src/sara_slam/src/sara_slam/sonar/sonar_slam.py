"""Makes a map of odometry and of the readings of range sensors with wide cones."""

from __future__ import annotations

import heapq
import math
from bisect import bisect
from collections import Counter, deque
from itertools import count
from operator import itemgetter

import numpy as np

from sara_common.planar import between, compose, inverse, is_apart
from sara_nav.maps.map_io import GridMap
from sara_slam.sonar import arrow_system, forward_model, free_space, wall_search
from sara_slam.sonar.doorways import NO_DOORWAYS, Doorways
from sara_slam.sonar.drawing import Directions, Kept, Pose, Snapshot
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.wall_filter import POSE, WallFilter
from sara_slam.sonar.wall_graph import Solved
from sara_slam.sonar.walls_ahead import WallsAhead

NODE_M, NODE_RAD = 0.15, 0.15
"""Between two poses of the graph."""
RECENT_M, RECENT_N = 4.0, 400
"""Way, and readings, in which new walls are searched for."""
SEARCH_M, SEARCH_RAD = 0.15, 0.3
"""Between two searches."""
MOST_AT_NODE = 300
"""Readings of one sensor that are kept between two nodes: a robot that stands hears nothing new."""
WAIT_S, WAITING = 10.0, 1000
"""s of odometry, and readings, that are held until the other comes."""
LATE_S = 0.1
"""s, besides range_delay, by which a reading may be older than one that was taken before it. Where a sensor's clock is
ahead its readings are taken as of now, and those of all others are older by range_delay.
"""


class SonarSlam:
    """`counts`: what became of the readings. The frame of everything that it makes is the robot's first pose."""

    def __init__(self, config: SonarConfig):
        arrow_system.warm()
        free_space.warm()
        forward_model.warm()
        self.config, self.filter, self.counts = config, WallFilter(config), Counter()
        self._odometry = deque()  # (stamp, pose)
        self._waiting = []  # heap of (stamp, number, name, mount, range)
        self._numbered = count()
        self._here = None  # odometry of the filter's pose
        self._newest = None  # (stamp, odometry) of the newest reading taken
        self.nodes: list[Pose] = []  # odometry of the graph's poses
        self.first_guess: list[Pose] = []
        self.stamps: list[float] = []
        self.kept: list[Kept] = []
        self._numbers = {}  # of the sensors
        self._recent = deque()  # (number in kept, odometry of the sensor, range)
        self._searched = None
        self._at_node: Counter[int] = Counter()  # readings of a sensor since the newest node
        self._used, self._passed = {}, {}
        self._settled: Pose = (0.0, 0.0, 0.0)
        self._doorways = NO_DOORWAYS  # in the filter's frame
        self._ahead = WallsAhead(config, self.filter)

    def on_pose(self, stamp: float, pose: Pose) -> None:
        """The odometry has the robot at (x, y, yaw) at a time (s)."""
        if not (math.isfinite(stamp) and all(map(math.isfinite, pose))):
            self.counts['bad_pose'] += 1
            return
        if self._odometry and stamp <= self._odometry[-1][0]:
            return
        self._odometry.append((stamp, tuple(pose)))
        while self._odometry[0][0] < stamp - WAIT_S:
            self._odometry.popleft()
        while self._waiting and self._waiting[0][0] < stamp:
            of, _, *reading = heapq.heappop(self._waiting)
            self._take(of, *reading)

    def on_range(self, stamp: float, name: str, mount: Pose, distance: float) -> None:
        """A sensor at a mount (x, y, yaw) in the robot said a range (m, REP-117) at a time (s)."""
        if math.isnan(distance) or not math.isfinite(stamp):
            self.counts['bad_range'] += 1
            return
        if self._odometry and stamp > self._odometry[-1][0] + WAIT_S:  # a clock of its own: nobody else waits for it
            self.counts['no_pose'] += 1
            return
        heapq.heappush(self._waiting, (stamp - self.config.range_delay, next(self._numbered), name, mount, distance))
        if len(self._waiting) > WAITING:
            heapq.heappop(self._waiting)
            self.counts['no_pose'] += 1

    def _take(self, stamp, name, mount, distance):
        odometry = self._odometry
        oldest = stamp - self.config.range_delay - LATE_S
        while len(odometry) > 1 and odometry[1][0] <= oldest:
            odometry.popleft()
        after = bisect(odometry, stamp, key=itemgetter(0))
        if not 0 < after < len(odometry):
            self.counts['no_pose'] += 1
            return
        (t0, a), (t1, b) = odometry[after - 1], odometry[after]
        here = between(a, b, (stamp - t0) / (t1 - t0))
        if self._here is not None:
            self.filter.move(compose(inverse(self._here), here))
        self._here = here
        if self._newest is None or stamp >= self._newest[0]:  # a late reading is no drive back
            if self._newest is not None:
                self._ahead.moved(compose(inverse(self._newest[1]), here)[0])
            self._newest = stamp, here
        self._node(stamp, here)
        wall = -1
        if self.config.range_min_range <= distance <= self.config.range_max_range:
            wall = self._match(name, mount, distance, here)
        elif distance > self.config.range_max_range:
            self.counts['no_echo'] += 1
        self._ahead.on_range(stamp, name, mount, distance, wall)
        in_node = compose(inverse(self.nodes[-1]), compose(here, mount))
        number = self._numbers.setdefault(name, len(self._numbers))
        self._at_node[number] += 1
        if self._at_node[number] > MOST_AT_NODE:
            return
        self.kept.append(Kept(len(self.nodes) - 1, in_node, distance, wall, number))
        if wall < 0 and self.config.range_min_range <= distance <= self.config.range_max_range:
            self._recent.append((len(self.kept) - 1, compose(here, mount), distance))
            self._search(here)

    def _node(self, stamp, here):
        if self.nodes and not is_apart(self.nodes[-1], here, NODE_M, NODE_RAD):
            return
        self._at_node.clear()
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
        if last is None or is_apart(last, here, self.config.update_min_d, self.config.update_min_a):
            self._used[name] = here
            self.filter.see(wall, mount, distance)
            self.counts['used'] += 1
        self.filter.extend(wall, mount)
        return wall

    def _search(self, here):
        if self._searched is not None and not is_apart(self._searched, here, SEARCH_M, SEARCH_RAD):
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

    @property
    def map_from_odom(self) -> Pose:
        """(x, y, yaw) of the odometry's frame in the map, which is that of the first pose."""
        if self._here is None:
            return 0.0, 0.0, 0.0
        return compose(compose(self._settled, self.filter.pose), inverse(self._here))

    def walls_ahead(self) -> GridMap:
        """What stands beside the robot, drawn on ahead of where it is heard: a mask in the map's frame."""
        return self._ahead.mask(self.first_guess, self._settled, self._doorways)

    def snapshot(self) -> Snapshot:
        """What was heard so far, to draw the map of while more is heard."""
        state = self.filter
        first = Solved(np.array(self.first_guess), state.walls.copy(), state.x[3:POSE].copy())
        directions = Directions(state.square.copy(), state.reference, state.believed)
        return Snapshot(self.config, list(self.nodes), list(self.kept), first, directions)

    def settle(self, solved: Solved, doorways: Doorways = NO_DOORWAYS) -> None:
        """Go on with the pose that was solved of an earlier snapshot: map_from_odom fits the map drawn of that, which
        has such doorways.
        """
        last = len(solved.poses) - 1
        self._settled = compose(tuple(solved.poses[last].tolist()), inverse(self.first_guess[last]))
        self._doorways = doorways.seen_from(self._settled)

    def solved(self) -> Solved:
        """See Snapshot."""
        return self.snapshot().solved()

    def map(self, solved: Solved | None = None) -> GridMap:
        """See Snapshot."""
        return self.snapshot().map(solved)
