"""E4 and E5: the sensor node's two filters side by side, at rest and turning, and the variances of the calibrated
sensor (thesis 4.2.3.1, 4.2.3.2).

Both filters run in the same sensor node on the same samples; their angles are read from the bus, yaw unwrapped there
(it is sent modulo 65.536 deg).
"""

import math
from contextlib import contextmanager

import numpy as np

from canserial.dbc.bus import BusDescription
from canserial.reader.config import ReaderConfig
from sara_lab.experiments import core, plotting, sensor_experiments, sensor_figures
from sara_lab.experiments.agreement import Figure, every_case
from sara_lab.experiments.core import CONFIRMED, PARTLY, Case, Experiment, Report, Row, interval, spread
from sara_lowlevel.sensor import complementary, madgwick
from sara_sim.chair import STEP_S, SimulatedChair
from sara_sim.world.world import World

FRAMES = {'complementary': ('COMPLEMENTARY', ('rx', 'ry', 'rz')), 'madgwick': ('MADGWICK', ('roll', 'pitch', 'yaw'))}
SPAN_DEG = 65.536
VARIANCES = {
    'accel': (0.0032, 0.0011, 0.0020),
    'gyro': (0.0084, 0.0091, 0.0051),
    'angles': (0.01, 0.01, 0.0098),
}  # table 4.10


class Listener:
    """What the frames of a chair say of its angles and rates, while somebody steps it."""

    def __init__(self, bus):
        self.bus, self.rows = bus, {name: [] for name in (*FRAMES, 'gyro', 'accel')}

    def hear(self, frame, true_yaw):
        """A frame, and the true yaw (rad) at its time."""
        name, values = self.bus.decode(frame)
        for key, (message, fields) in FRAMES.items():
            if name == message:
                self.rows[key].append((frame.time, *(values[field] for field in fields), math.degrees(true_yaw)))
        if name == 'IMPACT_GYRO':
            self.rows['gyro'].append((frame.time, values['gx'], values['gy'], values['gz']))
        elif name == 'RANGE_ACCEL':
            self.rows['accel'].append((frame.time, values['ax'], values['ay'], values['az']))

    def arrays(self):
        """{name: (n, k)}; angles in deg with yaw unwrapped and from zero, their last column the true yaw from zero."""
        found = {key: np.array(rows) for key, rows in self.rows.items()}
        for key in FRAMES:
            found[key][:, 3] = unwrapped(found[key][:, 3])
            found[key][:, 4] -= found[key][0, 4]
        return found


def unwrapped(yaw):
    """A yaw from zero, unwrapped, deg, of one that is sent modulo 65.536 deg; Madgwick's is in +-180 deg before that: a
    step of a whole turn may be in it. A chair turns far less than 16 deg between two frames.
    """
    step = np.diff(yaw)
    steps = np.array([(step + turn + SPAN_DEG / 2) % SPAN_DEG - SPAN_DEG / 2 for turn in (0.0, 360.0, -360.0)])
    smallest = steps[np.abs(steps).argmin(axis=0), np.arange(len(step))]
    return np.concatenate([[0.0], np.cumsum(smallest)])


def at_rest(seed, bus=None, seconds=sensor_experiments.MINUTE_S):
    """Arrays of a minute at rest, the sensor node calibrated."""
    bus = bus or BusDescription.default()
    chair, listener = SimulatedChair(World.empty(), seed, bus=bus), Listener(bus)
    for _ in range(round(seconds / STEP_S)):
        for frame in chair.step():
            listener.hear(frame, chair.drive.yaw)
    return listener.arrays()


class _Turner(sensor_experiments.Turner):
    def __init__(self, seed):
        self.listener = Listener(BusDescription.default())
        super().__init__(seed, calibration_time=ReaderConfig().calibration_time)

    def _step(self):
        for frame in self.chair.step():
            self.reader.on_frame(frame)
            self.listener.hear(frame, self.chair.drive.yaw)


def turning(seed, angle):
    """Arrays of a full turn."""
    turner = _Turner(seed)
    turner.listener = Listener(BusDescription.default())
    turner.turn_to(angle)
    return turner.listener.arrays()


def case(seed):
    """Drift, spread and the share of a full turn of both filters; of chair 0 the arrays too."""
    rest, turns = at_rest(seed), [turning(seed, angle) for angle in (360.0, -360.0)]
    result = compared(rest, turns)
    if seed == 0:
        result['trace'] = {'rest': rest, 'turns': turns, 'last': at_rest(seed, sensor_experiments.tenths())}
    return result


