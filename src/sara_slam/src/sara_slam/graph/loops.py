"""Loops: earlier key scans at the place of the newest one, and the test against false ones.

A scan is matched with a group of earlier ones whose place it may share, in a window that grows with the way driven
since. A match is a hypothesis; it must fit (response) and must not look through walls that were seen (agreement). Where
the window is narrow, that is enough. Where it is wide, several hypotheses of scans in a row must tell of the same
displacement before all count, as the pairwise consistency of Olson (2009, Recognizing places using spectrally
clustered local matches) asks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sara_common.planar import compose, inverse, wrap
from sara_slam.graph.pose_graph import PoseGraph
from sara_slam.matching.likelihood_grid import LikelihoodGrid, Match, Window

SURE = 0.15
"""m of a standard deviation up to which a single match is believed."""
AWAKE = 12
"""Nodes after which a hypothesis that nothing bears out is forgotten."""
SAME_PLACE, SAME_TURN = 0.25, 0.06
"""m and rad that two hypotheses of one displacement may differ."""
SIGMAS, NARROWEST = 3.0, 0.2
"""Standard deviations that a window reaches, and m that it reaches at least."""


class LoopRules(NamedTuple):
    """drift: standard deviation of the place after 1 m of way, m; widest: m of the widest window; response, agreement:
    the least of a match that counts; together: how many hypotheses of a wide window must agree; reach: m from the
    newest scan within which earlier ones are matched; behind: how many scans before the newest are no loop; beside: how
    many scans on each side of the nearest one are matched together; most: groups that are matched for one scan.
    """

    drift: float = 0.012
    widest: float = 5.0
    response: float = 0.55
    agreement: float = 0.93
    together: int = 4
    reach: float = 3.0
    behind: int = 20
    beside: int = 8
    most: int = 2


class Hypothesis(NamedTuple):
    """The node `new` has the pose `relation` in the frame of the node `old`, by a match."""

    old: int
    new: int
    relation: tuple[float, float, float]
    match: Match
    sure: bool


class LoopSearch:
    """`grid_of`: called with node numbers, a pose and a margin (m), gives the LikelihoodGrid of these nodes' scans
    about that pose, or None where they show nothing there.
    """

    def __init__(
        self, graph: PoseGraph, rules: LoopRules, grid_of: Callable[[list[int], tuple, float], LikelihoodGrid | None]
    ):
        self.graph, self.rules, self._grid_of = graph, rules, grid_of
        self._waiting: list[Hypothesis] = []
        self.counts = {'tried': 0, 'weak': 0, 'contradicted': 0, 'far off': 0, 'waiting': 0, 'sure': 0, 'borne out': 0}

    def found(self, points: np.ndarray) -> list[Hypothesis]:
        """Hypotheses to count from now on, of the newest node, whose scan has these points (n, 2), and of those before
        that it bears out.
        """
        counted = []
        for group, sigma in self._groups():
            hypothesis = self._tried(points, group, sigma)
            if hypothesis is None:
                continue
            if hypothesis.sure:
                self.counts['sure'] += 1
                counted.append(hypothesis)
            else:
                counted += self._borne_out(hypothesis)
        return counted

    def _groups(self):
        """[(nodes in a row, standard deviation of their place, m)] to be matched, nearest first."""
        new, rules = len(self.graph.poses) - 1, self.rules
        if new <= rules.behind:
            return []
        poses = np.array(self.graph.poses)
        ways = self.graph.ways(new)[: new - rules.behind]
        sigmas = 0.03 + rules.drift * ways
        off = np.hypot(*(poses[: len(ways), :2] - poses[new, :2]).T)
        near = np.flatnonzero(off < rules.reach + np.minimum(SIGMAS * sigmas, rules.widest))
        rows = np.split(near, np.flatnonzero(np.diff(near) > 3) + 1) if len(near) else []
        turn = np.abs(wrap(poses[: len(ways), 2] - poses[new, 2]))
        found = []
        for row in sorted((row for row in rows if len(row) >= 3), key=lambda row: off[row].min())[: rules.most]:
            middle = row[np.argmin(off[row] + 0.5 * turn[row])]
            found.append((int(middle), float(sigmas[middle])))
        return found

    def _tried(self, points, middle, sigma):
        graph, rules = self.graph, self.rules
        new = len(graph.poses) - 1
        nodes = list(range(max(0, middle - rules.beside), min(new - rules.behind, middle + rules.beside + 1)))
        sure = sigma <= SURE
        shift = min(max(SIGMAS * sigma, NARROWEST), rules.widest)
        window = Window(shift, min(0.1 + 0.1 * shift, 0.6), max(sigma, 0.1), 0.05 + 0.05 * sigma)
        grid = self._grid_of(nodes, graph.poses[new], shift)
        self.counts['tried'] += 1
        if grid is None:
            return None
        match = grid.match(points, graph.poses[new], window)
        if match.response < rules.response:
            self.counts['weak'] += 1
            return None
        if not match.agreement >= rules.agreement:
            self.counts['contradicted'] += 1
            return None
        if math.dist(match.pose[:2], graph.poses[new][:2]) > shift:
            self.counts['far off'] += 1
            return None
        return Hypothesis(middle, new, compose(inverse(graph.poses[middle]), match.pose), match, sure)

    def _borne_out(self, hypothesis):
        """The hypotheses that are believed now: this one and those before that agree with it, if they are enough."""
        self._waiting = [other for other in self._waiting if hypothesis.new - other.new <= AWAKE]
        alike = [other for other in self._waiting if self._agree(other, hypothesis)]
        self._waiting.append(hypothesis)
        self.counts['waiting'] += 1
        if len(alike) + 1 < self.rules.together:
            return []
        counted = [*alike, hypothesis]
        gone = set(map(id, counted))
        self._waiting = [other for other in self._waiting if id(other) not in gone]
        self.counts['borne out'] += len(counted)
        return counted

    def _agree(self, one, two):
        """Whether the way round by both hypotheses and by the graph's edges between their nodes ends where it began."""
        poses = self.graph.poses
        by_two = compose(compose(inverse(poses[one.old]), poses[two.old]), two.relation)
        by_one = compose(one.relation, compose(inverse(poses[one.new]), poses[two.new]))
        x, y, turn = compose(inverse(by_one), by_two)
        return math.hypot(x, y) < SAME_PLACE and abs(turn) < SAME_TURN
