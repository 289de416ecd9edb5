"""E4: what is reported of the sensor node's two filters side by side (thesis 4.2.3.1)."""

from dataclasses import dataclass

import numpy as np

from sara_lab.experiments import core, plotting, sensor_figures
from sara_lab.experiments.agreement import Figure, every_case
from sara_lab.experiments.core import (
    CONFIRMED,
    PARTLY,
    Experiment,
    Report,
    Results,
    Row,
    interval,
    mean,
    results_of,
    spread,
)
from sara_lab.experiments.filter_costs import costs
from sara_lab.experiments.orientation import FRAMES, cases


@dataclass(frozen=True)
class Filters:
    """The `results` of the cases, and the `cost` of an update by filter (filter_costs)."""

    results: list[dict]
    cost: dict[str, tuple[int, int]]

    @property
    def drift(self) -> dict[str, np.ndarray]:
        """{filter: (chairs,) yaw after a minute, deg}."""
        return {key: np.array([result[key]['drift'] for result in self.results]) for key in FRAMES}

    @property
    def share(self) -> dict[str, np.ndarray]:
        """{filter: (chairs, 2) measured over true angle of a full turn each way}."""
        return {key: np.array([result[key]['share'] for result in self.results]) for key in FRAMES}

    @property
    def apart(self) -> np.ndarray:
        """(chairs,) how far the two are apart after a minute, deg."""
        return np.abs(self.drift['complementary'] - self.drift['madgwick'])


def filters(results: Results) -> Report:
    """E4's Report."""
    of = Filters(results_of(results, 'orientation'), costs())
    data = {
        'cost': {key: {'operations': value[0], 'calls': value[1]} for key, value in of.cost.items()},
        'apart_deg': spread(of.apart),
        **{f'{key}_drift_deg': spread(np.abs(of.drift[key])) for key in FRAMES},
        **{f'{key}_share': spread(of.share[key].ravel()) for key in FRAMES},
    }
    return Report(
        _findings_of_filters(of),
        tuple(_rows_of_filters(of)),
        _drawn(of.results[0]['trace']),
        data=data,
        short="Both drift alike and need k; Madgwick's costs more.",
    )


def _rows_of_filters(of):
    def both(text):
        return '; '.join(f'{name} {text(key)}' for key, name in (('complementary', 'C'), ('madgwick', 'M')))

    return [
        Row(
            '|yaw| after a minute at rest',
            'drifts, in proportion to time',
            both(lambda key: interval(spread(np.abs(of.drift[key])), 2, 'deg')),
            "the offset that the sensor node's calibration leaves (E3)",
        ),
        Row(
            'share of a full turn',
            'C 0.924 (332.5 of 360); M alike',
            both(lambda key: interval(spread(of.share[key].ravel()), 4)),
            "the gyroscope's scale, which neither can know",
        ),
        Row(
            'sigma of roll, pitch at rest',
            'C 0.1 deg (table 4.10); M 0.02 deg (figure 4.13)',
            both(
                lambda key: (
                    ' and '.join(mean(spread([result[key]['sigma'][k] for result in of.results]), 3) for k in (0, 1))
                    + ' deg'
                )
            ),
            "a tenth (C) or beta (M) of each sample's gravity angle, with its noise, goes through",
        ),
        Row(
            'one update: operations; calls of atan2, hypot, sqrt',
            'M more',
            both(lambda key: f'{of.cost[key][0]} and {of.cost[key][1]}'),
            "counted on the node's own code",
        ),
    ]


def _findings_of_filters(of):
    return (
        (
            'the yaw of both drifts alike',
            f'after a minute they are {of.apart.mean():.3f} deg apart',
            CONFIRMED if of.apart.max() < 0.5 * np.abs(of.drift['complementary']).mean() else PARTLY,
        ),
        (
            "Madgwick's needs the factor k as well",
            f'it turns {of.share["madgwick"].mean():.3f} of the true angle, the complementary filter '
            f'{of.share["complementary"].mean():.3f}',
            CONFIRMED if abs(of.share['madgwick'].mean() - of.share['complementary'].mean()) < 0.01 else PARTLY,
        ),
        (
            "Madgwick's costs more and gains nothing",
            f'{of.cost["madgwick"][0]} operations instead of {of.cost["complementary"][0]}, and no less drift; '
            'its roll and pitch are steadier, which navigation in the plane does not use',
            CONFIRMED if of.cost['madgwick'][0] > of.cost['complementary'][0] else PARTLY,
        ),
    )


def _drawn(trace):
    return (
        core.Figure(
            sensor_figures.name(12),
            'Angles at rest by both filters.',
            lambda path: _angles(path, trace['rest'], 'both'),
        ),
        core.Figure(
            sensor_figures.name(13),
            "Angles at rest by Madgwick's filter, last firmware (rates in tenths), calibrated; roll and pitch less "
            'their means.',
            lambda path: _angles(path, trace['last'], 'madgwick'),
        ),
        core.Figure(
            sensor_figures.name(15),
            'Histograms of that roll and pitch.',
            lambda path: sensor_figures.histograms(
                path,
                trace['last']['madgwick'][:, 1:3] - trace['last']['madgwick'][:, 1:3].mean(axis=0),
                ('roll', 'pitch'),
                'deg',
            ),
        ),
        core.Figure(
            sensor_figures.name(18),
            "Rate and angle of a full turn each way by Madgwick's filter, as measured and times k.",
            lambda path: sensor_figures.turn_both_ways(
                path, [_turn(turn) for turn in trace['turns']], 'Madgwick', 'times k ='
            ),
        ),
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


EXPERIMENT = Experiment(
    'E4',
    "complementary filter against Madgwick's",
    "The complementary filter (C, A = 0.9) and Madgwick's (M) run in the sensor node on the same samples: a minute at "
    'rest, and a full turn each way (thesis 4.2.3.1 b).',
    10,
    cases,
    filters,
    every_case,
    _figures_of_filters,
)
