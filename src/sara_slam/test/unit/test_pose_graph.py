"""The pose graph: exact without noise, the least squares' solution with it, false loops taken out."""

import math

import numpy as np
import pytest
from scipy.optimize import least_squares

from sara_common.planar import compose, inverse, wrap
from sara_slam.graph.pose_graph import LEAST_SIGMA, PoseGraph, turned
from sara_slam.logs.bench_optimisers import LeastSquares, chained, compared

SMALL = np.diag((0.02, 0.02, 0.01)) ** 2


def circle(count=24, radius=3.0):
    return [
        (radius * math.cos(a), radius * math.sin(a), wrap(a + 0.5 * math.pi))
        for a in np.arange(count) * 2.0 * math.pi / count
    ]


def chain(truth, rng=None, closing=True):
    """A graph of a drive: each pose by the one before, off by noise, and the last seen from the first."""
    graph = PoseGraph()
    graph.add_node(truth[0])
    for before, after in zip(truth, truth[1:]):
        step = compose(inverse(before), after)
        off = (0.0, 0.0, 0.0) if rng is None else rng.normal(0.0, (0.02, 0.02, 0.01))
        pose = compose(graph.poses[-1], compose(step, off))
        new = graph.add_node(pose)
        graph.add_edge(new - 1, new, pose, SMALL)
    if closing:
        last = len(truth) - 1
        graph.add_edge(0, last, compose(graph.poses[0], compose(inverse(truth[0]), truth[last])), SMALL, loop=True)
    return graph


def errors(graph, truth):
    return max(math.dist(a[:2], b[:2]) for a, b in zip(graph.poses, truth))


def test_without_noise_nothing_moves():
    truth = circle()
    graph = chain(truth)
    assert graph.optimise() == [] and errors(graph, truth) < 1e-6
    assert all(edge.deviation(graph.poses) < 1e-5 for edge in graph.edges)


def test_a_loop_takes_the_drift_away():
    truth = circle(60)
    before = after = ends_before = ends_after = 0.0
    for seed in range(10):
        graph = chain(truth, np.random.default_rng(seed))
        before += errors(graph, truth)
        ends_before += math.dist(graph.poses[-1][:2], truth[-1][:2])
        graph.optimise()
        after += errors(graph, truth)
        ends_after += math.dist(graph.poses[-1][:2], truth[-1][:2])
    assert ends_after < 0.15 * ends_before and after < 0.8 * before


def test_it_is_the_solution_of_least_squares():
    """scipy's solution of the same sum of squares."""
    truth = circle(12)
    graph = chain(truth, np.random.default_rng(7), closing=False)
    extra = compose(graph.poses[0], compose(inverse(truth[0]), truth[-1]))
    graph.add_edge(0, 11, extra, SMALL)
    start = np.array(graph.poses[1:]).ravel()
    first = graph.poses[0]

    def residuals(flat):
        poses = [first, *map(tuple, flat.reshape(-1, 3))]
        rows = []
        for edge in graph.edges:
            x, y, turn = compose(inverse(edge.relation), compose(inverse(poses[edge.first]), poses[edge.second]))
            # GTSAM measures along the screw motion (Pose2::Logmap)
            half = 0.5 * turn
            f = half / math.tan(half) if abs(half) > 1e-9 else 1.0
            vector = np.array((f * x + half * y, -half * x + f * y, turn))
            rows.append(np.linalg.solve(np.linalg.cholesky(edge.covariance), vector))
        return np.concatenate(rows)

    expected = least_squares(residuals, start, xtol=1e-14, ftol=1e-14).x.reshape(-1, 3)
    graph.optimise()
    assert np.abs(np.array(graph.poses[1:])[:, :2] - expected[:, :2]).max() < 1e-4


def test_a_false_loop_is_taken_out():
    truth = circle(60)
    graph = chain(truth, np.random.default_rng(3))
    for k in range(1, 6):
        pose = compose(graph.poses[k], compose(inverse(truth[k]), truth[-1 - k]))
        graph.add_edge(k, len(truth) - 1 - k, pose, SMALL, loop=True)
    wrong = graph.add_edge(10, 40, compose(graph.poses[10], (0.3, 0.2, 1.0)), SMALL, loop=True)
    assert graph.optimise() == [wrong] and wrong not in graph.edges
    clean = chain(truth, np.random.default_rng(3))
    clean.optimise()
    assert errors(graph, truth) < errors(clean, truth) + 0.05


def test_ways_are_shortest_and_loops_cost_nothing():
    truth = [(float(k), 0.0, 0.0) for k in range(6)]
    graph = chain(truth, closing=False)
    assert graph.ways(5) == pytest.approx([5.0, 4.0, 3.0, 2.0, 1.0, 0.0])
    graph.add_edge(0, 4, truth[4], SMALL, loop=True)
    assert graph.ways(5) == pytest.approx([1.0, 2.0, 3.0, 2.0, 1.0, 0.0], abs=1e-4)


def test_covariances_turn_with_their_frame():
    P = np.diag((4.0, 1.0, 0.1))
    assert turned(P, 0.5 * math.pi) == pytest.approx(np.diag((1.0, 4.0, 0.1)), abs=1e-12)
    assert turned(turned(P, 0.7), -0.7) == pytest.approx(P)
    graph = PoseGraph()
    graph.add_node((0.0, 0.0, 0.0))
    graph.add_node((1.0, 0.0, 0.5 * math.pi))
    edge = graph.add_edge(0, 1, graph.poses[1], P)
    assert np.diag(edge.covariance - np.diag(LEAST_SIGMA**2)) == pytest.approx((1.0, 4.0, 0.1))


def test_the_same_edges_give_the_same_bytes():
    poses = []
    for _ in range(2):
        graph = chain(circle(40), np.random.default_rng(1))
        graph.optimise()
        poses.append(np.array(graph.poses).tobytes())
    assert poses[0] == poses[1]


def test_the_bench_s_least_squares_finds_the_same_optimum_and_has_the_right_derivatives():
    truth = circle(20)
    graph = chain(truth, np.random.default_rng(2))
    graph.optimise()
    found = compared(graph)
    assert found['gtsam'][1] == pytest.approx(found['scipy'][1], rel=1e-3, abs=1e-3)
    squares = LeastSquares(graph.edges, graph.poses[0])
    flat = np.array(chained(graph).poses[1:]).ravel() + np.random.default_rng(0).normal(0.0, 0.05, 57)
    exact, step = squares.jacobian(flat).toarray(), 1e-6
    for k in range(0, 57, 5):
        moved = flat + step * (np.arange(57) == k)
        assert (squares.residuals(moved) - squares.residuals(flat)) / step == pytest.approx(exact[:, k], abs=2e-2)
