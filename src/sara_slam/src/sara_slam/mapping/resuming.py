"""Going on with a map: the graph of poses out of a journal, and where in the map the robot is after that."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from sara_slam.graph.loops import LoopRules
from sara_slam.graph.pose_graph import Pose, PoseGraph
from sara_slam.mapping.journal import Journal, JournalError, edge_of, key_scan_of
from sara_slam.mapping.key_scan import KeyScan
from sara_slam.matching.likelihood_grid import Grain, LikelihoodGrid, Match, Window

FAR = 8.0
"""m about the last pose that the robot is looked for: what it drives in 10 s."""
WIDE, COARSE = Window(FAR, math.pi, 2.0, 1.5), Grain(0.1, 0.12)
NEAR = Window(0.3, 0.2, 0.3, 0.2)
POINTS, NODES = 150, 300
"""Echoes and key scans that are looked at in the wide window."""
ALONE = 3.0
"""m from the nearest earlier pose: nothing there is known."""

GridOf = Callable[[KeyScan, Sequence[int], Pose, float, Grain], LikelihoodGrid | None]


def restored(journal: Journal, graph: PoseGraph) -> tuple[list[KeyScan], int]:
    """Fill a graph from a journal, which is emptied; returns its key scans, and how many loops came since the last
    optimisation. Raises JournalError where it is another program's.

    Optimisations since the last one whose poses are kept are done again, which gives the same poses.
    """
    if any(record.kind not in ('scan', 'loop', 'optimised') for record in journal.records):
        raise JournalError(f'{journal.path} holds a map that was not made by a laser scanner')
    scans, postponed = [], 0
    records, journal.records = journal.records, []
    whole = max((k for k, r in enumerate(records) if r.kind == 'optimised' and len(r.arrays['poses'])), default=-1)
    for k, record in enumerate(records):
        if record.kind == 'scan':
            scans.append(key_scan_of(record))
            graph.add_node(record.arrays['pose'].tolist())
        if record.kind == 'loop':
            postponed += 1
        if 'first' in record.arrays:
            graph.edges.append(edge_of(record))
        if record.kind == 'optimised':
            postponed = 0
            if k > whole:
                graph.optimise()
                continue
            dropped = set(record.arrays['dropped'].tolist())
            graph.edges = [edge for n, edge in enumerate(graph.edges) if n not in dropped]
            if k == whole:
                graph.poses[:] = [tuple(pose) for pose in record.arrays['poses'].tolist()]
    return scans, postponed


def found_again(
    key: KeyScan, poses: Sequence[Pose], grid_of: GridOf, fine: Grain, rules: LoopRules
) -> tuple[int, Match] | None:
    """(the nearest node, the match with what is known about it) of a scan in the map of earlier ones, near the last
    pose; None where it fits nowhere.

    A search of all poses about the last one in what every scan near it saw, and then a narrow one about what that
    found, as for a loop, with its rules. fine: the grain of the narrow one.
    """
    last = poses[-1]
    points = key.points()
    if not len(points):
        return None
    near = [node for node, pose in enumerate(poses) if math.dist(pose[:2], last[:2]) < 2.0 * FAR]
    grid = grid_of(key, near[:: -(-len(near) // NODES)], last, FAR, COARSE)
    if grid is None:
        return None
    found = grid.match(points[:: max(len(points) // POINTS, 1)], last, WIDE).pose
    off = [math.dist(pose[:2], found[:2]) for pose in poses]
    nearest = off.index(min(off))
    beside = [node for node in range(len(poses)) if off[node] < ALONE]
    grid = grid_of(key, beside[:: -(-len(beside) // NODES)], found, NEAR.shift, fine) if beside else None
    if grid is None:
        return None
    match = grid.match(points, found, NEAR)
    fits = match.response >= rules.response and match.agreement >= rules.agreement
    return (nearest, match) if fits else None
