"""E1, E2 and E3: accelerometer, gyroscope and yaw of the resting chair, before and after calibration (thesis 4.2.1 to
4.2.3.1).
"""

import numpy as np

from sara_lab.experiments import sensor_experiments as experiments
from sara_lab.experiments import sensor_figures
from sara_lab.experiments import sensor_report as thesis
from sara_lab.experiments.agreement import Figure, every_case
from sara_lab.experiments.core import CONFIRMED, CONTRADICTED, PARTLY, Case, Experiment, Report, Row, interval, spread
from sara_sim.config import ChairConfig

AXES = 'xyz'
GRAVITY = (0.0, 0.0, thesis.GRAVITY)
QUIET = 0.1  # share of the chip's noise, where one thing is changed


def rest_case(seed):
    """Mean, sigma, skewness and excess kurtosis of a minute before and after; the samples of chair 0 too."""
    rest = experiments.before_and_after(seed)
    return {**moments(rest), **({'rest': rest} if seed == 0 else {})}


def moments(rest):
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


def yaw_case(seed):
    """The minutes of E3; of chair 0 the curves too. `quiet`: the last firmware's minute with a tenth of the chip's
    noise, the one thing changed.
    """
    minutes = {
        'node': experiments.yaw_in_the_sensor_node(seed),
        'tenths': experiments.yaw_in_the_sensor_node(seed, experiments.tenths()),
        'fixed': experiments.yaw_with_a_fixed_offset(seed),
        'pc': experiments.yaw_calibrated_on_the_pc(seed),
    }
    sigma = tuple(QUIET * value for value in ChairConfig().gyro_frame_sigma)
    quiet = experiments.yaw_in_the_sensor_node(seed, experiments.tenths(), ChairConfig(gyro_frame_sigma=sigma))
    result = {
        key: {'rate': minutes[key].rate, 'end': float(minutes[key].yaw[-1])} for key in ('node', 'tenths', 'fixed')
    }
    result['quiet'] = {'rate': quiet.rate, 'end': float(quiet.yaw[-1])}
    result['pc'] = [
        {'offset': trial.offset, 'rate': trial.rate, 'left': trial.left, 'end': float(trial.yaw[-1])}
        for trial in minutes['pc']
    ]
    return {**result, **({'minutes': minutes} if seed == 0 else {})}


def _of(results, kind):
    return [result for key, result in sorted(results.items()) if key[0] == kind]


def _rest_report(results, which, tables, unit, ideal):
    found = _of(results, 'rest')
    rows, data, faults = [], {}, []
    for when in ('before', 'after'):
        moments = [result[f'{which}_{when}'] for result in found]
        for k, axis in enumerate(AXES):
            mean, sigma = (spread([moment[name][k] for moment in moments]) for name in ('mean', 'sigma'))
            data[f'{axis}_{when}'] = {'mean': mean, 'sigma': sigma}
            why = {
                (
                    'before',
                    'accel',
                ): "the offset of the thesis's chip; each chair's mounting is tilted a little",
                ('before', 'gyro'): 'each chair has its own drifting bias',
                ('after', 'accel'): f"the register's step is 0.0096 {unit}; noise drawn between tables 4.1 and 4.2",
                ('after', 'gyro'): f"the register's step is 0.0305 {unit}: up to half of it stays",
            }[when, which]
            thesis = f'{tables[when][0][k]:g}, {tables[when][1][k]:g} {unit}'
            ours = f'{interval(mean, 4)}, {interval(sigma, 4, unit)}'
            rows.append(Row(f'{axis} {when}: mean, sigma', thesis, ours, why))
    off = {
        when: np.array([np.abs(np.array(result[f'{which}_{when}']['mean']) - ideal) for result in found])
        for when in ('before', 'after')
    }
    kurtosis = np.abs([result[f'{which}_after'][name] for result in found for name in ('kurtosis', 'skew')])
    return found, rows, data, faults, off, kurtosis


def _rest_findings(which, unit, off, kurtosis, limit, extra=()):
    worst = off['after'].max()
    normal = float(np.percentile(kurtosis, 95))
    return (
        (
            'the calibration in the sensor node takes the systematic error away',
            f'the mean is {off["before"].max():.3f} {unit} off at most before, {worst:.4f} after',
            CONFIRMED if worst <= limit else PARTLY,
        ),
        (
            'the rest is normally distributed',
            f"skewness and excess kurtosis are within {normal:.2f} of a normal distribution's (95 % of the histograms)",
            CONFIRMED if normal < 0.8 else PARTLY,
        ),
        *extra,
    )


