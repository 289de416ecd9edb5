"""The live node against robot_localization's live node on the recorded drives: within three times the peer's own
spread.

What differs from run to run is which message reaches which cycle. Median and 95th percentile of the distance at equal
stamps are judged.

    rosrun sara_lab live_check [--data FOLDER] [--out FILE.json] [SET ...]

A master of its own; `rosbag play --clock --hz 200` at real time, so a set of test1.bag takes 7 minutes, one of
test2.bag one. FOLDER holds bags/ and reference/rl_node/ (default ../shared/data beside the repository). SETs: those
whose spread from run to run is of use.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import rospkg
import rospy
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

from sara_bringup.ros.own_master import own_master, running
from sara_localization.inputs.data import StampedTransform
from sara_localization.ros import conversions
from sara_localization.ros.bags import bag_tools

SETS = (
    'b2_ekf_repo',
    'b2_ekf_predict_now',
    'b2_ekf_2d_dyn',
    'b1_ekf_repo',
    'b1_ekf_2d_abs',
    'b1_ekf_2d_rel',
    'b1_ekf_map_odomdiff',
    'b1_ekf_lag',
)
HUSKY_IMU = '0 -0.3 0.52 -1.570796327 0 1.570796327 base_link imu_link'
ALLOWED = 3.0
SAME_STAMP = 5e-6


def played(bag: Path, params: dict) -> np.ndarray:
    """(n, 4) stamp, x, y, z that a live ekf_localization_node publishes while the bag is played."""
    rows = []
    rospy.set_param('/filter', params)
    output = rospy.Subscriber(
        'odometry/filtered',
        Odometry,
        lambda m: rows.append(
            (m.header.stamp.to_sec(), m.pose.pose.position.x, m.pose.pose.position.y, m.pose.pose.position.z)
        ),
        queue_size=1000,
    )
    with running('rosrun', 'sara_localization', 'ekf_localization_node', '__name:=filter'):
        while not output.get_num_connections():
            time.sleep(0.1)
        time.sleep(2.0)
        subprocess.run(
            ['rosbag', 'play', '-q', '--clock', '--hz', '200', '--delay', '2', str(bag)],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        time.sleep(1.0)
    output.unregister()
    rospy.delete_param('/filter')
    return np.array(rows)


def difference(ours: np.ndarray, known: dict[str, np.ndarray]) -> np.ndarray:
    """(n,) m between ours and the peer's positions, at equal stamps, or in between where stamps differ throughout."""
    stamps, theirs = known['stamp'] + float(known['t0']), known['pose'][:, :3]
    nearest = np.clip(np.searchsorted(ours[:, 0], stamps - SAME_STAMP), 0, len(ours) - 1)
    same = np.abs(ours[nearest, 0] - stamps) < SAME_STAMP
    if same.mean() > 0.3:
        return np.linalg.norm(ours[nearest[same], 1:] - theirs[same], axis=1)
    inside = (stamps >= ours[0, 0]) & (stamps <= ours[-1, 0])
    at = np.column_stack([np.interp(stamps[inside], ours[:, 0], ours[:, k]) for k in (1, 2, 3)])
    return np.linalg.norm(at - theirs[inside], axis=1)


def check(name: str, data: Path, spread: dict) -> dict:
    """{median, p95, allowed_median, allowed_p95, ok} of one set; m."""
    reference = data / 'reference' / 'rl_node'
    bag = data / 'bags' / {'b1': 'test1.bag', 'b2': 'test2.bag'}[name[:2]]
    ours = played(bag, bag_tools.load_params(str(reference / (name + '.yaml'))))
    apart = difference(ours, np.load(str(reference / 'live' / (name + '.npz'))))
    of = spread[name]['run_to_run']
    result = {
        'median': float(np.median(apart)),
        'p95': float(np.percentile(apart, 95)),
        'compared': len(apart),
        'allowed_median': ALLOWED * of['pos_median'],
        'allowed_p95': ALLOWED * of['pos_p95'],
    }
    result['ok'] = result['median'] <= result['allowed_median'] and result['p95'] <= result['allowed_p95']
    return result


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog='live_check', description="The live node against the peer's on the recorded drives."
    )
    parser.add_argument('sets', metavar='SET', nargs='*', default=SETS, help='of {}'.format(', '.join(SETS)))
    parser.add_argument('--data', type=Path, help='where bags/ and reference/rl_node/ are')
    parser.add_argument('--out', type=Path, help='JSON file')
    arguments = parser.parse_args(rospy.myargv(sys.argv)[1:] if argv is None else argv)
    package = Path(rospkg.RosPack().get_path('sara_localization')).resolve()
    data = arguments.data or Path(os.environ.get('SARA_SHARED_DATA', package.parents[1].parent / 'shared' / 'data'))
    if not (data / 'reference' / 'rl_node').is_dir():
        sys.exit(f'live_check: {data} holds no reference/rl_node; name the folder with --data')
    unknown = [name for name in arguments.sets if name not in SETS]
    if unknown:
        sys.exit('live_check: {} is none of {}'.format(', '.join(unknown), ', '.join(SETS)))
    spread = json.loads((data / 'reference' / 'rl_node' / 'live' / 'spread.json').read_text())
    results = {}
    with own_master():
        rospy.set_param('/use_sim_time', True)
        rospy.init_node('live_check', disable_signals=True, disable_rostime=True)
        parent, child, transform = bag_tools.static_transform(HUSKY_IMU)
        static = rospy.Publisher('/tf_static', TFMessage, queue_size=1, latch=True)
        static.publish(TFMessage([conversions.transform_message(StampedTransform(0.0, parent, child, transform))]))
        for name in arguments.sets:
            r = results[name] = check(name, data, spread)
            print(
                f'{name:20} median {r["median"]:.1e} m (allowed {r["allowed_median"]:.1e}), p95 {r["p95"]:.1e} m '
                f'(allowed {r["allowed_p95"]:.1e}): {"ok" if r["ok"] else "TOO FAR"}',
                flush=True,
            )
        rospy.signal_shutdown('done')
    if arguments.out:
        arguments.out.write_text(json.dumps(results, indent=1))
    sys.exit(0 if all(r['ok'] for r in results.values()) else 1)
