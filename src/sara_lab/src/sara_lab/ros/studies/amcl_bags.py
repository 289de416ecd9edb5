"""`rosrun sara_lab amcl_bags`: the tests of the C++ amcl as bags of a simulated robot, for any localiser.

Each NAME.bag holds /tf, odom, base_scan (base_scan_0, base_scan_1) and base_pose_ground_truth as the node robot
publishes them; NAME.yaml amcl's parameters, and where the test wants the robot to be when. Play with `rosbag play
--clock`; the map is the one of sara_lab/data/maps.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import rosbag
import rospy
import yaml

from sara_lab.studies.amcl_drives import AMCL_TESTS, AmclTest, map_file
from sara_sim.robot.recording import Moment
from sara_sim.ros.messages import laser_scan
from sara_sim.ros.robot_messages import LASER, ODOM, SCAN, TRUTH, numbered, odometry, transforms
from sara_sim.world.world import World


def write_bag(test: AmclTest, world: World, seed: int, path: Path) -> None:
    """Write one drive. world: of its map. Raises OSError."""
    with rosbag.Bag(str(path), 'w', compression=rosbag.Compression.LZ4) as bag:
        for moment in test.drive(world, seed):
            _write(bag, test, moment)


def _write(bag, test, moment: Moment):
    now, scanners = rospy.Time.from_sec(moment.t), test.robot.scanners
    bag.write('/tf', transforms(now, moment.odometry, scanners), now)
    bag.write(ODOM, odometry(now, ODOM, moment.odometry, moment.measured), now)
    bag.write(TRUTH, odometry(now, 'map', moment.truth, moment.velocity), now)
    topics, frames = numbered(SCAN, scanners), numbered(LASER, scanners)
    for number, sweep in moment.scans:
        if sweep.stamp > 0.0:  # to tf a stamp of 0 means any time
            bag.write(topics[number], laser_scan(sweep, frames[number], 1.0 / scanners[number].rate), now)


def settings(test: AmclTest) -> dict:
    """What NAME.yaml holds: `amcl`: parameters; `initialpose`: messages to be sent; `expected`."""
    first = test.told[:1]
    initial = {}
    if first and not first[0].at:
        names = [f'initial_{name}' for name in ('pose_x', 'pose_y', 'pose_a', 'cov_xx', 'cov_yy', 'cov_aa')]
        initial = dict(zip(names, (*first[0].pose, *first[0].variances)))
    return {
        'amcl': {**test.parameters, **initial},
        'initialpose': [
            {'at': told.at, 'stamp': told.stamp, 'pose': list(told.pose), 'variances': list(told.variances)}
            for told in test.told
            if told.at
        ],
        'global_localization': not test.told,
        'expected': {
            'after': test.seconds,
            'pose': list(test.target),
            'tolerance_d': test.tolerance[0],
            'tolerance_a': test.tolerance[1],
        },
    }


def main() -> None:
    """Write the bags that are asked for."""
    parser = argparse.ArgumentParser(
        prog='amcl_bags', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('names', nargs='*', metavar='NAME', help=f'of {", ".join(AMCL_TESTS)}; all without it')
    parser.add_argument('--seed', type=int, default=0, help="of odometry's errors and the scanner's noise")
    parser.add_argument('--out', type=Path, default=Path('out/amcl_bags'))
    arguments = parser.parse_args()
    unknown = [name for name in arguments.names if name not in AMCL_TESTS]
    if unknown:
        parser.error(f'there is no test {", ".join(unknown)}; there are {", ".join(AMCL_TESTS)}')
    if arguments.seed < 0:
        parser.error(f'--seed is {arguments.seed}, allowed are whole numbers of 0 or more')
    arguments.out.mkdir(parents=True, exist_ok=True)
    world = World.from_yaml(map_file())
    for name in arguments.names or AMCL_TESTS:
        test, path = AMCL_TESTS[name], arguments.out / f'{name}.bag'
        write_bag(test, world, arguments.seed, path)
        path.with_suffix('.yaml').write_text(yaml.safe_dump(settings(test), sort_keys=False))
        x, y, yaw = test.target
        print(f'{path}: {test.seconds:g} s, ends at {x:g} {y:g} {yaw:g}', flush=True)