def accelerometer(results):
    """E1."""
    found, rows, data, faults, off, kurtosis = _rest_report(results, 'accel', thesis.ACCELERATION, 'm/s2', GRAVITY)
    ratio = np.array([np.array(result['accel_after']['sigma']) / result['accel_before']['sigma'] for result in found])
    extra = (
        (
            'sigma rises with the calibration (table 4.1 to 4.2: x 0.0576 to 0.1097)',
            f'it does not: after / before is {ratio.mean():.2f} on average. An offset register adds a constant, which '
            "changes no spread; the thesis's two recordings must have differed in something else",
            CONTRADICTED,
        ),
    )
    if off['after'].max() > thesis.ACCEL_AFTER:
        faults.append(
            f"an accelerometer's mean is {off['after'].max():.4f} m/s2 off after its calibration (at most "
            f'{thesis.ACCEL_AFTER})'
        )
    section = (
        'One thing changed',
        'Only the offset registers differ between the two minutes, and sigma stays '
        f'(after / before: {ratio.min():.2f} to {ratio.max():.2f} over all chairs and axes). So the calibration did '
        'not raise it.',
    )
    return Report(
        _rest_findings('accel', 'm/s2', off, kurtosis, thesis.ACCEL_AFTER, extra),
        tuple(rows),
        tuple(sensor_figures.at_rest(found[0]['rest'], 'accel', 0)),
        (section,),
        {'axes': data, 'sigma_after_over_before': spread(ratio.ravel())},
        tuple(faults),
        f'The mean is {off["after"].max():.3f} m/s2 off at most after calibration; sigma does not rise with it.',
    )


def gyroscope(results):
    """E2."""
    found, rows, data, faults, off, kurtosis = _rest_report(results, 'gyro', thesis.RATE, 'deg/s', (0.0, 0.0, 0.0))
    if off['after'].max() > thesis.RATE_AFTER_NODE:
        faults.append(
            f"a gyroscope's mean is {off['after'].max():.4f} deg/s after its calibration in the node (at most "
            f'{thesis.RATE_AFTER_NODE:.4f})'
        )
    return Report(
        _rest_findings('gyro', 'deg/s', off, kurtosis, thesis.RATE_AFTER_NODE),
        tuple(rows),
        tuple(sensor_figures.at_rest(found[0]['rest'], 'gyro', 0)),
        data={'axes': data},
        faults=tuple(faults),
        short=f'The mean is {off["after"].max():.3f} deg/s off at most after calibration in the node.',
    )