def compared(rest, turns):
    """The result of the arrays of a minute at rest and of a full turn each way."""
    result = {
        key: {
            'drift': float(rest[key][-1, 3]),
            'sigma': rest[key][:, 1:3].std(axis=0, ddof=1).tolist(),
            'share': [float(turn[key][-1, 3] / turn[key][-1, 4]) for turn in turns],
            'tilt_in_turn': [float(np.abs(turn[key][:, 1:3] - rest[key][:, 1:3].mean(axis=0)).max()) for turn in turns],
        }
        for key in FRAMES
    }
    result['variances'] = {
        'accel': rest['accel'][:, 1:].var(axis=0, ddof=1).tolist(),
        'gyro': rest['gyro'][:, 1:].var(axis=0, ddof=1).tolist(),
        'angles': rest['complementary'][:, 1:3].var(axis=0, ddof=1).tolist()
        + [float(np.var(rest['complementary'][:, 3], ddof=1))],
    }
    return result


class _Counted(float):
    """A float that counts what is done with it in `operations`."""

    operations = 0


def _counting(name):
    def operation(self, *others):
        _Counted.operations += 1
        return _Counted(getattr(float, name)(self, *others))

    return operation


for _name in ('add', 'radd', 'sub', 'rsub', 'mul', 'rmul', 'truediv', 'rtruediv'):
    setattr(_Counted, f'__{_name}__', _counting(f'__{_name}__'))


@contextmanager
def _counted_functions(module, calls):
    """Let a module's functions of math count themselves in `calls`, a list."""
    kept = {name: getattr(module, name) for name in ('atan2', 'hypot', 'sqrt') if hasattr(module, name)}
    for name, function in kept.items():
        setattr(
            module,
            name,
            lambda *values, function=function, name=name: (calls.append(name), _Counted(function(*values)))[1],
        )
    try:
        yield
    finally:
        for name, function in kept.items():
            setattr(module, name, function)


def costs():
    """{filter: (floating-point operations, calls of atan2, hypot, sqrt) of one update}, counted on the code that the
    sensor node runs.
    """
    sample, found = [_Counted(value) for value in (0.1, -0.2, 0.3, 0.4, 0.5, 9.6)], {}
    filters = {
        'complementary': (
            complementary,
            complementary.ComplementaryFilter(0.9, STEP_S),
            lambda f: f.update(tuple(sample[3:]), tuple(sample[:3]), _Counted(STEP_S)),
        ),
        'madgwick': (
            madgwick,
            madgwick.MadgwickFilter(_Counted(0.05)),
            lambda f: f.update(tuple(sample[3:]), tuple(sample[:3]), _Counted(STEP_S)),
        ),
    }
    for name, (module, one, update) in filters.items():
        update(one)  # the first sample sets it
        if name == 'madgwick':
            one.q = tuple(map(_Counted, one.q))
        calls, _Counted.operations = [], 0
        with _counted_functions(module, calls):
            update(one)
        found[name] = (_Counted.operations, len(calls))
    return found


def _of(results):
    return [result for key, result in sorted(results.items()) if key[0] == 'orientation']


