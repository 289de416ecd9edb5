"""The synthetic bags of test/data, their reference runs, and the lockstep rule: a filter driven by recorded messages.

Messages are delivered in the order and at the times they were received; tick k comes k/frequency after the first used
message (/tf counts) and runs after all that was received by then; five ticks follow the last. The filter's own
transform enters right after the tick that gives it.
"""

import json
import math
from pathlib import Path

import numpy as np

from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.geometry.rigid import Transform
from sara_localization.geometry.stamps import Stamp
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import ImuData, OdometryData, PoseData

DATA = Path(__file__).resolve().parents[1] / 'data'
BAGS = (
    's1_eight_50_100',
    's2_square_chair',
    's3_gaps_20',
    's4_out_of_order',
    's5_spin_setpose',
    's6_control_two_odoms',
)
RUNS = sorted(path.stem for path in DATA.glob('*__*.npz'))
TAU = 2.0 * math.pi


def stamp_of(nanoseconds):
    return Stamp(*divmod(int(nanoseconds), 10**9))


def _odometry(stamp, frame, child, v):
    return OdometryData(
        stamp, frame, child, v[:3], v[3:7], v[13:49].reshape(6, 6), v[7:10], v[10:13], v[49:85].reshape(6, 6)
    )


def _imu(stamp, frame, child, v):
    return ImuData(
        stamp, frame, v[:4], v[10:19].reshape(3, 3), v[4:7], v[19:28].reshape(3, 3), v[7:10], v[28:37].reshape(3, 3)
    )


def _pose(stamp, frame, child, v):
    return PoseData(stamp, frame, v[:3], v[3:7], v[7:43].reshape(6, 6))


def _transform(stamp, frame, child, v):
    return frame, child, Transform(tuple(v[:3].tolist()), tuple(v[3:7].tolist())), stamp


def _command(stamp, frame, child, v):
    return v


MAKE = {'odom': _odometry, 'imu': _imu, 'set_pose': _pose, 'tf': _transform, 'command': _command}


class RecordedBag:
    """messages: [(received ns, topic, kind, data)]; static: [(parent, child, Transform)]; truth: {t, x, y, yaw}."""

    def __init__(self, name):
        arrays = np.load(DATA / (name + '.npz'))
        found = []
        for k, (topic, kind, frame, child) in enumerate(json.loads(str(arrays['topics']))):
            number, received, stamps, first, varies, values = (
                arrays[f'{k}_{part}'] for part in ('number', 'received', 'stamp', 'first', 'varies', 'values')
            )
            rows = np.tile(first, (len(number), 1))
            rows[:, varies] = values
            for n, at, stamp, row in zip(number, received, stamps, rows):
                found.append((int(n), int(at), topic, kind, MAKE[kind](stamp_of(stamp), frame, child, row)))
        self.messages = [row[1:] for row in sorted(found, key=lambda row: row[0])]
        self.static = [
            (p, c, Transform.from_xyz_rpy(x, y, z, roll, pitch, yaw))
            for p, c, x, y, z, yaw, pitch, roll in json.loads(str(arrays['static_tf']))
        ]
        self.truth = {field: arrays['truth_' + field] for field in ('t', 'x', 'y', 'yaw')}

    def error(self, t, xy, yaw):
        """RMS distance (m) to the truth at times t (s), after the first pose was laid upon the true one."""
        x, y, heading = (np.interp(t, self.truth['t'], self.truth[field]) for field in ('x', 'y', 'yaw'))
        turn = heading[0] - yaw[0]
        c, s = math.cos(turn), math.sin(turn)
        dx, dy = (xy - xy[0]).T
        return float(np.sqrt(np.mean((x[0] + c * dx - s * dy - x) ** 2 + (y[0] + s * dx + c * dy - y) ** 2)))