def yaw(results):
    """E3."""
    found = _of(results, 'yaw')
    node, pc = (
        np.array([abs(result['node']['rate']) for result in found]),
        np.array([[abs(trial['left']) for trial in result['pc']] for result in found]),
    )
    ends = {
        key: np.array([abs(result[key]['end']) for result in found]) for key in ('node', 'fixed', 'tenths', 'quiet')
    }
    ends['pc'] = np.array([abs(trial['end']) for result in found for trial in result['pc']])
    less = 1.0 - pc.mean() / node.mean()
    first = found[0]['pc']
    data = {
        'node_deg_s': spread(node),
        'pc_left_deg_s': spread(pc.ravel()),
        **{f'end_{key}_deg': spread(values) for key, values in ends.items()},
    }
    rows = [
        Row(
            'mean |error|, calibrated in the sensor node (table 4.8)',
            f'{thesis.ERROR_NODE} deg/s',
            interval(spread(node), 4, 'deg/s'),
            "the register's step of 0.0305 deg/s",
        ),
        Row(
            'mean |error|, calibrated on the PC',
            f'{thesis.ERROR_PC} deg/s',
            interval(spread(pc.ravel()), 4, 'deg/s'),
            'noise and drift of the bias during the calibration',
        ),
        Row('less by', '75 %', f'{100 * less:.0f} %', ''),
        Row(
            'offsets found, errors (table 4.7; ours: chair 0)',
            '-0.6442, -0.6449, -0.6512, -0.6488; -0.0063, -0.0051, 0.0082, 0.0030 deg/s',
            ', '.join(f'{trial["offset"]:.4f}' for trial in first)
            + '; '
            + ', '.join(f'{trial["rate"]:+.4f}' for trial in first)
            + ' deg/s',
            '',
        ),
    ]
    rows += [
        Row(
            f'yaw after a minute, {what}',
            theirs,
            interval(spread(ends[key]), 2, 'deg') + f', at most {ends[key].max():.2f}',
            why,
        )
        for key, what, theirs, why in (
            (
                'node',
                'calibrated in the sensor node',
                'over 1 deg',
                'grows with the error, which differs between chairs',
            ),
            ('pc', 'calibrated on the PC', 'well under 1 deg', ''),
            (
                'fixed',
                'fixed offset of -0.645 deg/s',
                '(figure 4.11)',
                'it fits one chip on one day',
            ),
            ('tenths', 'last firmware, in tenths', 'no drift', 'noise carries the mean through the rounding'),
        )
    ]
    faults = (
        [f'calibration on the PC leaves {pc.mean():.4f} deg/s on average (at most {thesis.RATE_AFTER_PC})']
        if pc.mean() > thesis.RATE_AFTER_PC
        else []
    )
    findings = (
        (
            'calibrating on the PC leaves 75 % less than in the sensor node',
            f'{100 * less:.0f} % less: {pc.mean():.4f} instead of {node.mean():.4f} deg/s',
            CONFIRMED if less > 0.6 else PARTLY,
        ),
        (
            'calibrated in the sensor node, yaw is over 1 deg off after a minute; on the PC well under it',
            f"{np.mean(ends['node'] > 1.0):.0%} of the chairs are over 1 deg with the node's calibration (mean "
            f"{ends['node'].mean():.2f} deg), {np.mean(ends['pc'] > 1.0):.0%} with the PC's ({ends['pc'].mean():.2f} "
            'deg)',
            CONFIRMED if ends['pc'].mean() < 0.5 * ends['node'].mean() else PARTLY,
        ),
        (
            'sent in tenths of a degree per second, yaw does not drift any more',
            f'it does: {ends["tenths"].mean():.2f} deg in a minute. The rounding hides a small mean only where there '
            'is no noise: with '
            f'a tenth of the noise {ends["quiet"].mean():.2f} deg are left',
            CONTRADICTED if ends['tenths'].mean() > 0.3 else CONFIRMED,
        ),
    )
    section = (
        "One thing changed: the chip's noise",
        'A rate below half a tenth is sent as 0, which hides a small offset if nothing else moves the rate. But the '
        '200 ms means of this gyroscope have a sigma of 0.073 deg/s '
        f'(table 4.5): they dither, and the mean survives the rounding. With {QUIET:g} of the noise the last firmware '
        'drifts '
        f'{ends["quiet"].mean():.3f} deg in a minute instead of {ends["tenths"].mean():.3f} deg, as in the thesis. '
        'Turns below 0.05 deg/s are then lost as well, so this is no cure.',
    )
    return Report(
        findings,
        tuple(rows),
        tuple(sensor_figures.yaw_at_rest(found[0]['minutes'], 0)),
        (section,),
        data,
        tuple(faults),
        f'Calibrating on the PC leaves {100 * less:.0f} % less; sent in tenths yaw drifts all the same, for the '
        "gyroscope's noise is not small beside a tenth.",
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


def _figures_of_yaw(result):
    """The same of E3; the truth, which the error of the PC's offset is taken against, is the simulator's alone."""
    return {
        Figure('mean rate, calibrated in the node, deg/s', 4): result['node']['rate'],
        Figure('yaw after a minute, deg', 2): result['node']['end'],
        Figure('mean rate, on the PC, deg/s', 4): float(np.mean([trial['rate'] for trial in result['pc']])),
        Figure('yaw after a minute, on the PC, deg', 2): float(np.mean([trial['end'] for trial in result['pc']])),
    }


def _rest_cases(seeds):
    return [Case(('rest', seed), rest_case, seed) for seed in range(seeds)]


REST = (
    'The chair stands for a minute; frames are read on the PC before and after its sensor node calibrates the chip '
    '(offset registers of the MPU6050).'
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
    Experiment(
        'E3',
        'yaw at rest',
        'A minute at rest; yaw is the integral of the rate: calibrated in the sensor node, on the PC (four times), '
        "with the thesis's fixed offset, "
        "and with the last firmware, which sends tenths of deg/s (thesis 4.2.3.1). The PC's calibration is compared "
        "with the chip's true bias.",
        10,
        lambda seeds: [Case(('yaw', seed), yaw_case, seed) for seed in range(seeds)],
        yaw,
        every_case,
        _figures_of_yaw,
    ),
)
