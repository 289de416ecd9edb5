"""calibrate_odometry BAG: the wheel multipliers from a recorded drive with a gyroscope. Needs no master."""

import argparse
import sys
from pathlib import Path

import numpy as np
import rosbag
import yaml

from canserial.ros.conversions import has_estimate
from sara_common.config import ConfigError
from sara_common.platforms import parameters
from sara_common.ros import bags
from sara_control.calibration.calibration import Geometry, calibrate, end_errors
from sara_control.calibration.calibration_report import report, yaml_text
from sara_control.calibration.drive_log import DriveLog, LogError
from sara_control.wheels.config import ControllerConfig


def read_log(path: str, config: ControllerConfig, joint_states: str, imu: str, truth: str | None = None) -> DriveLog:
    """A DriveLog from a bag: sensor_msgs/JointState and Imu by their stamps; truth: a topic with nav_msgs/Odometry or
    geometry_msgs/Pose*.

    What is not newer than the message before it is left out. Raises LogError.
    """
    wheels, gyro, poses = _messages(path, config, joint_states, imu, truth)
    for rows, what in (
        (wheels, f'{joint_states} with the joints {", ".join(config.left_joints + config.right_joints)}'),
        (gyro, imu),
        *([(poses, truth)] if truth else []),
    ):
        if len(rows) < 2:
            raise LogError(f'the bag {path} has {len(rows)} messages on {what}')
    times, left, right = _rising(wheels).T
    gyro_times, rates = _rising(gyro).T
    if not truth:
        return DriveLog(times, left, right, gyro_times, rates)
    pose_times, x, y, yaw = _rising(poses).T
    columns = [np.interp(times, pose_times, values) for values in (x, y, np.unwrap(yaw))]
    return DriveLog(times, left, right, gyro_times, rates, np.column_stack(columns))


def _messages(path, config, joint_states, imu, truth):
    """Rows of (stamp, left, right), (stamp, turn rate) and (stamp, x, y, yaw) from the bag's topics."""
    rows = {topic: [] for topic in (joint_states, imu, truth)}
    sides = config.left_joints, config.right_joints
    try:
        with rosbag.Bag(str(path)) as bag:
            for topic, message, _ in bags.messages(bag, [topic for topic in rows if topic]):
                stamp = message.header.stamp.to_sec()
                if topic == joint_states:
                    found = dict(zip(message.name, message.position))
                    if all(joint in found for joint in sides[0] + sides[1]):
                        means = (np.mean([found[joint] for joint in side]) for side in sides)
                        rows[topic].append((stamp, *means))
                elif topic == imu:
                    if has_estimate(message.angular_velocity_covariance):
                        rows[topic].append((stamp, message.angular_velocity.z))
                else:
                    rows[topic].append((stamp, *_planar(message)))
    except (OSError, rosbag.ROSBagException) as error:
        raise LogError(f'the bag {path} cannot be read: {error}') from error
    return rows[joint_states], rows[imu], rows[truth]


def _rising(rows):
    """As an array, without rows that are not newer than the one before, or not finite."""
    kept = []
    for row in rows:
        if np.isfinite(row).all() and (not kept or row[0] > kept[-1][0]):
            kept.append(row)
    return np.array(kept) if kept else np.empty((0, len(rows[0])))


def _planar(message):
    """x, y, yaw of an Odometry, PoseStamped or PoseWithCovarianceStamped."""
    pose = message.pose
    while hasattr(pose, 'pose'):
        pose = pose.pose
    q = pose.orientation
    return (
        pose.position.x,
        pose.position.y,
        np.arctan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z)),
    )


def arguments(words: list[str] | None) -> argparse.Namespace:
    """Of the command line."""
    parser = argparse.ArgumentParser(
        prog='calibrate_odometry',
        description=__doc__,
        epilog=(
            'The drive: stand still a second or two between any two moves, and 4 s between runs; '
            'drive a square both ways and turn on the spot both ways. '
            '`roslaunch sara_control calibration_drive.launch` drives it.'
        ),
    )
    parser.add_argument('bag')
    parser.add_argument(
        '--params',
        help="the controller's YAML: geometry, joints (the robot's)",
    )
    parser.add_argument('--joint-states', default='/joint_states', metavar='TOPIC', help='default: %(default)s')
    parser.add_argument('--imu', default='/imu/data', metavar='TOPIC', help='z up; default: %(default)s')
    parser.add_argument(
        '--truth', metavar='TOPIC', help='true poses (Odometry or Pose*Stamped), to judge the result by'
    )
    parser.add_argument(
        '--gyro-scale-sigma',
        type=float,
        default=0.005,
        metavar='S',
        help="how well the gyroscope's scale is known, relative (default: %(default)s)",
    )
    parser.add_argument(
        '--leg',
        type=float,
        metavar='M',
        help="true mean length of the straight legs, measured on the floor: sets the radii's scale",
    )
    parser.add_argument(
        '--leg-sigma', type=float, default=0.005, metavar='M', help='its uncertainty, m (default: %(default)s)'
    )
    parser.add_argument('--output', metavar='FILE', help='write the YAML there')
    return parser.parse_args(words)


def main(words: list[str] | None = None) -> int:
    """Run the command; exit status 1 and one sentence where it cannot."""
    options = arguments(sys.argv[1:] if words is None else words)
    try:
        params = (
            yaml.safe_load(Path(options.params).read_text())
            if options.params
            else parameters('sara_control', 'diff_drive_controller.yaml')
        )
        config = ControllerConfig.from_params(params)
        log = read_log(options.bag, config, options.joint_states, options.imu, options.truth)
        result = calibrate(
            log, config.wheel_separation, config.wheel_radius, options.gyro_scale_sigma, options.leg, options.leg_sigma
        )
    except (LogError, ConfigError, OSError, yaml.YAMLError) as error:
        sys.exit(f'calibrate_odometry: {error}')
    before = Geometry(config.separation, *config.radii)
    after = result.geometry(config.wheel_separation, config.wheel_radius)
    print(report(result, end_errors(log, before, after, result.bias)))
    text = yaml_text(result)
    print(f'\nthe parameters to use:\n{text}', end='')
    if options.output:
        Path(options.output).write_text(text)
