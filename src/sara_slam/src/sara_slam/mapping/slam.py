"""slam_gmapping without ROS: scans and odometry in; the pose in the map, the graph of poses and the map out.

A scan becomes a key scan once the robot has moved by `linearUpdate` or turned by `angularUpdate` since the last one.
It is matched with the last `local_scans` key scans about the pose that the odometry predicts, and joins the pose graph
by that match. Loops are looked for (graph.loops); when one is found, the graph is optimised.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sara_common.planar import compose, inverse, wrap
from sara_localization.particles.odometry_watch import UNKNOWN_SIGMA, OdometryWatch
from sara_localization.particles.scan_input import ScanInput
from sara_nav.maps.map_io import GridMap
from sara_slam.graph.loops import LoopSearch
from sara_slam.graph.pose_graph import PoseGraph
from sara_slam.mapping.journal import Journal
from sara_slam.mapping.key_scan import KeyScan, key_scan
from sara_slam.mapping.known_scans import KnownScans
from sara_slam.mapping.occupancy import Occupancy
from sara_slam.mapping.odometry_errors import Motion, OdometryErrors, along, speed_of
from sara_slam.mapping.resuming import found_again, restored
from sara_slam.mapping.slam_config import SlamConfig
from sara_slam.matching import surfaces
from sara_slam.matching.likelihood_grid import Match, Window

Pose = tuple[float, float, float]
LEAST_POINTS = 10
"""Echoes without which a scan is not matched."""
LEAST_SIGMA = 0.02, 0.02
"""m and rad that the odometry may be off besides what it has moved."""
MOST_SIGMA = 10.0, math.pi
"""m and rad: a motion that is less certain is not known at all."""
JUMP = 20.0
"""m between two scans used that the odometry cannot have driven."""
LONGEST_GAP = 2.0
"""s of OdometryWatch."""
FAR = 1000.0
"""m from its origin where the odometry may be at first: the map has that frame; from further off it begins at 0, 0."""
NARROWEST, WIDEST = (0.25, 0.2), (1.0, 0.7)
"""m and rad of the window about the odometry's prediction."""
SIGMAS = 3.0
SEEK_S = 1.0
"""s between two tries to find the robot in a map that is gone on with."""
POSTPONED, SHARE, AT_ONCE = 10, 100, 0.05
"""Loops that are collected before the graph is optimised, or one for so many edges, where that is more; m from which on
a loop's displacement is heeded at once.
"""


class Result(NamedTuple):
    """What a scan led to. map_from_odom: see Slam. used: it is a key scan; changed: poses of earlier scans moved."""

    map_from_odom: Pose | None
    used: bool
    changed: bool


