"""The pose graph of a recorded log, optimised from its odometry's chain by GTSAM and by scipy's sparse least squares.

    rosrun sara_slam bench_optimisers LOG

Prints processor seconds and the cost (half the sum of squared deviations) of each.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import coo_matrix

from sara_common.config import ConfigError
from sara_common.planar import compose, wrap
from sara_slam.graph.pose_graph import Edge, PoseGraph
from sara_slam.logs.bench_relations import MAX_USABLE, RANGE_MAX
from sara_slam.logs.records import LogError, read_log
from sara_slam.logs.replay import Replay
from sara_slam.mapping.slam import Slam
from sara_slam.mapping.slam_config import SlamConfig


class LeastSquares:
    """The edges' deviations and their derivatives with respect to all poses but the first, as scipy wants them."""

    def __init__(self, edges: list[Edge], first: tuple[float, float, float]):
        self._first = np.array([first])
        self.a, self.b = np.array([(edge.first, edge.second) for edge in edges]).T
        self.relations = np.array([edge.relation for edge in edges])
        self.roots = np.array([np.linalg.cholesky(np.linalg.inv(edge.covariance)).T for edge in edges])

    def _split(self, flat):
        poses = np.concatenate((self._first, flat.reshape(-1, 3)))
        one, two = poses[self.a], poses[self.b]
        return one, two, _inverse_rotations(one[:, 2]), _inverse_rotations(self.relations[:, 2])

    def residuals(self, flat: np.ndarray) -> np.ndarray:
        """(3 edges,) deviations, in standard deviations."""
        one, two, turn, back = self._split(flat)
        seen = np.einsum('nij,nj->ni', turn, two[:, :2] - one[:, :2])
        off = np.einsum('nij,nj->ni', back, seen - self.relations[:, :2])
        yaw = wrap(two[:, 2] - one[:, 2] - self.relations[:, 2])
        return np.einsum('nij,nj->ni', self.roots, np.column_stack((off, yaw))).ravel()

    def jacobian(self, flat: np.ndarray) -> coo_matrix:
        """Sparse (3 edges, 3 (poses - 1))."""
        one, two, turn, back = self._split(flat)
        seen = np.einsum('nij,nj->ni', turn, two[:, :2] - one[:, :2])
        by_one, by_two = np.zeros((2, len(one), 3, 3))
        by_two[:, :2, :2] = back @ turn
        by_one[:, :2, :2] = -by_two[:, :2, :2]
        by_one[:, :2, 2] = np.einsum('nij,nj->ni', back, np.column_stack((seen[:, 1], -seen[:, 0])))
        by_one[:, 2, 2], by_two[:, 2, 2] = -1.0, 1.0
        rows, columns, values = [], [], []
        for node, part in ((self.a, by_one), (self.b, by_two)):
            part = self.roots @ part
            row = 3 * np.arange(len(node))[:, None, None] + np.arange(3)[None, :, None] + np.zeros((1, 1, 3), int)
            column = 3 * (node - 1)[:, None, None] + np.arange(3)[None, None, :] + np.zeros((1, 3, 1), int)
            kept = np.broadcast_to((node > 0)[:, None, None], part.shape)
            rows, columns, values = [*rows, row[kept]], [*columns, column[kept]], [*values, part[kept]]
        flat_values = tuple(np.concatenate(parts) for parts in (values, rows, columns))
        return coo_matrix((flat_values[0], flat_values[1:]), (3 * len(one), len(flat))).tocsr()


def _inverse_rotations(angles):
    c, s = np.cos(angles), np.sin(angles)
    return np.stack((np.stack((c, s), 1), np.stack((-s, c), 1)), 1)


def chained(graph: PoseGraph) -> PoseGraph:
    """The same graph with its poses as the edges from scan to scan alone give them."""
    result = PoseGraph()
    result.add_node(graph.poses[0])
    for edge in graph.edges:
        if not edge.loop:
            result.add_node(compose(result.poses[edge.first], edge.relation))
    result.edges = list(graph.edges)
    return result


def compared(graph: PoseGraph) -> dict[str, tuple[float, float]]:
    """{optimiser: (processor seconds, cost)} from the chain."""
    begin, found = chained(graph), {}
    squares = LeastSquares(graph.edges, graph.poses[0])
    start = np.array(begin.poses[1:]).ravel()
    began = time.process_time()
    begin.optimise()
    seconds = time.process_time() - began
    found['gtsam'] = seconds, 0.5 * float(np.sum(squares.residuals(np.array(begin.poses[1:]).ravel()) ** 2))
    began = time.process_time()
    solved = least_squares(squares.residuals, start, squares.jacobian, tr_solver='lsmr', x_scale='jac')
    found['scipy'] = time.process_time() - began, float(solved.cost)
    return found


def main(argv: list[str] | None = None) -> None:
    """The program."""
    parser = argparse.ArgumentParser(prog='bench_optimisers', description=__doc__.split('\n\n')[0])
    parser.add_argument('log', metavar='LOG')
    arguments = parser.parse_args(sys.argv[1:] if argv is None else argv)
    try:
        slam = Slam(SlamConfig.from_params({'maxUrange': MAX_USABLE}))
        Replay(slam, RANGE_MAX).run(read_log(arguments.log))
    except (LogError, ConfigError, OSError) as error:
        sys.exit(f'bench_optimisers: {error}')
    print(f'{len(slam.poses)} poses, {len(slam.graph.edges)} edges')
    for name, (seconds, cost) in compared(slam.graph).items():
        print(f'{name}: {seconds:.2f} s, cost {cost:.1f}')
