"""E5: what is reported of the variances of the calibrated sensor (thesis 4.2.3.2)."""

import numpy as np

from canserial.reader.config import ReaderConfig
from sara_lab.experiments.agreement import Figure, every_case
from sara_lab.experiments.core import CONFIRMED, PARTLY, Experiment, Report, Results, Row, interval, results_of, spread
from sara_lab.experiments.orientation import cases

VARIANCES = {
    'accel': (0.0032, 0.0011, 0.0020),
    'gyro': (0.0084, 0.0091, 0.0051),
    'angles': (0.01, 0.01, 0.0098),
}  # table 4.10
NAMES = {'accel': 'acceleration', 'gyro': 'angular velocity', 'angles': 'angle'}
UNITS = {'accel': '(m/s2)2', 'gyro': '(deg/s)2', 'angles': 'deg2'}


def covariances(results: Results) -> Report:
    """E5's Report."""
    found = results_of(results, 'orientation')
    data = {
        f'{kind}_{axis}': spread([result['variances'][kind][k] for result in found])
        for kind in UNITS
        for k, axis in enumerate('xyz')
    }
    published = np.array(ReaderConfig.of().variances[1])
    measured = np.radians(1.0) ** 2 * np.array([data[f'gyro_{axis}']['mean'] for axis in 'xyz'])
    faults = []
    if not np.all((published / measured > 0.5) & (published / measured < 2.0)):
        faults.append("read.py's variances of the turn rate are not what the sensor shows")
    return Report(
        _findings_of_variances(data),
        (*_rows_of_variances(data), _row_as_published(published, measured)),
        data={'variances': data},
        faults=tuple(faults),
        short="As table 4.10, but for the unit in which the thesis publishes the gyroscope's.",
    )


def _rows_of_variances(data):
    for kind, unit in UNITS.items():
        for k, axis in enumerate('xyz'):
            yield Row(
                f'{NAMES[kind]} {axis}',
                f'{VARIANCES[kind][k]:g}',
                interval(data[f'{kind}_{axis}'], 4, unit),
                _why(kind, k),
            )


def _why(kind, k):
    """What explains the difference in an axis' variance."""
    if kind == 'accel':
        return 'noise between tables 4.1 and 4.2'
    if kind == 'gyro':
        return 'the thesis publishes the number as (rad/s)2, 3283 times too large'
    if k < 2:
        return "noise of one sample's gravity angle, a tenth of which goes through"
    return 'yaw has no reference: this is drift, not noise'


def _row_as_published(published, measured):
    return Row(
        'angular velocity, as published',
        '0.0084, 0.0091, 0.0051 (rad/s)2',
        ', '.join(f'{value:.2g}' for value in published)
        + f' (rad/s)2; measured {", ".join(f"{value:.2g}" for value in measured)}',
        'ours are in the unit of the message',
    )


def _findings_of_variances(data):
    within = {
        kind: [data[f'{kind}_{axis}']['mean'] / VARIANCES[kind][k] for k, axis in enumerate('xyz')]
        for kind in VARIANCES
    }
    inside = all(1 / 4 <= ratio <= 4 for kind in ('accel', 'gyro') for ratio in within[kind])
    return (
        (
            "table 4.10's variances of accelerometer and gyroscope",
            f'ours are {min(within["accel"] + within["gyro"]):.2f} to {max(within["accel"] + within["gyro"]):.2f} '
            'times those',
            CONFIRMED if inside else PARTLY,
        ),
        (
            'they are the variances to give the filter',
            "the gyroscope's only in (rad/s)2: as published by the thesis's listing (`thesis_covariances:=true`) the "
            'filter almost ignores the measured turn rate',
            PARTLY,
        ),
    )


def _figures_of_variances(result):
    """What of a result is compared with a run over ROS."""
    return {
        Figure(f'{kind} {axis}, {unit}', 5): result['variances'][kind][k]
        for kind, unit in (('accel', '(m/s2)2'), ('gyro', '(deg/s)2'), ('angles', 'deg2'))
        for k, axis in enumerate('xyz')
    }


EXPERIMENT = Experiment(
    'E5',
    'variances of the calibrated sensor',
    'Variances over the minute at rest of E4, the sensor node calibrated (thesis 4.2.3.2).',
    10,
    cases,
    covariances,
    every_case,
    _figures_of_variances,
)
