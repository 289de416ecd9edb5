"""slam_gmapping put to a recorded drive of the simulated chair: the map that it makes, and how good that is."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from sara_common.planar import between, compose
from sara_common.platforms import chosen, parameters
from sara_lab.journeys.travel_cases import grid_of
from sara_lab.judge import walls
from sara_lab.studies.map_drives import Drive
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.scan_input import ScanInput
from sara_nav.maps.map_io import GridMap
from sara_sim.chips.scanner import ANGLES, Scan, optics_at, sweep_of
from sara_slam.mapping.slam import Slam
from sara_slam.mapping.slam_config import SlamConfig

EVERY = 10  # of the scans are looked at for what the drive saw of walls
ON_WALL = 0.05  # m from an echo, wherever somebody stood before it
Pose = tuple[float, float, float]


class Made(NamedTuple):
    """What came of a drive. grid: the map; errors: of the walls. pose_rms, pose_max: m, of the robot's poses in the map
    laid on the true one.
    """

    grid: GridMap
    errors: walls.WallErrors
    pose_rms: float
    pose_max: float
    counts: dict[str, int]


class Track:
    """Poses by their times, as tf interpolates them. rows (n, 4): s, x, y, yaw."""

    def __init__(self, rows: np.ndarray) -> None:
        self._rows = rows

    def at(self, t: float) -> Pose | None:
        """The pose at t (s); None where it is not known."""
        after = int(np.searchsorted(self._rows[:, 0], t))
        if after == 0 or after == len(self._rows):
            return None
        (t0, *a), (t1, *b) = self._rows[after - 1], self._rows[after]
        return between(a, b, (t - t0) / (t1 - t0))

    def during(self, t: float, duration: float) -> tuple[Pose, Pose] | None:
        """The poses at t and `duration` later (s); None where one is not known."""
        begun, ended = self.at(t), self.at(t + duration)
        return None if begun is None or ended is None else (begun, ended)


def slam_of(params: dict[str, Any] | None = None) -> Slam:
    """SARA's slam_gmapping. params: laid over those of sara_bringup's slam.yaml."""
    return Slam(SlamConfig.from_params({**parameters('sara_bringup', 'slam.yaml'), **(params or {})}))


def scans_of(drive: Drive, start: Pose = (0.0, 0.0, 0.0), later: float = 0.0) -> Iterator[ScanInput]:
    """The scans of a drive. start: of its odometry; later: s that it begins after it was recorded."""
    sits = chosen().scan
    optics, x, y, yaw = optics_at(sits), sits.x, sits.y, sits.yaw
    mount, track = Transform.from_xyz_rpy(x, y, 0.0, yaw=yaw), Track(drive.poses[:, :4])
    for stamp, ranges in zip(drive.stamps.tolist(), drive.ranges):
        sweep = sweep_of(Scan(stamp, ranges.astype(float)), optics)
        ends = track.during(stamp, sweep.duration)
        if ends is None:
            continue
        begun, ended = (compose(start, pose) for pose in ends)
        begun, ended = (Transform.from_xyz_rpy(*pose[:2], 0.0, yaw=pose[2]) for pose in (begun, ended))
        yield ScanInput('scan', sweep._replace(stamp=stamp + later), mount, begun, ended)


def mapped(drive: Drive, params: dict[str, Any] | None = None, start: Pose = (0.0, 0.0, 0.0)) -> Slam:
    """slam_gmapping after a drive. params: see slam_of; start: of the odometry, and so of the map."""
    slam = slam_of(params)
    for scan in scans_of(drive, start):
        slam.on_scan(scan if slam.config.deskew else scan._replace(ended=None))
    slam.finish()
    return slam


def seen_walls(name: str, drive: Drive) -> np.ndarray:
    """(n, 2) m: places on a map's true walls that were seen in a drive."""
    sits = chosen().scan
    optics, x, y, yaw = optics_at(sits), sits.x, sits.y, sits.yaw
    track, echoes = Track(drive.poses[:, (0, 4, 5, 6)]), []
    for stamp, ranges in zip(drive.stamps[::EVERY].tolist(), drive.ranges[::EVERY]):
        sweep = sweep_of(Scan(stamp, ranges), optics)
        ends = track.during(stamp, sweep.duration)
        if ends is None:
            continue
        hit = np.flatnonzero(np.isfinite(ranges))
        share = hit / (len(ranges) - 1)
        base = between(*ends, share)
        c, s = np.cos(base[2]), np.sin(base[2])
        angle = base[2] + yaw + ANGLES[hit]
        echoes.append(
            np.stack(
                (
                    base[0] + c * x - s * y + ranges[hit] * np.cos(angle),
                    base[1] + s * x + c * y + ranges[hit] * np.sin(angle),
                ),
                1,
            )
        )
    true = grid_of(name)
    faces = walls.faces(true.data == walls.OCCUPIED, true.geometry)
    off = walls.cKDTree(np.concatenate(echoes)).query(faces, distance_upper_bound=ON_WALL)[0]
    return faces[np.isfinite(off)]


def judged(name: str, drive: Drive, slam: Slam, start: Pose | None = None) -> Made:
    """The map that slam_gmapping made in a drive on a map. start: about where its frame is on the true one; None: where
    the drive began.
    """
    grid = slam.map()
    start = tuple(drive.poses[0, 4:]) if start is None else start
    errors = walls.judged(grid, grid_of(name), start, seen_walls(name, drive))
    true = Track(drive.poses[:, (0, 4, 5, 6)])
    off = [
        math.dist(compose(errors.pose, pose)[:2], true.at(scan.stamp)[:2]) for scan, pose in zip(slam.scans, slam.poses)
    ]
    return Made(grid, errors, float(np.sqrt(np.mean(np.square(off)))), max(off), dict(slam.counts))