class Run:
    """A reference run: its parameters and what came out at the ticks `tick`."""

    def __init__(self, name):
        self.name, self.bag = name, name.split('__')[0]
        arrays = np.load(DATA / (name + '.npz'))
        self.filter, self.parameters = str(arrays['filter']), json.loads(str(arrays['parameters']))
        self.tick, self.stamp, self.pose, self.published = (arrays[k] for k in ('tick', 'stamp', 'pose', 'published'))
        self.twist, self.accel, self.last_tick = arrays['twist'], arrays['accel'], int(arrays['last_tick'])
        self.variances = np.hstack([arrays['pose_cov_diag'], arrays['twist_cov_diag']])
        self.tf = arrays['tf'] if 'tf' in arrays.files else None


def yaw_of(q):
    return np.arctan2(2 * (q[..., 3] * q[..., 2] + q[..., 0] * q[..., 1]), 1 - 2 * (q[..., 1] ** 2 + q[..., 2] ** 2))


def play(bag: RecordedBag, parameters, filter='ekf', engine_class=FilterEngine, **changes):
    """(engine, {tick: FilterOutput}, time of the first message) of a run over a bag."""
    config = FilterConfig.from_params({**parameters, **changes}, filter)
    buffer = TransformBuffer()
    for parent, child, transform in bag.static:
        buffer.set_transform(parent, child, transform)
    engine, outputs, start, ticks = engine_class(config, buffer), {}, None, 0
    by_topic = {}
    for i in config.inputs:
        by_topic.setdefault('/' + i.topic.lstrip('/'), []).append(i)
    add = {'odom': engine.add_odometry, 'imu': engine.add_imu}

    def tick_time(k):
        return start + round(k * 1e9 / config.frequency)

    def tick(k):
        output = engine.tick(float(stamp_of(tick_time(k))))
        if output is not None:
            outputs[k] = output
            if output.transform is not None:
                t = output.transform
                buffer.set_transform(t.parent, t.child, t.transform, t.stamp)

    for received, topic, kind, data in bag.messages:
        if topic not in by_topic and kind not in ('tf', 'set_pose', 'command'):
            continue
        if start is None and (topic in by_topic or kind == 'tf'):
            start = received
        while start is not None and tick_time(ticks + 1) < received:
            ticks += 1
            tick(ticks)
        if kind == 'tf':
            buffer.set_transform(*data)
        elif kind == 'set_pose':
            engine.set_pose(data, float(stamp_of(received)))
        elif kind == 'command':
            engine.add_control(data, float(stamp_of(received)))
        for i in by_topic.get(topic, ()):
            add[i.kind](i.name, data)
    for _ in range(5):
        ticks += 1
        tick(ticks)
    return engine, outputs, float(stamp_of(start))


def table():
    """Prints, for every run, how far ours is from the peer's node and how far both are from the truth."""
    bags = {name: RecordedBag(name) for name in BAGS}
    print('| run | filter | position, largest difference (m) | angle (rad) | ours off the truth (m) | the peer (m) |')
    print('| --- | --- | --- | --- | --- | --- |')
    for name in RUNS:
        run = Run(name)
        _, outputs, _ = play(bags[run.bag], run.parameters, run.filter)
        ours = [outputs[k] for k in run.tick]
        xyz, q = (np.array([getattr(o.pose, part) for o in ours]) for part in ('translation', 'rotation'))
        q *= np.sign((q * run.pose[:, 3:]).sum(axis=1))[:, None]
        off = [
            bags[run.bag].error(run.stamp, xy, yaw)
            for xy, yaw in (
                (xyz[:, :2], np.array([o.state[5] for o in ours])),
                (run.pose[:, :2], yaw_of(run.pose[:, 3:])),
            )
        ]
        print(
            '| {} | {} | {:.1e} | {:.1e} | {:.4f} | {:.4f} |'.format(
                name,
                run.filter,
                np.linalg.norm(xyz - run.pose[:, :3], axis=1).max(),
                2.0 * np.linalg.norm(q - run.pose[:, 3:], axis=1).max(),
                *off,
            )
        )


if __name__ == '__main__':
    table()
