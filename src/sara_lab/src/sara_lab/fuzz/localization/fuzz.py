"""Random messages at the filter: what sensors, drivers and clocks get wrong, in every combination.

`fuzz(count, seed)` throws `count` messages at filters of random configurations and tells what came of it. Nothing may
be raised, every output must be finite with a symmetric positive definite covariance, and every kind of problem is said
once per input.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.filters import covariance
from sara_localization.geometry.rigid import Transform
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import ImuData, OdometryData, PoseData, TwistData

MESSAGES_PER_FILTER = 400
WEIRD = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1e-320, 1e-30, 1e15, -1e15, 1e300, -1e300)
FRAMES = ('odom', 'map', 'base_link', 'imu_link', 'far_link', 'nowhere', '', '/odom', '/')
INPUTS = ('odom0', 'odom1', 'pose0', 'twist0', 'imu0', 'imu1')


@dataclass
class FuzzReport:
    """messages, ticks, outputs: counts; problems: Counter of kinds; faults: what must not happen, one sentence each."""

    messages: int = 0
    ticks: int = 0
    outputs: int = 0
    problems: Counter = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)


def fuzz(
    count: int, seed: int, progress: Callable[[int], object] | None = None, backend: str = 'compiled'
) -> FuzzReport:
    """`count` messages from a seed; `progress`, if given, is called with the number of messages so far.
    `backend`: the filters' parameter of that name.
    """
    report, rng = FuzzReport(), np.random.default_rng(seed)
    while report.messages < count and len(report.faults) < 20:
        _one_filter(rng, min(MESSAGES_PER_FILTER, count - report.messages), report, backend)
        if progress:
            progress(report.messages)
    return report


def _one_filter(rng, count, report, backend):
    parameters, kind = _parameters(rng)
    parameters['backend'] = backend
    said = []
    buffer = TransformBuffer()
    buffer.set_transform('base_link', 'imu_link', _transform(rng))
    buffer.set_transform('base_link', 'far_link', Transform((1e6, -1e6, 0.0)))
    buffer.set_transform('odom', 'base_link', Transform(), 1.6e9)
    if rng.random() < 0.5:
        buffer.set_transform('map', 'odom', _transform(rng))
    engine = FilterEngine(FilterConfig.from_params(parameters, kind), buffer, said.append)
    now = 1.6e9
    for _ in range(count):
        report.messages += 1
        with np.errstate(all='ignore'):
            try:
                now = _step(rng, engine, now, report)
            except Exception as error:  # pylint: disable=broad-except
                report.faults.append(
                    f'seed state lost after {report.messages} messages ({kind}, {parameters}): '
                    f'{type(error).__name__}: {error}'
                )
                return
    for status in engine.inputs.values():
        report.problems.update(status.problems)
    twice = [
        sentence
        for sentence, n in Counter(s.split(' at ')[0] for s in said if 'time went back' not in s).items()
        if n > 1 and 'no longer finite' not in sentence and 'set_pose' not in sentence and 'command' not in sentence
    ]
    if twice:
        report.faults.append(f'said more than once: {twice[0]}')
    if engine.not_finite:
        report.faults.append(f'the state was not finite {engine.not_finite} times ({kind}, {parameters})')


def _step(rng, engine, now, report):
    """One message, and now and then a tick, a jump of the clock, a command, set_pose, a switch."""
    name = INPUTS[rng.integers(len(INPUTS))]
    stamp = _stamp(rng, now)
    _message(rng, engine, name, stamp)
    chance = rng.random()
    if chance < 0.005:
        now += float(rng.choice([-1e9, -100.0, -0.5, 100.0, 1e6]))
    elif chance < 0.01:
        engine.set_pose(PoseData(stamp, _frame(rng), _vector(rng, 5.0), _quaternion(rng), _covariance(rng, 6)), now)
    elif chance < 0.02:
        engine.add_control(_vector(rng, 1.0) + _vector(rng, 1.0), stamp)
    elif chance < 0.025:
        engine.toggle(bool(rng.integers(2)))
    elif chance < 0.03:
        engine.enable()
    if rng.random() < 0.5:
        now += rng.uniform(0.0, 0.1)
        report.ticks += 1
        _judge(engine.tick(now), report)
    return now


def _message(rng, engine, name, stamp):
    """A message for one of INPUTS."""
    if name.startswith('odom'):
        engine.add_odometry(
            name,
            OdometryData(
                stamp,
                _frame(rng),
                _frame(rng),
                _vector(rng, 5.0),
                _quaternion(rng),
                _covariance(rng, 6),
                _vector(rng, 1.0),
                _vector(rng, 1.0),
                _covariance(rng, 6),
            ),
        )
    elif name.startswith('pose'):
        engine.add_pose(name, PoseData(stamp, _frame(rng), _vector(rng, 5.0), _quaternion(rng), _covariance(rng, 6)))
    elif name.startswith('twist'):
        engine.add_twist(name, TwistData(stamp, _frame(rng), _vector(rng, 1.0), _vector(rng, 1.0), _covariance(rng, 6)))
    else:
        engine.add_imu(
            name,
            ImuData(
                stamp,
                _frame(rng),
                _quaternion(rng),
                _covariance(rng, 3),
                _vector(rng, 1.0),
                _covariance(rng, 3),
                _vector(rng, 10.0),
                _covariance(rng, 3),
            ),
        )


def _judge(output, report):
    if output is None:
        return
    report.outputs += 1
    numbers = [
        output.state,
        output.covariance.ravel(),
        output.angular_acceleration,
        output.pose.translation,
        output.pose.rotation,
        output.angular_acceleration_covariance.ravel(),
    ]
    if output.transform is not None:
        numbers += [output.transform.transform.translation, output.transform.transform.rotation]
    if not np.isfinite(np.concatenate([np.asarray(n, dtype=float) for n in numbers])).all():
        report.faults.append(f'an output is not finite: {output.state}')
    elif not ((output.covariance == output.covariance.T).all() and covariance.positive_definite(output.covariance)):
        report.faults.append('a covariance is not symmetric and positive definite')
    elif np.abs(output.state[3:6]).max() > math.pi + 1e-9:
        report.faults.append(f'an angle is not wrapped: {output.state[3:6]}')


def _parameters(rng):
    def coin(chance=0.5):
        return bool(rng.random() < chance)

    parameters = {name: '/' + name for name in INPUTS}
    for name in INPUTS:
        parameters[name + '_config'] = [coin() for _ in range(15)]
        if not name.startswith('twist'):
            parameters[name + '_differential'], parameters[name + '_relative'] = coin(0.3), coin(0.3)
        if name.startswith('imu'):
            parameters[name + '_remove_gravitational_acceleration'] = coin()
            parameters[name + '_gyro_bias'] = str(rng.choice(['off', 'standstill', 'state']))
        if name.startswith('odom'):
            parameters[name + '_pose_use_child_frame'] = coin(0.3)
            parameters[name + '_turning_noise'] = [0.1, 0.0, 0.2] if coin(0.3) else [0.0] * 3
            parameters[name + '_twist_rejection_threshold'] = 3.0 if coin(0.3) else 1e9
    parameters.update(
        frequency=30,
        world_frame=str(rng.choice(['map', 'odom'])),
        two_d_mode=coin(),
        use_control=coin(),
        control_config=[coin() for _ in range(6)],
        smooth_lagged_data=coin(),
        history_length=0.5,
        predict_to_current_time=coin(),
        dynamic_process_noise_covariance=coin(0.3),
        reset_on_time_jump=coin(),
        disabled_at_startup=coin(0.1),
        standstill_update=coin(0.3),
        invert_tf=coin(0.2),
        join_at_odometry_time=coin(),
    )
    return parameters, 'ukf' if coin() else 'ekf'


def _number(rng, size):
    return float(WEIRD[rng.integers(len(WEIRD))]) if rng.random() < 0.02 else float(rng.normal() * size)


def _vector(rng, size):
    return (0.0, 0.0, 0.0) if rng.random() < 0.3 else tuple(_number(rng, size) for _ in range(3))


def _quaternion(rng):
    chance = rng.random()
    if chance < 0.05:
        return (0.0, 0.0, 0.0, 0.0)
    q = rng.normal(size=4)
    q = q / np.linalg.norm(q) if chance < 0.8 else q
    if chance > 0.97:
        q[rng.integers(4)] = WEIRD[rng.integers(len(WEIRD))]
    return tuple(q.tolist())


def _covariance(rng, n):
    chance = rng.random()
    if chance < 0.4:
        return np.diag(10.0 ** rng.uniform(-9, 3, n))
    if chance < 0.6:
        A = rng.normal(size=(n, n))
        return A @ A.T * 10.0 ** rng.uniform(-6, 2)
    matrix = np.diag(10.0 ** rng.uniform(-9, 3, n)) if chance < 0.8 else rng.normal(size=(n, n))
    for _ in range(rng.integers(1, 4)):
        matrix[rng.integers(n), rng.integers(n)] = -1.0 if rng.random() < 0.3 else WEIRD[rng.integers(len(WEIRD))]
    return matrix


def _frame(rng):
    return FRAMES[rng.integers(5 if rng.random() < 0.9 else len(FRAMES))]


def _stamp(rng, now):
    chance = rng.random()
    if chance < 0.9:
        return now - rng.uniform(0.0, 0.3) * (rng.random() < 0.2)
    if chance < 0.95:
        return now + rng.normal() * 10.0 ** rng.uniform(-3, 7)
    return float(rng.choice([0.0, -1.0, math.nan, math.inf, 1e-9, 4e9]))


def _transform(rng):
    return Transform.from_xyz_rpy(*rng.normal(size=3), *rng.uniform(-3, 3, 3))
