"""Make the .npz files of this folder out of the full reference data (needs ROS's rosbag; the tests do not).

python3 thin_reference.py REFERENCE_FOLDER
"""

import json
import sys
from pathlib import Path

import numpy as np
import rosbag
import yaml

HERE = Path(__file__).resolve().parent
SKIPPED = {'finite'}
KINDS = ('odom', 'imu', 'tf', 'command', 'set_pose')
OUTPUT_ROWS = 120


def nanoseconds(time):
    return time.secs * 10**9 + time.nsecs


def vector(v):
    return [v.x, v.y, v.z]


def quaternion(q):
    return [q.x, q.y, q.z, q.w]


def core(source):
    ekf, ukf = np.load(source / 'rl_core_ekf.npz'), np.load(source / 'rl_core_ukf.npz')
    thin = {name: ekf[name] for name in ekf.files if name not in SKIPPED}
    for name, array in thin.items():
        if array.dtype == np.float64 and name in ('state', 'cov_triu', 'sensitivity'):
            thin[name] = array.astype(np.float32) if name != 'state' else array
    np.savez_compressed(HERE / 'rl_core_ekf.npz', **thin)
    keep = [k for k in range(len(ukf['cov_steps'])) if k % 2 == 0 or k + 1 == len(ukf['cov_steps'])]
    np.savez_compressed(
        HERE / 'rl_core_ukf.npz',
        state=ukf['state'],
        cov_steps=ukf['cov_steps'][keep],
        cov_triu=ukf['cov_triu'][:, keep].astype(np.float32),
        comparable=ukf['comparable'],
        peer_defect=ukf['peer_defect'],
        ukf_alpha_kappa_beta=ukf['ukf_alpha_kappa_beta'],
        sensitivity=ukf['sensitivity'].astype(np.float32),
        last_measurement_time=ukf['last_measurement_time'],
    )


def rows_of(kind, topic, message):
    """(stamp, frame, child, values) of one message; a tf message may hold several."""
    if kind == 'odom':
        p, t = message.pose, message.twist
        yield (
            message.header.stamp,
            message.header.frame_id,
            message.child_frame_id,
            vector(p.pose.position)
            + quaternion(p.pose.orientation)
            + vector(t.twist.linear)
            + vector(t.twist.angular)
            + list(p.covariance)
            + list(t.covariance),
        )
    elif kind == 'imu':
        yield (
            message.header.stamp,
            message.header.frame_id,
            '',
            quaternion(message.orientation)
            + vector(message.angular_velocity)
            + vector(message.linear_acceleration)
            + list(message.orientation_covariance)
            + list(message.angular_velocity_covariance)
            + list(message.linear_acceleration_covariance),
        )
    elif kind == 'tf':
        for each in message.transforms:
            yield (
                each.header.stamp,
                each.header.frame_id,
                each.child_frame_id,
                vector(each.transform.translation) + quaternion(each.transform.rotation),
            )
    elif kind == 'command':
        yield None, '', '', vector(message.linear) + vector(message.angular)
    elif kind == 'set_pose':
        yield (
            message.header.stamp,
            message.header.frame_id,
            '',
            vector(message.pose.pose.position)
            + quaternion(message.pose.pose.orientation)
            + list(message.pose.covariance),
        )


def kind_of(topic):
    return {'/imu/data': 'imu', '/tf': 'tf', '/cmd_vel': 'command', '/set_pose': 'set_pose'}.get(topic, 'odom')


def bag(source, name):
    """All messages, topic by topic; `received` orders them. Columns that never change are stored once."""
    found = {}
    with rosbag.Bag(str(source / (name + '.bag'))) as file:
        for number, (topic, message, received) in enumerate(file.read_messages()):
            topic = '/' + topic.lstrip('/')
            kind = kind_of(topic)
            for stamp, frame, child, values in rows_of(kind, topic, message):
                frames = (kind, frame.lstrip('/'), child.lstrip('/'))
                found.setdefault((topic,) + frames, []).append(
                    (number, nanoseconds(received), nanoseconds(stamp) if stamp else 0, values)
                )
    arrays, topics = {}, []
    for k, (key, rows) in enumerate(found.items()):
        values = np.array([row[3] for row in rows], dtype=float)
        constant = (values == values[0]).all(axis=0)
        topics.append(list(key))
        arrays[f'{k}_number'] = np.array([row[0] for row in rows], dtype=np.int32)
        arrays[f'{k}_received'] = np.array([row[1] for row in rows])
        arrays[f'{k}_stamp'] = np.array([row[2] for row in rows])
        arrays[f'{k}_first'], arrays[f'{k}_varies'] = values[0], np.flatnonzero(~constant)
        arrays[f'{k}_values'] = values[:, ~constant]
    truth = np.load(source / (name + '_truth.npz'))
    arrays.update({'truth_' + field: truth[field][::2] for field in ('t', 'x', 'y', 'yaw')})
    index = json.loads((source / 'index.json').read_text())[name]
    np.savez_compressed(
        HERE / (name + '.npz'), topics=json.dumps(topics), static_tf=json.dumps(index['static_tf']), **arrays
    )


def run(source, name, kind):
    full = np.load(source / (name + '.npz'))
    rows = np.flatnonzero(full['valid'])
    # Every stored row of the beginning, where most goes wrong, then evenly.
    rows = np.unique(np.concatenate([rows[:20], rows[np.linspace(0, len(rows) - 1, OUTPUT_ROWS).astype(int)]]))
    parameters = yaml.safe_load((source / (name + '.yaml')).read_text())
    for key in ('process_noise_covariance', 'initial_estimate_covariance'):
        if key in parameters:
            matrix = np.reshape(parameters[key], (15, 15))
            assert (matrix == np.diag(matrix.diagonal())).all()
            parameters[key] = matrix.diagonal().tolist()
    tf = {'tf': full['tf'][rows].astype(np.float32)} if 'tf' in full.files else {}
    np.savez_compressed(
        HERE / (name + '.npz'),
        filter=kind,
        **tf,
        parameters=json.dumps(parameters),
        tick=full['tick_index'][rows],
        stamp=full['stamp'][rows],
        pose=full['pose'][rows],
        published=full['published'][rows],
        twist=full['twist'][rows].astype(np.float32),
        accel=full['accel'][rows].astype(np.float32),
        pose_cov_diag=full['pose_cov_diag'][rows],
        twist_cov_diag=full['twist_cov_diag'][rows],
        last_tick=full['last_valid_tick'],
    )


def main():
    np.seterr(over='ignore')
    reference = Path(sys.argv[1])
    core(reference)
    source = reference / 'rl_synth'
    for name, entry in json.loads((source / 'index.json').read_text()).items():
        bag(source, name)
        for each, settings in entry['runs'].items():
            run(source, f'{name}__{each}', settings['filter'])


if __name__ == '__main__':
    main()