def filters(results):
    """E4."""
    found, cost = _of(results), costs()
    drift = {key: np.array([result[key]['drift'] for result in found]) for key in FRAMES}
    share = {key: np.array([result[key]['share'] for result in found]) for key in FRAMES}
    apart, rows = np.abs(drift['complementary'] - drift['madgwick']), []
    for key, name in (('complementary', 'complementary'), ('madgwick', 'Madgwick')):
        rows.append(
            Row(
                f'{name}: |yaw| after a minute at rest',
                'drifts, in proportion to time',
                interval(spread(np.abs(drift[key])), 2, 'deg'),
                "the offset that the sensor node's calibration leaves (E3)",
            )
        )
        rows.append(
            Row(
                f'{name}: share of a full turn',
                '0.924 (332.5 of 360)' if key == 'complementary' else 'alike',
                interval(spread(share[key].ravel()), 4),
                "the gyroscope's scale, which neither can know",
            )
        )
        rows.append(
            Row(
                f'{name}: sigma of roll, pitch at rest',
                '+-0.02 deg (figure 4.13)' if key == 'madgwick' else '0.1 deg (table 4.10)',
                ' and '.join(interval(spread([result[key]['sigma'][k] for result in found]), 3, 'deg') for k in (0, 1)),
                'beta and A weigh gravity against the gyroscope'
                if key == 'madgwick'
                else "a tenth of each sample's gravity angle goes through, and with it its noise",
            )
        )
        rows.append(
            Row(
                f'{name}: one update costs',
                'more' if key == 'madgwick' else 'less',
                f'{cost[key][0]} operations and {cost[key][1]} calls of atan2, hypot, sqrt',
                "counted on the node's own code",
            )
        )
    findings = (
        (
            'the yaw of both drifts alike',
            f'after a minute they are {apart.mean():.3f} deg apart on average, having drifted '
            f'{np.abs(drift["complementary"]).mean():.2f} and {np.abs(drift["madgwick"]).mean():.2f} deg',
            CONFIRMED if apart.max() < 0.5 * np.abs(drift['complementary']).mean() else PARTLY,
        ),
        (
            "Madgwick's needs the factor k as well",
            f'it turns {share["madgwick"].mean():.3f} of the true angle, the complementary filter '
            f'{share["complementary"].mean():.3f}',
            CONFIRMED if abs(share['madgwick'].mean() - share['complementary'].mean()) < 0.01 else PARTLY,
        ),
        (
            "Madgwick's costs more and gains nothing",
            f'{cost["madgwick"][0]} operations instead of {cost["complementary"][0]}, and no less drift; its roll and '
            'pitch are steadier '
            f'({np.mean([result["madgwick"]["sigma"] for result in found]):.3f} instead of '
            f'{np.mean([result["complementary"]["sigma"] for result in found]):.3f} deg), which navigation in the '
            'plane does not use',
            CONFIRMED if cost['madgwick'][0] > cost['complementary'][0] else PARTLY,
        ),
    )
    trace = found[0]['trace']
    figures = (
        core.Figure(
            sensor_figures.name(12),
            "Angles of Madgwick's filter with the chair at rest, the complementary filter's beside them (chair 0).",
            lambda path: _angles(path, trace['rest'], 'both'),
        ),
        core.Figure(
            sensor_figures.name(13),
            "Angles at rest with the last firmware (rates in tenths), calibrated, Madgwick's filter (chair 0). The "
            "mean of a minute is taken off roll and pitch, which show the mounting's tilt.",
            lambda path: _angles(path, trace['last'], 'madgwick'),
        ),
        core.Figure(
            sensor_figures.name(15),
            "Histograms of roll and pitch at rest, last firmware, Madgwick's filter (chair 0).",
            lambda path: sensor_figures.histograms(
                path,
                trace['last']['madgwick'][:, 1:3] - trace['last']['madgwick'][:, 1:3].mean(axis=0),
                ('roll', 'pitch'),
                'deg',
            ),
        ),
        core.Figure(
            sensor_figures.name(18),
            "Angular velocity and turned angle of a full turn each way by Madgwick's filter, as measured and times k "
            '(chair 0).',
            lambda path: sensor_figures.turn_both_ways(
                path, [_turn(turn) for turn in trace['turns']], 'Madgwick', 'times k ='
            ),
        ),
    )
    data = {
        'cost': {key: {'operations': value[0], 'calls': value[1]} for key, value in cost.items()},
        'apart_deg': spread(apart),
        **{f'{key}_drift_deg': spread(np.abs(drift[key])) for key in FRAMES},
        **{f'{key}_share': spread(share[key].ravel()) for key in FRAMES},
    }
    return Report(
        findings, tuple(rows), figures, data=data, short="Both drift alike and need k; Madgwick's costs more."
    )


def _turn(arrays):
    t, angle, true = arrays['madgwick'][:, 0], arrays['madgwick'][:, 3], arrays['madgwick'][:, 4]
    rate = np.interp(t, arrays['gyro'][:, 0], arrays['gyro'][:, 3])
    return t - t[0], rate, angle, true, float(true[-1] / angle[-1])


def _angles(path, arrays, which):
    with plotting.figure(path, 3, size=(9, 7), sharex=True) as (_, axes):
        for k, (axis, name) in enumerate(zip(axes, ('roll', 'pitch', 'yaw'))):
            for key, colour, label in (
                ('complementary', plotting.WHEELS, 'complementary'),
                ('madgwick', plotting.FUSED, 'Madgwick'),
            ):
                if which in ('both', key):
                    values = arrays[key][:, k + 1] - (
                        arrays[key][:, k + 1].mean() if k < 2 and which != 'both' else 0.0
                    )
                    plotting.series(axis, arrays[key][:, 0] - arrays[key][0, 0], values, colour, label, linewidth=0.9)
            axis.set(ylabel=f'{name} (deg)')
            low, high = axis.get_ylim()
            axis.set_ylim(low, high + 0.3 * (high - low))
            axis.legend(loc='upper left', ncols=2)
        axes[-1].set_xlabel('time (s)')


