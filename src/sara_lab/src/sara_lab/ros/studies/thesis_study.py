"""The figure and the tables of docs/thesis_set.md.

    rosrun sara_lab thesis_set_study [--out FILE.png] [--bags FOLDER]

Straight drives with perfect sensors for the figure (thesis_set.py); with the folder of the synthetic drives (rl_synth),
also how long their ways come out with the thesis's inputs and with the two clean sets.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
import rosbag
import rospy

from sara_lab.studies import thesis_set
from sara_localization.bags.alignment import path_length
from sara_localization.bags.plots import figure
from sara_localization.config.filter_config import FilterConfig
from sara_localization.geometry.rigid import Transform
from sara_localization.ros.bags import bag_tools
from sara_localization.ros.bags.bag_filter import BagFilter
from sara_localization.ros.inputs import resolved

ODOMETRY_RATES, IMU_RATES = (5, 10, 20, 50), (5, 10, 20, 50, 100)
DRIVES = ('s1_eight_50_100', 's2_square_chair', 's5_spin_setpose')
EVERY = 5  # of their 50 ticks a second
# Where those drives' IMU stands: parent, child, x, y, z, roll, pitch, yaw.
IMU_LINK = {
    's1_eight_50_100': [('base_link', 'imu_link', Transform.from_xyz_rpy(0.1, -0.2, 0.3, 0.0, 0.0, 1.57079632679))]
}


def draw(path: str) -> None:
    """The scale against the rates, measured (lines) and by the formula (rings)."""
    drawing, axes = figure(1, 2, (11.0, 4.6))
    left, right = axes[0]
    for rate, row in zip(ODOMETRY_RATES, thesis_set.table(ODOMETRY_RATES, IMU_RATES)):
        (line,) = left.plot(IMU_RATES, [d.scale for d in row], '.-', label=f'odometry at {rate:g} Hz')
        left.plot(IMU_RATES, [d.predicted for d in row], 'o', mfc='none', ms=9, color=line.get_color())
    left.set_xscale('log')
    left.set_xticks(IMU_RATES, [str(rate) for rate in IMU_RATES])
    left.set(
        xlabel='rate of the IMU, Hz', ylabel='estimated way / true way', title="the thesis's set (rings: 1 + K s / T)"
    )
    for variance in (1e-3, 1e-2):
        column = [row[0] for row in thesis_set.table(ODOMETRY_RATES, (20,), predict=True, variance=variance)]
        (line,) = right.plot(
            ODOMETRY_RATES, [d.scale for d in column], '.-', label=f"thesis's set, R = {variance:g} m2"
        )
        right.plot(ODOMETRY_RATES, [d.predicted for d in column], 'o', mfc='none', ms=9, color=line.get_color())
    for name in list(thesis_set.SETS)[1:]:
        column = [row[0] for row in thesis_set.table(ODOMETRY_RATES, (20,), name, predict=True)]
        right.plot(ODOMETRY_RATES, [d.scale for d in column], '.--', label=name)
    right.set_xscale('log')
    right.set_xticks(ODOMETRY_RATES, [str(rate) for rate in ODOMETRY_RATES])
    right.set(xlabel='rate of the odometry, Hz', title='predict_to_current_time on, IMU at 20 Hz')
    for axis in (left, right):
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    drawing.savefig(path, dpi=110)


def way(bag: Path, config: Any, static: Any) -> np.ndarray:
    """(n, 2) the positions over a bag, ten a second: finer, the noise of a turn on the spot would count as way."""
    points = []
    machine = BagFilter(
        config, static, lambda now, output: machine.ticks % EVERY or points.append(output.state[:2].copy())
    )
    with rosbag.Bag(str(bag)) as source:
        for topic, msg, received in source.read_messages(
            topics=[t for t in source.get_type_and_topic_info().topics if resolved(t) in machine.topics]
        ):
            machine.deliver(topic, msg, received)
    machine.finish()
    return np.array(points)


def tell(folder: Path) -> None:
    """How long the ways of the synthetic drives come out, per true way."""
    print(f'{"drive":18}' + ''.join(f'{name:>34}' for name in thesis_set.SETS))
    for name in DRIVES:
        truth = np.load(str(folder / (name + '_truth.npz')))
        true = path_length(truth['x'], truth['y'])
        scales = []
        for inputs in thesis_set.SETS.values():
            params = {**bag_tools.load_params(str(folder / (name + '__thesis.yaml'))), **inputs}
            points = way(folder / (name + '.bag'), FilterConfig.from_params(params), IMU_LINK.get(name, ()))
            scales.append(path_length(points[:, 0], points[:, 1]) / true)
        print(f'{name:18}' + ''.join(f'{scale:34.3f}' for scale in scales))


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog='thesis_set_study', description="How much too long the legs of the thesis's set come out, and why."
    )
    parser.add_argument('--out', metavar='FILE.png', default='thesis_set.png')
    parser.add_argument('--bags', metavar='FOLDER', help='the synthetic drives (rl_synth)')
    arguments = parser.parse_args(rospy.myargv(sys.argv)[1:] if argv is None else argv)
    draw(arguments.out)
    print(f'figure: {arguments.out}')
    if arguments.bags:
        try:
            tell(Path(arguments.bags))
        except (bag_tools.UsageError, OSError, rosbag.ROSBagException) as error:
            sys.exit(f'thesis_set_study: {error}')
