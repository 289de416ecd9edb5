"""From what a map builder has heard so far to the poses, the walls and the map."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sara_common.planar import compose, inverse
from sara_nav.maps.map_io import GridMap
from sara_slam.sonar.evidence_grid import Drawn, draw
from sara_slam.sonar.forward_model import Heard, thinned
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.wall_graph import Evidence, Solved, optimise

Pose = tuple[float, float, float]


class Kept(NamedTuple):
    """A reading: the graph's pose it hangs on, the sensor there (x, y, yaw), range (m; REP-117), its wall, or -1, and
    the sensor's number.
    """

    node: int
    sensor: Pose
    range: float
    wall: int
    name: int


class Directions(NamedTuple):
    """square (walls,): those that are held square to the one with the number `reference`; believed (walls,): those
    that are walls.
    """

    square: np.ndarray
    reference: int
    believed: np.ndarray

    def order(self) -> list[int]:
        """The numbers of the believed walls, the reference first."""
        found = np.flatnonzero(self.believed).tolist()
        return sorted(found, key=lambda wall: wall != self.reference)


class Snapshot(NamedTuple):
    """What was heard up to some time; it stays as it is while more is heard. nodes: the odometry at the poses of the
    graph; kept: readings; first: what the filter has estimated.
    """

    config: SonarConfig
    nodes: list[Pose]
    kept: list[Kept]
    first: Solved
    directions: Directions

    def solved(self) -> Solved:
        """All poses and walls as all readings agree best on them. There must have been a reading."""
        nodes = self.nodes
        relations = np.array([compose(inverse(a), b) for a, b in zip(nodes, nodes[1:])]).reshape(-1, 3)
        seen = [kept for kept in self.kept if kept.wall >= 0 and self.directions.believed[kept.wall]]
        evidence = Evidence(
            relations,
            np.array([kept.node for kept in seen], int),
            np.array([kept.wall for kept in seen], int),
            np.array([kept.sensor[:2] for kept in seen]).reshape(-1, 2),
            np.array([kept.range for kept in seen]),
            self.directions.square,
            self.directions.reference,
        )
        return optimise(self.config, self.first, evidence)

    def map(self, solved: Solved | None = None) -> GridMap:
        """The map alone; see drawn."""
        return self.drawn(solved).grid

    def drawn(self, solved: Solved | None = None) -> Drawn:
        """The map. solved: what `solved` gave, where that is known. Raises ValueError before the first reading."""
        if not self.kept:
            raise ValueError('there is no map before the first reading of a sensor that has a pose')
        poses, walls, _ = solved or self.solved()
        sensors = np.array([compose(poses[kept.node], kept.sensor) for kept in self.kept])
        heard = Heard(sensors, np.array([kept.range for kept in self.kept]))
        names = np.array([kept.name for kept in self.kept])
        return draw(self.config, thinned(heard, names), walls[self.directions.order()], poses)