def covariances(results):
    """E5."""
    found, rows, data, faults = _of(results), [], {}, []
    units = {
        'accel': ('(m/s2)2', 'noise drawn between tables 4.1 and 4.2'),
        'gyro': (
            '(deg/s)2',
            'noise of table 4.5; the thesis publishes the number as (rad/s)2, which is 3283 times too large',
        ),
        'angles': ('deg2', ''),
    }
    for kind, (unit, why) in units.items():
        for k, axis in enumerate('xyz'):
            ours = spread([result['variances'][kind][k] for result in found])
            data[f'{kind}_{axis}'] = ours
            reason = why
            if kind == 'angles':
                reason = (
                    "the noise of one sample's gravity angle, a tenth of which goes through the filter"
                    if k < 2
                    else 'yaw has no reference: over a minute this is drift, not noise, and grows with its square'
                )
            rows.append(
                Row(
                    f'{ {"accel": "acceleration", "gyro": "angular velocity", "angles": "angle"}[kind] } {axis}',
                    f'{VARIANCES[kind][k]:g}',
                    interval(ours, 4, unit),
                    reason,
                )
            )
    published = np.array(ReaderConfig().variances[1])
    measured = np.radians(1.0) ** 2 * np.array([data[f'gyro_{axis}']['mean'] for axis in 'xyz'])
    rows.append(
        Row(
            'angular velocity, as published',
            '0.0084, 0.0091, 0.0051 (rad/s)2',
            ', '.join(f'{value:.2g}' for value in published)
            + f' (rad/s)2; measured {", ".join(f"{value:.2g}" for value in measured)}',
            'ours are in the unit that the message asks for',
        )
    )
    within = {
        kind: [data[f'{kind}_{axis}']['mean'] / VARIANCES[kind][k] for k, axis in enumerate('xyz')]
        for kind in VARIANCES
    }
    inside = all(1 / 4 <= ratio <= 4 for kind in ('accel', 'gyro') for ratio in within[kind])
    findings = (
        (
            "table 4.10's variances of accelerometer and gyroscope",
            f'ours are {min(within["accel"] + within["gyro"]):.2f} to {max(within["accel"] + within["gyro"]):.2f} '
            'times those',
            CONFIRMED if inside else PARTLY,
        ),
        (
            'they are the variances to give the filter',
            "the gyroscope's only in (rad/s)2: as the thesis publishes them the filter almost ignores the measured "
            "turn rate. `thesis_covariances:=true` publishes the listing's",
            PARTLY,
        ),
    )
    if not np.all((published / measured > 0.5) & (published / measured < 2.0)):
        faults.append("read.py's variances of the turn rate are not what the sensor shows")
    return Report(
        findings,
        tuple(rows),
        data={'variances': data},
        faults=tuple(faults),
        short="As table 4.10, but for the unit in which the thesis publishes the gyroscope's.",
    )


def _figures_of_filters(result):
    """What of a result is compared with a run over ROS."""
    return {
        Figure(f'{name}: {what}', digits): value
        for key, name in (('complementary', 'complementary'), ('madgwick', 'Madgwick'))
        for what, digits, value in (
            ('yaw after a minute, deg', 2, result[key]['drift']),
            ('share of a full turn', 4, float(np.mean(result[key]['share']))),
            ('sigma of roll, deg', 3, result[key]['sigma'][0]),
        )
    }


def _figures_of_variances(result):
    """The same of E5."""
    return {
        Figure(f'{kind} {axis}, {unit}', 5): result['variances'][kind][k]
        for kind, unit in (('accel', '(m/s2)2'), ('gyro', '(deg/s)2'), ('angles', 'deg2'))
        for k, axis in enumerate('xyz')
    }


def _cases(seeds):
    return [Case(('orientation', seed), case, seed) for seed in range(seeds)]


EXPERIMENTS = (
    Experiment(
        'E4',
        "complementary filter against Madgwick's",
        'Both filters run in the sensor node on the same samples (A = 0.9; beta as configured): a minute at rest, and '
        'a full turn each way (thesis 4.2.3.1 b, figures 4.12 to 4.18).',
        10,
        _cases,
        filters,
        every_case,
        _figures_of_filters,
    ),
    Experiment(
        'E5',
        'variances of the calibrated sensor',
        'Variances over the minute at rest of E4, the sensor node calibrated (thesis 4.2.3.2).',
        10,
        _cases,
        covariances,
        every_case,
        _figures_of_variances,
    ),
)