class Slam:
    """`counts`: Counter of what became of the scans and loops; `say`: called with one sentence per kind of trouble.
    `journal`: where everything is kept; with what it holds from before, the map is gone on with.
    """

    def __init__(
        self,
        config: SlamConfig,
        say: Callable[[str], None] = lambda sentence: None,
        journal: Journal | None = None,
    ):
        """Raises JournalError where the journal is another program's."""
        surfaces.warm()
        self.config, self.say = config, say
        self.counts, self._said = Counter(), set()
        self.graph, self.scans = PoseGraph(), []
        self.loops = LoopSearch(self.graph, config.loop_rules, self._grid_of)
        self._occupancy = Occupancy(
            config.delta, config.occ_thresh, (config.xmin, config.ymin, config.xmax, config.ymax)
        )
        self.map_from_odom: Pose | None = (0.0, 0.0, 0.0)  # None while the robot is looked for in a resumed map
        self.covariance = np.zeros((3, 3))
        self._postponed, self._known = 0, KnownScans(self.scans, self.graph.poses)
        self._watch = OdometryWatch(LONGEST_GAP)
        self._odometry: Pose | None = None  # when a scan was last used
        self._speed = 0.0
        self.errors = OdometryErrors((config.scale_sigma, config.delay_sigma))
        self._journal, self._sought = journal, -math.inf
        if journal is not None and journal.records:
            self._resume(journal)

    def _resume(self, journal):
        scans, self._postponed = restored(journal, self.graph)
        self.scans += scans
        self.counts.update(used=len(self.scans), loops=sum(edge.loop for edge in self.graph.edges))
        if self.scans:
            self.map_from_odom = None

    @property
    def poses(self) -> list[Pose]:
        """Where the robot was at each key scan (x, y, yaw), in the map."""
        return self.graph.poses

    @property
    def entropy(self) -> float:
        """Differential entropy of the newest pose's distribution as its match tells, nat: greater is less certain."""
        return 0.5 * (3.0 * math.log(2.0 * math.pi * math.e) + float(np.linalg.slogdet(self.covariance)[1]))

    def map(self) -> GridMap:
        """The map of all key scans at their poses; one unknown cell before the first."""
        grid = self._occupancy.draw(self.scans, self.graph.poses)
        if self._occupancy.left_out:
            self.trouble('map_full', 'the map has as many cells as memory holds: what lies further off is not on it')
        return grid

    def forget_odometry(self) -> None:
        """The clock or the odometry began anew: its next pose is no motion."""
        self._odometry = None

    def on_scan(self, scan: ScanInput) -> Result | None:
        """Take a scan; None where it cannot be used."""
        fault = scan.fault
        if fault:
            kind, wrong = fault
            self.trouble(kind, f'{scan.frame}: {wrong}: dropped')
            return None
        if self.config.deskew and scan.ended is None and scan.sweep.duration > 0.0:
            long = f'its rays take {scan.sweep.duration:g} s by its time_increment, and count as cast at its stamp'
            self.trouble('not_deskewed', f'{scan.frame}: {long}')
        self.counts['scans'] += 1
        odometry = (*scan.odometry.translation[:2], scan.odometry.yaw)
        self._look_for_jump(scan.sweep.stamp, odometry)
        if self.counts['scans'] % self.config.throttle_scans or not self._is_due(scan.sweep.stamp, odometry):
            return Result(self.map_from_odom, False, False)
        key = key_scan(scan if self.config.deskew else scan._replace(ended=None), self.config.limits)
        speed = speed_of(scan)
        if self.map_from_odom is None:
            if not self._rejoin(key):
                return Result(None, False, False)
            changed = False
        else:
            changed = self._join(key, speed)
        self._odometry, self._speed = odometry, speed
        self.counts['used'] += 1
        self.map_from_odom = compose(self.graph.poses[-1], inverse(odometry))
        return Result(self.map_from_odom, True, changed)

    def finish(self) -> None:
        """Optimise the graph with the loops that were postponed."""
        if self._postponed:
            self._optimise()

    def _look_for_jump(self, stamp, odometry):
        """The wheels' controller may have begun anew since the scan before."""
        jump = self._watch.jump(stamp, odometry)
        if jump and self._odometry is not None:
            self.trouble('jump', f'{jump}: that is no motion')
            self.forget_odometry()

    def _is_due(self, stamp, odometry):
        if self.map_from_odom is None:
            return not 0.0 <= stamp - self._sought < SEEK_S
        if self._odometry is None:
            return True
        c, last = self.config, self._odometry
        way, turn = math.dist(odometry[:2], last[:2]), abs(float(wrap(odometry[2] - last[2])))
        waited = c.temporalUpdate >= 0.0 and not 0.0 <= stamp - self.scans[-1].stamp < c.temporalUpdate
        return way >= c.linearUpdate or turn >= c.angularUpdate or waited

    def _join(self, key: KeyScan, speed: float) -> bool:
        """A scan becomes a node of the graph; returns whether earlier poses moved. speed: m/s, by the odometry."""
        self.scans.append(key)
        if len(self.scans) == 1:
            x, y, yaw = key.odometry
            self.graph.add_node(key.odometry if math.hypot(x, y) <= FAR else (0.0, 0.0, yaw))
            self.covariance = np.diag((*2 * (LEAST_SIGMA[0] ** 2,), LEAST_SIGMA[1] ** 2))
            self._keep(lambda journal: journal.scan(key, self.graph.poses[0], None))
            return False
        last = self.graph.poses[-1]
        motion, sigmas = None, UNKNOWN_SIGMA
        if self._odometry is not None:
            driven = compose(inverse(self._odometry), key.odometry)
            if math.hypot(*driven[:2]) > JUMP:
                self.trouble('jump', f'the odometry jumps by {math.hypot(*driven[:2]):.3g} m: that is no motion')
            else:
                motion, sigmas = Motion(driven, speed - self._speed), self._sigmas(driven)
        pose = last if motion is None else compose(last, self.errors.without(motion))
        match = self._match(key, pose, sigmas)
        if match is None:
            self.covariance = np.diag((sigmas[0] ** 2, sigmas[0] ** 2, sigmas[1] ** 2))
            self.errors.end_stretch()
        else:
            pose, self.covariance = match.pose, match.covariance
            if motion is not None:
                self.errors.heard(motion, compose(inverse(last), pose), along(self.covariance, pose[2]))
        self._add(key, len(self.scans) - 2, pose)
        return self.config.loop_closing and self._close_loops(key)

    def _add(self, key, old, pose):
        """A node for a key scan at a pose, joined to the node `old` by a match of this covariance."""
        new = self.graph.add_node(pose)
        edge = self.graph.add_edge(old, new, pose, self.covariance)
        self._keep(lambda journal: journal.scan(key, self.graph.poses[new], edge))

    def _rejoin(self, key):
        """Whether a scan tells where the robot is in a map that is gone on with; then it becomes a node."""
        self._sought = key.stamp
        config = self.config
        found = found_again(key, self.graph.poses, self._known.grid, config.grain, config.loop_rules)
        if found is None:
            self.trouble(
                'not_found', 'where the map ended, nothing looks as the scanner sees it: the robot is looked for'
            )
            return False
        old, match = found
        self.scans.append(key)
        self.covariance = match.covariance
        self._add(key, old, match.pose)
        return True

    def _keep(self, write):
        """Write into the journal; where that fails, it is told, and mapping goes on without."""
        try:
            if self._journal is not None:
                write(self._journal)
        except OSError as error:
            self._journal = None
            self.trouble('not_kept', f'{error}: after a restart the map ends here')

    def _sigmas(self, motion):
        """Standard deviations (m, rad) of a motion (x, y, yaw) of the odometry, by gmapping's law."""
        c, way, turn = self.config, math.hypot(*motion[:2]), abs(motion[2])
        shift, angle = LEAST_SIGMA[0] + c.srr * way + c.str * turn, LEAST_SIGMA[1] + c.stt * turn + c.srt * way
        return min(shift, MOST_SIGMA[0]), min(angle, MOST_SIGMA[1])

    def _match(self, key, predicted, sigmas) -> Match | None:
        """The match of a scan about the pose that the odometry predicts, with these standard deviations (m, rad)."""
        c = self.config
        shift, turn = (min(max(SIGMAS * sigma, least), most) for sigma, least, most in zip(sigmas, NARROWEST, WIDEST))
        points = key.points(c.lskip + 1)
        before = range(max(0, len(self.scans) - 1 - c.local_scans), len(self.scans) - 1)
        grid = None
        if len(points) >= LEAST_POINTS:
            grid = self._known.grid(key, before, predicted, shift, c.grain, cleared=False)
        if grid is None:
            self.counts['no_points'] += 1
            return None
        match = grid.match(points, predicted, Window(shift, turn, *sigmas))
        if match.response < c.minimum_response or match.score < c.minimumScore:
            self.counts['no_fit'] += 1
            return None
        return match

    def _grid_of(self, nodes, pose, margin):
        """For the search for loops of the newest scan."""
        return self._known.grid(self.scans[-1], nodes, pose, margin, self.config.grain)

    def _close_loops(self, key):
        points = key.points(self.config.lskip + 1)
        if len(points) < LEAST_POINTS:
            return False
        now = False
        for loop in self.loops.found(points):
            pose = compose(self.graph.poses[loop.old], loop.relation)
            off = math.dist(pose[:2], self.graph.poses[loop.new][:2])
            edge = self.graph.add_edge(loop.old, loop.new, pose, loop.match.covariance, loop=True)
            self._keep(lambda journal, edge=edge: journal.loop(edge))
            self.counts['loops'] += 1
            self._postponed += 1
            now = now or off > AT_ONCE
        if now or self._postponed >= max(POSTPONED, len(self.graph.edges) // SHARE):
            self._optimise()
            return True
        return False

    def _optimise(self):
        self._postponed = 0
        self.counts['optimised'] += 1
        before = list(self.graph.edges)
        false = set(map(id, self.graph.optimise()))
        self.counts['false_loops'] += len(false)
        dropped = [n for n, edge in enumerate(before) if id(edge) in false]
        self._keep(lambda journal: journal.optimised(dropped, self.graph.poses))

    def trouble(self, kind: str, sentence: str) -> None:
        """Count it, and say the first of its kind."""
        self.counts[kind] += 1
        if kind not in self._said:
            self._said.add(kind)
            self.say(sentence)
