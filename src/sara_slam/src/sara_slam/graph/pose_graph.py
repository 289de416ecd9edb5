"""A pose graph of planar poses, optimised by GTSAM (Dellaert and Kaess 2006): nodes are poses, edges their relations.

Loops that the optimum of all edges contradicts start a search for the false ones among them, by graduated
non-convexity (Yang et al. 2020); these are taken out.
"""

from __future__ import annotations

from typing import NamedTuple

import gtsam
import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from sara_common.planar import compose, inverse, wrap

Pose = tuple[float, float, float]
LEAST_SIGMA = np.array([0.01, 0.01, 0.002])
"""m, m, rad that are added to each edge's standard deviations: of the model's own errors."""
FALSE_FROM = 5.0
"""Standard deviations that an optimum may be off a loop's edge."""
ITERATIONS, TOLERANCE = 30, 1e-5


class Edge(NamedTuple):
    """The pose `relation` (x, y, yaw) of the node `second` in the frame of the node `first`; its covariance (3, 3) in
    the frame of `second`; loop: whether it closes a loop; length: m that it adds to a way along the graph.
    """

    first: int
    second: int
    relation: Pose
    covariance: np.ndarray
    loop: bool
    length: float

    def deviation(self, poses: list[Pose]) -> float:
        """How many standard deviations poses are off this edge."""
        here = compose(inverse(poses[self.first]), poses[self.second])
        off = np.array(compose(inverse(self.relation), here))
        return float(np.sqrt(off @ np.linalg.solve(self.covariance, off)))


def turned(covariance: np.ndarray, yaw: float) -> np.ndarray:
    """(3, 3) covariance of x, y, yaw in a frame that is turned by yaw (rad) against the one it is given in."""
    c, s = np.cos(yaw), np.sin(yaw)
    M = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return M @ covariance @ M.T


class PoseGraph:
    """`poses`: one of each node, in the frame of the first; `edges`. Node 0 stays where it is."""

    def __init__(self) -> None:
        self.poses: list[Pose] = []
        self.edges: list[Edge] = []
        self._graph = gtsam.NonlinearFactorGraph()
        self._entered = 0  # of self.edges that are in self._graph

    def add_node(self, pose: Pose) -> int:
        """A node at a pose; its number."""
        self.poses.append((float(pose[0]), float(pose[1]), float(wrap(pose[2]))))
        return len(self.poses) - 1

    def add_edge(self, first: int, second: int, pose: Pose, covariance: np.ndarray, loop: bool = False) -> Edge:
        """An edge by the pose that a match gave the node `second` where `first` is now, with its covariance (3, 3)
        along the axes of the graph's frame.
        """
        relation = compose(inverse(self.poses[first]), pose)
        own = turned(covariance, pose[2]) + np.diag(LEAST_SIGMA**2)
        length = 0.0 if loop else float(np.hypot(*relation[:2]))
        edge = Edge(first, second, relation, own, loop, length)
        self.edges.append(edge)
        return edge

    def ways(self, node: int) -> np.ndarray:
        """(nodes,) the length of the shortest way along the graph from a node to each, m: loops cost nothing."""
        count = len(self.poses)
        ends = np.array([(edge.first, edge.second) for edge in self.edges]).reshape(-1, 2)
        lengths = np.array([max(edge.length, 1e-6) for edge in self.edges])
        graph = csr_matrix((lengths, (ends[:, 0], ends[:, 1])), (count, count))
        return dijkstra(graph, directed=False, indices=node)

    def optimise(self) -> list[Edge]:
        """Move the poses to where they agree best with the edges (Levenberg and Marquardt); returns the loops' edges
        that are false and taken out.
        """
        found = gtsam.LevenbergMarquardtOptimizer(self._factors(), self._values(), _parameters()).optimize()
        poses = _poses(found)
        if all(edge.deviation(poses) <= FALSE_FROM for edge in self.edges if edge.loop):
            self.poses[:] = poses
            return []
        false = self._contradicting()
        gone = set(map(id, false))
        self.edges = [edge for edge in self.edges if id(edge) not in gone]
        self._graph, self._entered = gtsam.NonlinearFactorGraph(), 0
        found = gtsam.LevenbergMarquardtOptimizer(self._factors(), self._values(), _parameters()).optimize()
        self.poses[:] = _poses(found)
        return false

    def _contradicting(self):
        """Loops that do not agree with most edges. All others are taken for true."""
        parameters = gtsam.GncLMParams(_parameters())
        parameters.setLossType(gtsam.GncLossType.TLS)
        true = [0, *(number for number, edge in enumerate(self.edges, 1) if not edge.loop)]
        parameters.setKnownInliers(true)
        search = gtsam.GncLMOptimizer(self._factors(), self._values(), parameters)
        search.setInlierCostThresholds(0.5 * FALSE_FROM**2)
        search.optimize()
        weights = search.getWeights()
        return [edge for number, edge in enumerate(self.edges, 1) if edge.loop and weights[number] < 0.5]

    def _factors(self):
        """GTSAM's graph of all edges; factor 0 holds the first node where it is."""
        if not self._entered:
            fixed = gtsam.noiseModel.Diagonal.Sigmas(np.full(3, 1e-4))
            self._graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(*self.poses[0]), fixed))
        for edge in self.edges[self._entered :]:
            noise = gtsam.noiseModel.Gaussian.Covariance(edge.covariance)
            self._graph.add(gtsam.BetweenFactorPose2(edge.first, edge.second, gtsam.Pose2(*edge.relation), noise))
        self._entered = len(self.edges)
        return self._graph

    def _values(self):
        values = gtsam.Values()
        for number, pose in enumerate(self.poses):
            values.insert(number, gtsam.Pose2(*pose))
        return values


def _parameters():
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setMaxIterations(ITERATIONS)
    parameters.setRelativeErrorTol(TOLERANCE)
    return parameters


def _poses(values):
    found = (values.atPose2(number) for number in range(values.size()))
    return [(pose.x(), pose.y(), wrap(pose.theta())) for pose in found]
