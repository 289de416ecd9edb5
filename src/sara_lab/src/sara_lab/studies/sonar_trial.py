"""Maps made of a recorded drive with the nine ultrasonic sensors alone, and how good they are."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from sara_bringup.lockstep.ranges import mountings
from sara_common.planar import compose, wrap
from sara_common.platforms import chosen
from sara_lab.journeys.travel_cases import grid_of
from sara_lab.judge.heard_walls import HeardWalls
from sara_lab.judge.passed_walls import MapErrors, judged, passed
from sara_lab.judge.walls import MAPPED
from sara_lab.studies import arc_grid, sonar_drives
from sara_lab.studies.kept_arrays import arrays_of, kept_arrays, map_of
from sara_lab.studies.wandering import Recording
from sara_nav.maps.map_io import GridMap
from sara_slam.exploring.cones import sensors_at
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.sonar_slam import SonarSlam
from sara_slam.sonar.wall_graph import Solved

Pose = tuple[float, float, float]
ALIKE_M, ALIKE_RAD = 0.03, 0.05
"""Of sensors that hear the same."""


class Made(NamedTuple):
    """A map; (n, 2) m, places of the robot in it; its MapErrors."""

    grid: GridMap
    places: np.ndarray
    errors: MapErrors


def replayed(drive: Recording, config: SonarConfig) -> SonarSlam:
    """A map builder that has heard a drive."""
    slam, mounts, number = SonarSlam(config), mountings(chosen()), 0
    for now, stamp, x, y, yaw in drive.poses[:, :5].tolist():
        while number < len(drive.ranges) and drive.ranges[number, 0] <= now:
            _, taken, sensor, distance = drive.ranges[number].tolist()
            name = drive.sensors[int(sensor)]
            slam.on_range(taken, name, mounts[name], distance)
            number += 1
        slam.on_pose(stamp, (x, y, yaw))
    return slam


def true_poses(drive: Recording, stamps: np.ndarray) -> np.ndarray:
    """(n, 2) m: where the robot truly was at times (s)."""
    return np.stack([np.interp(stamps, drive.poses[:, 1], drive.poses[:, column]) for column in (5, 6)], 1)


def heard_share(name: str, drive: Recording) -> float:
    """Share of the walls passed of a map that a sensor heard: what a map can show that adds nothing by guessing."""
    sensors = _true_sensors(drive)
    _, some = np.unique(np.round(sensors / (ALIKE_M, ALIKE_M, ALIKE_RAD)), axis=0, return_index=True)
    heard, _ = HeardWalls(grid_of(name)).heard(sensors[some])
    if not len(heard):
        return 0.0
    return float((cKDTree(heard).query(passed(grid_of(name), drive.poses[:, 5:7]))[0] <= MAPPED).mean())


def _true_sensors(drive):
    """(readings, 3): x, y, axis of the sensor where each reading was taken, in the true map."""
    poses, taken = drive.poses, drive.ranges[:, 1] - SonarConfig().range_delay
    mounts = np.array([mountings(chosen())[name] for name in drive.sensors])[drive.ranges[:, 2].astype(int)]
    x, y, yaw = (np.interp(taken, poses[:, 1], of) for of in (*poses[:, 5:7].T, np.unwrap(poses[:, 7])))
    sensors = sensors_at(np.stack((x, y, yaw), 1), mounts)
    sensors[:, 2] = wrap(sensors[:, 2])
    return sensors


def made_of(name: str, drive: Recording) -> tuple[Made, Made]:
    """What a drive on a map came to: by walls as lines, and by arcs on the odometry as it is."""
    slam = replayed(drive, SonarConfig.of())
    lines, _ = made_by(slam, drive, name)
    nodes = np.array(slam.nodes)
    sensors = np.array([compose(slam.nodes[kept.node], kept.sensor) for kept in slam.kept])
    arcs = arc_grid.draw(sensors, np.array([kept.range for kept in slam.kept]), slam.config.field_of_view)
    return lines, _judged(arcs, nodes, slam, drive, name)


def made_by(slam: SonarSlam, drive: Recording, name: str) -> tuple[Made, Solved]:
    """The map by lines of a map builder that has heard a drive on a map, and what it is drawn of."""
    solved = slam.solved()
    return _judged(slam.map(solved), solved.poses, slam, drive, name), solved


def _judged(grid, poses, slam, drive, name):
    places = poses[:, :2]
    return Made(grid, places, judged(grid, places, grid_of(name), true_poses(drive, np.array(slam.stamps))))


def laid(solved: Solved, pose: Pose) -> Solved:
    """The same poses and walls in a frame in which theirs has that pose (x, y, yaw)."""
    x, y, yaw = pose
    theta = solved.walls[:, 0] + yaw
    rho = solved.walls[:, 1] + x * np.cos(theta) + y * np.sin(theta)
    poses = np.array([compose(pose, place) for place in solved.poses.tolist()]).reshape(-1, 3)
    return solved._replace(poses=poses, walls=np.stack((wrap(theta), rho), 1))


def kept_map(name: str, number: int, folder: Path) -> GridMap:
    """The map by lines of drive `number` on a map, which leads everywhere, drawn in that one's frame, on which it is
    laid by its walls. Drive and map are made once and kept in a folder.
    """

    def make():
        drive = sonar_drives.kept(name, number, folder / 'whole_drives', sonar_drives.WHOLE_S)
        slam = replayed(drive, SonarConfig.of())
        made, solved = made_by(slam, drive, name)
        return arrays_of(slam.map(laid(solved, made.errors.pose)))

    return map_of(kept_arrays(folder / f'sonar_made_{name}_{number}.npz', make))
