"""`report BAG`: the figures of E8 to E10 and the judge's table of a recorded drive, of the simulated chair or a real
one, which has no true pose.
"""

import argparse
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import rosbag

from sara_common.planar import compose, inverse, yaw_of
from sara_lab.experiments import drive_figures
from sara_lab.judge.judge import judge
from sara_lab.ros.studies.bag_track import FUSED, TRUE, BagError, read_track

WHEELS, IMU = '/diff_drive_controller/odom', '/imu/data'
STEP_S = 0.1


def read_trace(path: str, track: Any) -> dict[str, np.ndarray]:
    """What drive_figures draws of a bag: {name: array}, every STEP_S s while there are poses of the Track; what the bag
    does not hold is NaN.

    The wheels' path is laid on where the drive began.
    """
    rows = {topic: [] for topic in (TRUE, FUSED, WHEELS, IMU)}
    with rosbag.Bag(str(path)) as bag:
        for topic, message, _ in bag.read_messages(topics=list(rows)):
            if topic == IMU:
                values = yaw_of(message.orientation), message.angular_velocity.z
            else:
                pose = message.pose.pose
                values = pose.position.x, pose.position.y, yaw_of(pose.orientation), message.twist.twist.angular.z
            if all(map(math.isfinite, values)):
                rows[topic].append((message.header.stamp.to_sec(), *values))
    t = np.arange(track.t[0], track.t[-1], STEP_S)
    true, fused, wheels = (_on_grid(rows[topic], t, 4, 2) for topic in (TRUE, FUSED, WHEELS))
    imu = _on_grid(rows[IMU], t, 2, 0)
    pose = true if track.source == 'true' else fused
    both = np.flatnonzero(np.isfinite(pose[:, 0]) & np.isfinite(wheels[:, 0]))
    if len(both):  # nodes do not all begin at the same time
        origin = compose(tuple(pose[both[0], :3]), inverse(tuple(wheels[both[0], :3])))
        wheels[:, :3] = [compose(origin, tuple(row)) for row in wheels[:, :3]]
    return {
        't': t - t[0],
        'true': true[:, :3],
        'fused': fused[:, :3],
        'wheels': wheels[:, :3],
        'imu_yaw': imu[:, 0],
        'imu_rate': imu[:, 1],
        'wheel_rate': wheels[:, 3],
        'ends': np.array([goal.ended - t[0] for goal in track.goals]),
    }


def _on_grid(rows, t, columns, angle):
    """(len(t), columns) of rows (stamp, values...), read off straight lines between them, column `angle` unwrapped; NaN
    without two rows, and before and after them.
    """
    found = np.full((len(t), columns), math.nan)
    rows = np.array(sorted(rows))
    if len(rows) > 1:
        rows[:, 1 + angle] = np.unwrap(rows[:, 1 + angle])
        for k in range(columns):
            found[:, k] = np.interp(t, rows[:, 0], rows[:, 1 + k], math.nan, math.nan)
    return found


def write(path: str, folder: Path, map_file: str | None = None) -> Any:
    """The report of a bag in a folder (a Path): report.md, paths.png, rates.png, angles.png. Returns the Judgement.
    Raises BagError and rosbag's own errors.
    """
    track, dropped = read_track(path)
    trace = read_trace(path, track)
    world = None
    if map_file:
        from sara_sim.world.world import World

        world = World.from_yaml(map_file)
    found = judge(track, world)
    folder.mkdir(parents=True, exist_ok=True)
    goals = [(goal.pose[0], goal.pose[1], math.degrees(goal.pose[2])) for goal in track.goals]
    walls = (world.occupied, world.resolution, world.origin) if world else None
    drive_figures.path(folder / 'paths.png', {Path(path).stem: trace}, goals, track.pose[0], walls)
    drive_figures.rates(folder / 'rates.png', trace)
    drive_figures.angles(folder / 'angles.png', trace, 'fused' if np.isfinite(trace['fused']).any() else track.source)
    lines = [f'# {Path(path).name}', '', f'Judged by the {track.source} pose.', '', '```', found.table(), '```', '']
    lines += [
        '| goal (m, m, deg) | reached | off, m | off, deg | in words |',
        '| --- | --- | --- | --- | --- |',
    ] * bool(goals)
    lines += [
        (
            f'| {x:.2f}, {y:.2f}, {yaw:.0f} | {"yes" if corner.reached else "no"} | {corner.position:.3f} | '
            f'{corner.yaw:+.2f} | {corner.text} |'
        )
        for (x, y, yaw), corner in zip(goals, found.corners)
    ]
    lines += [
        '',
        *(f'Left out: {count} of {what}.' for what, count in dropped.items()),
        '',
        '![paths](paths.png)',
        '',
        '![turn rates](rates.png)',
        '',
        '![angles](angles.png)',
        '',
    ]
    (folder / 'report.md').write_text('\n'.join(lines), encoding='utf-8')
    return found


def main(words: list[str] | None = None) -> None:
    """The command; exit status 1 where the bag holds no drive."""
    parser = argparse.ArgumentParser(prog='report', description=__doc__)
    parser.add_argument('bag', help='recorded by sara.launch record:=true, or with the same topics')
    parser.add_argument('--out', type=Path, help='folder of the report; without it, one named like the bag, beside it')
    parser.add_argument('--map', help='YAML of the map, for the picture and the gap to what stands on it')
    options = parser.parse_args(words)
    folder = options.out or Path(options.bag).with_suffix('')
    try:
        found = write(options.bag, folder, options.map)
    except (BagError, OSError, rosbag.ROSBagException, ValueError) as error:
        sys.exit(f'report: {error}')
    print(f'{found.table()}\n{folder / "report.md"}')
