"""E1 and E2: accelerometer and gyroscope of the resting chair, before and after calibration (thesis 4.2.1, 4.2.2); and
the cases of E3 (yaw_at_rest.py).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sara_lab.experiments import sensor_experiments as experiments
from sara_lab.experiments import sensor_figures
from sara_lab.experiments import sensor_report as thesis
from sara_lab.experiments.agreement import Figure, every_case
from sara_lab.experiments.core import (
    CONFIRMED,
    CONTRADICTED,
    PARTLY,
    Case,
    Experiment,
    Finding,
    Report,
    Results,
    Row,
    mean,
    results_of,
    spread,
)
from sara_sim.config import ChairConfig

AXES = 'xyz'
GRAVITY = (0.0, 0.0, thesis.GRAVITY)
WHY = {
    ('before', 'accel'): "each chair's mounting is tilted a little",
    ('before', 'gyro'): 'each chair has its own drifting bias',
    ('after', 'accel'): "the register's step is 0.0096 m/s2; noise between tables 4.1 and 4.2",
    ('after', 'gyro'): "the register's step is 0.0305 deg/s: up to half of it stays",
}
QUIET = 0.1  # share of the chip's noise, where one thing is changed


def rest_case(seed: int) -> dict:
    """Mean, sigma, skewness and excess kurtosis of a minute before and after; the samples of chair 0 too."""
    rest = experiments.before_and_after(seed)
    return {**moments(rest), **({'rest': rest} if seed == 0 else {})}


def moments(rest: dict[str, experiments.AtRest]) -> dict:
    """Those of {"before": AtRest, "after": AtRest}, and how many frames there were."""
    result = {
        f'{which}_{when}': _moments(getattr(rest[when], which))
        for which in ('accel', 'gyro')
        for when in ('before', 'after')
    }
    return {**result, 'count': len(rest['after'].gyro)}


def _moments(samples):
    sigma = samples.std(axis=0, ddof=1)
    normed = (samples - samples.mean(axis=0)) / sigma
    return {
        'mean': samples.mean(axis=0).tolist(),
        'sigma': sigma.tolist(),
        'skew': (normed**3).mean(axis=0).tolist(),
        'kurtosis': ((normed**4).mean(axis=0) - 3.0).tolist(),
    }


def yaw_case(seed: int) -> dict:
    """The minutes of E3; of chair 0 the curves too. `quiet`: the last firmware's minute with a tenth of the chip's
    noise, the one thing changed.
    """
    minutes = {
        'node': experiments.yaw_in_the_sensor_node(seed),
        'tenths': experiments.yaw_in_the_sensor_node(seed, experiments.tenths()),
        'fixed': experiments.yaw_with_a_fixed_offset(seed),
        'pc': experiments.yaw_calibrated_on_the_pc(seed),
    }
    sigma = tuple(QUIET * value for value in ChairConfig.of().gyro_frame_sigma)
    quiet = experiments.yaw_in_the_sensor_node(seed, experiments.tenths(), ChairConfig.of(gyro_frame_sigma=sigma))
    result = {
        key: {'rate': minutes[key].rate, 'end': float(minutes[key].yaw[-1])} for key in ('node', 'tenths', 'fixed')
    }
    result['quiet'] = {'rate': quiet.rate, 'end': float(quiet.yaw[-1])}
    result['pc'] = [
        {'offset': trial.offset, 'rate': trial.rate, 'left': trial.left, 'end': float(trial.yaw[-1])}
        for trial in minutes['pc']
    ]
    return {**result, **({'minutes': minutes} if seed == 0 else {})}


@dataclass(frozen=True)
class Rest:
    """One chip of all chairs: the `results` of the cases, `which` chip (accel or gyro), the thesis's `tables` of mean
    and sigma before and after, their `unit`, the mean that would be `ideal`, and the `limit` of what may be left.
    """

    results: list[dict]
    which: str
    tables: dict
    unit: str
    ideal: tuple[float, float, float]
    limit: float

    @cached_property
    def axes(self) -> dict[str, dict]:
        """{'x_before': {'mean': spread, 'sigma': spread}, ...}."""
        return {
            f'{axis}_{when}': {
                name: spread([result[f'{self.which}_{when}'][name][k] for result in self.results])
                for name in ('mean', 'sigma')
            }
            for when in ('before', 'after')
            for k, axis in enumerate(AXES)
        }

    @cached_property
    def off(self) -> dict[str, np.ndarray]:
        """{'before', 'after': (chairs, 3) how far the mean is off}."""
        return {
            when: np.array(
                [np.abs(np.array(result[f'{self.which}_{when}']['mean']) - self.ideal) for result in self.results]
            )
            for when in ('before', 'after')
        }

    def rows(self) -> tuple[Row, ...]:
        """The table."""
        return tuple(
            Row(
                f'{axis} {when}: mean, sigma',
                f'{self.tables[when][0][k]:g}, {self.tables[when][1][k]:g} {self.unit}',
                f'{mean(self.axes[f"{axis}_{when}"]["mean"], 4)}, '
                f'{mean(self.axes[f"{axis}_{when}"]["sigma"], 4, self.unit)}',
                WHY[when, self.which],
            )
            for when in ('before', 'after')
            for k, axis in enumerate(AXES)
        )

    def findings(self) -> tuple[Finding, ...]:
        """Those that accelerometer and gyroscope have in common."""
        worst = self.off['after'].max()
        kurtosis = np.abs(
            [result[f'{self.which}_after'][name] for result in self.results for name in ('kurtosis', 'skew')]
        )
        normal = float(np.percentile(kurtosis, 95))
        return (
            (
                'calibrating in the sensor node removes the systematic error',
                f'the mean is {self.off["before"].max():.3f} {self.unit} off at most before, {worst:.4f} after',
                CONFIRMED if worst <= self.limit else PARTLY,
            ),
            (
                'the rest is normally distributed',
                f"skewness and excess kurtosis are within {normal:.2f} of a normal distribution's (95 %)",
                CONFIRMED if normal < 0.8 else PARTLY,
            ),
        )


def accelerometer(results: Results) -> Report:
    """E1."""
    rest = Rest(results_of(results, 'rest'), 'accel', thesis.ACCELERATION, 'm/s2', GRAVITY, thesis.ACCEL_AFTER)
    found, off = rest.results, rest.off
    faults = []
    ratio = np.array([np.array(result['accel_after']['sigma']) / result['accel_before']['sigma'] for result in found])
    extra = (
        'sigma rises with the calibration (table 4.1 to 4.2: x 0.0576 to 0.1097)',
        f'no: after / before is {ratio.mean():.2f} ({ratio.min():.2f} to {ratio.max():.2f}). An offset register adds a '
        "constant; the thesis's two recordings must have differed in something else",
        CONTRADICTED,
    )
    if off['after'].max() > thesis.ACCEL_AFTER:
        faults.append(
            f"an accelerometer's mean is {off['after'].max():.4f} m/s2 off after its calibration (at most "
            f'{thesis.ACCEL_AFTER})'
        )
    return Report(
        (*rest.findings(), extra),
        rest.rows(),
        tuple(sensor_figures.at_rest(found[0]['rest'], 'accel')),
        data={'axes': rest.axes, 'sigma_after_over_before': spread(ratio.ravel())},
        faults=tuple(faults),
        short=f'The mean is {off["after"].max():.3f} m/s2 off at most after calibration; sigma does not rise with it.',
    )


def gyroscope(results: Results) -> Report:
    """E2."""
    rest = Rest(results_of(results, 'rest'), 'gyro', thesis.RATE, 'deg/s', (0.0, 0.0, 0.0), thesis.RATE_AFTER_NODE)
    off, faults = rest.off, []
    if off['after'].max() > thesis.RATE_AFTER_NODE:
        faults.append(
            f"a gyroscope's mean is {off['after'].max():.4f} deg/s after its calibration in the node (at most "
            f'{thesis.RATE_AFTER_NODE:.4f})'
        )
    return Report(
        rest.findings(),
        rest.rows(),
        tuple(sensor_figures.at_rest(rest.results[0]['rest'], 'gyro')),
        data={'axes': rest.axes},
        faults=tuple(faults),
        short=f'The mean is {off["after"].max():.3f} deg/s off at most after calibration in the node.',
    )


def _figures_at_rest(which, unit):
    """What of a result is compared with a run over ROS."""

    def figures(result):
        return {
            Figure(f'{axis}, {name} {when}, {unit}', 4): result[f'{which}_{when}'][name][k]
            for when in ('before', 'after')
            for name in ('mean', 'sigma')
            for k, axis in enumerate(AXES)
        }

    return figures


def _rest_cases(seeds):
    return [Case(('rest', seed), rest_case, seed) for seed in range(seeds)]


REST = (
    'A minute of frames at rest, before and after the sensor node calibrates the chip (offset registers of the '
    'MPU6050).'
)
EXPERIMENTS = (
    Experiment(
        'E1',
        'the accelerometer at rest',
        f'{REST} Thesis 4.2.1.',
        10,
        _rest_cases,
        accelerometer,
        every_case,
        _figures_at_rest('accel', 'm/s2'),
    ),
    Experiment(
        'E2',
        'the gyroscope at rest',
        f'{REST} Thesis 4.2.2. (Its table 4.6 contradicts 4.4 and is left out.)',
        10,
        _rest_cases,
        gyroscope,
        every_case,
        _figures_at_rest('gyro', 'deg/s'),
    ),
)
