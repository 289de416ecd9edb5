"""The offline filter over a bag: the Husky's drive where the shared data are there, and always a drive that is made up
here.
"""

import math
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import rosbag
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from sara_lab.benches.navigation import shared_data
from sara_lab.benches.timed import Limit, Timed, timed
from sara_localization.checks import check_config
from sara_localization.ros.bags import bag_tools, filter_bag

HUSKY_IMU = '0 -0.3 0.52 -1.570796327 0 1.570796327 base_link imu_link'
SECONDS = 60
RUNS = 3
PARAMETERS = {
    'frequency': 50.0,
    'two_d_mode': True,
    'odom_frame': 'odom',
    'base_link_frame': 'base_link',
    'world_frame': 'odom',
    'odom0': 'odom',
    'odom0_config': [k == 6 for k in range(15)],
    'imu0': 'imu',
    'imu0_config': [k in (5, 11) for k in range(15)],
}


def write_drive(path: Path | str, seconds: float = SECONDS) -> None:
    """A bag of a robot that drives eights: odometry at 50 Hz, an IMU at 100 Hz."""
    odometry, imu = Odometry(), Imu()
    odometry.header.frame_id, odometry.child_frame_id, imu.header.frame_id = 'odom', 'base_link', 'base_link'
    odometry.pose.covariance = odometry.twist.covariance = [1e-3 if k % 7 == 0 else 0.0 for k in range(36)]
    imu.orientation_covariance = imu.angular_velocity_covariance = imu.linear_acceleration_covariance = [
        1e-3 if k % 4 == 0 else 0.0 for k in range(9)
    ]
    odometry.pose.pose.orientation.w, odometry.twist.twist.linear.x, imu.linear_acceleration.z = 1.0, 0.5, 9.81
    with rosbag.Bag(str(path), 'w') as bag:
        for k in range(int(100 * seconds)):
            stamp, yaw = rospy.Time(1000 + k // 100, (k % 100) * 10**7), math.sin(0.01 * k * 0.3)
            odometry.header.stamp = imu.header.stamp = stamp
            imu.orientation.z, imu.orientation.w, imu.angular_velocity.z = (
                math.sin(yaw / 2),
                math.cos(yaw / 2),
                0.3 * math.cos(0.01 * k * 0.3),
            )
            bag.write('/imu', imu, stamp)
            if k % 2 == 0:
                bag.write('/odom', odometry, stamp)


def _bag(path, params, kind, static, drive_s, name, limit=None):
    config, findings = check_config.check(params, kind)
    if config is None:
        raise ValueError('; '.join(finding.sentence for finding in findings))
    taken, messages = [], 0
    for _ in range(RUNS):
        begin = time.process_time()
        messages = filter_bag.run(str(path), None, config, static, quiet=True)['messages']
        taken.append(time.process_time() - begin)
    median = sorted(taken)[len(taken) // 2]
    return timed(
        name,
        's',
        taken,
        limit=limit,
        text=(
            f'{messages} messages of {drive_s:.0f} s: {drive_s / median:.0f} times real time, without the start of '
            'the process'
        ),
    )


def bags() -> Iterator[Timed]:
    """CPU time of a whole bag, the bag's reading included."""
    husky = shared_data() / 'bags' / 'test1.bag'
    for kind in ('ekf', 'ukf'):
        name = f'offline {kind.upper()} over test1.bag'
        if husky.is_file():
            with rosbag.Bag(str(husky)) as bag:
                drive_s = bag.get_end_time() - bag.get_start_time()
            yield _bag(
                husky,
                bag_tools.load_params(str(husky.with_name(f'test1_{kind}.yaml'))),
                kind,
                [bag_tools.static_transform(HUSKY_IMU)],
                drive_s,
                name,
                Limit('median', 1.0) if kind == 'ekf' else None,
            )
        else:
            yield Timed(name, text=f'{husky} is not there')
    with tempfile.TemporaryDirectory(prefix='sara_') as folder:
        path = Path(folder) / 'drive.bag'
        write_drive(path)
        yield _bag(path, PARAMETERS, 'ekf', [], SECONDS, f'offline EKF over a made-up drive of {SECONDS} s')
