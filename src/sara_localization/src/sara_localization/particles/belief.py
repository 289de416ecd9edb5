"""What particles say together: the pose of the heaviest cluster, and how sure that is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sara_common.planar import wrap
from sara_common.repeatable import cos_sin, weighted_sum
from sara_localization.particles import bins


class Belief(NamedTuple):
    """pose: (x, y, yaw), the mean of the heaviest cluster; covariance (3, 3): of all particles about that pose; weight
    and cluster_covariance (3, 3) of that cluster; how many clusters there are.
    """

    pose: tuple[float, float, float]
    covariance: np.ndarray
    weight: float
    cluster_covariance: np.ndarray
    clusters: int


def mean_pose(poses: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(3,) the weighted mean of poses (n, 3); headings are averaged as directions."""
    total, (x, y, yaw) = weights.sum(), poses.T
    c, s = (weighted_sum(weights, part) for part in cos_sin(yaw))
    return np.array([weighted_sum(weights, x) / total, weighted_sum(weights, y) / total, np.arctan2(s, c)])


def covariance_about(pose: np.ndarray, poses: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(3, 3) the weighted mean square of poses (n, 3) about a pose, yaw the short way round."""
    off = poses - pose
    off[:, 2] = wrap(off[:, 2])
    return (off * weights[:, None]).T @ off / weights.sum()


def belief(poses: np.ndarray, weights: np.ndarray) -> Belief:
    """Of particles (n, 3) with weights (n,) that add up to 1."""
    labels, count = bins.clusters(poses)
    heavy = np.bincount(labels, weights, count)
    best = labels == int(heavy.argmax())
    pose = mean_pose(poses[best], weights[best])
    return Belief(
        tuple(pose.tolist()),
        covariance_about(pose, poses, weights),
        float(heavy.max()),
        covariance_about(pose, poses[best], weights[best]),
        int(count),
    )
