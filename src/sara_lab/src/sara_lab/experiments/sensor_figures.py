"""The thesis's figures of the IMU, 4.1 to 4.18, from what sensor_experiments.py and orientation.py record."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sara_lab.experiments import plotting
from sara_lab.experiments.core import Figure

if TYPE_CHECKING:
    from sara_lab.experiments.sensor_experiments import AtRest

AXES = 'xyz'
MINUTE_S = 60.0
QUANTITIES = {
    'accel': ('acceleration', 'm/s$^2$', 1),
    'gyro': ('angular velocity', 'deg/s', 5),
}  # label, unit, number of the first of four figures


def at_rest(rest: dict[str, AtRest], which: str) -> list[Figure]:
    """Figures 4.1 to 4.4 (which: accel) or 4.5 to 4.8 (gyro) of {'before': AtRest, 'after': AtRest}."""
    label, _, first = QUANTITIES[which]
    found = []
    for offset, when in ((0, 'before'), (2, 'after')):
        samples = getattr(rest[when], which)
        found.append(
            Figure(
                name(first + offset),
                f'{label.capitalize()} {when} calibration: a minute of frames and their mean.',
                lambda path, s=samples: _over_a_minute(path, s, which),
            )
        )
        found.append(
            Figure(
                name(first + offset + 1),
                'Its deviations beside a normal distribution.',
                lambda path, s=samples: histograms(path, s - s.mean(axis=0), AXES, QUANTITIES[which][1]),
            )
        )
    return found


def name(number: int) -> str:
    """fig_4_07 of 7."""
    return f'fig_4_{number:02d}'


def _over_a_minute(path, samples, which):
    label, unit, _ = QUANTITIES[which]
    with plotting.figure(path, 3, size=(9, 7), sharex=True) as (_, axes):
        for k, axis in enumerate(axes):
            plotting.series(
                axis,
                np.arange(len(samples)) * MINUTE_S / len(samples),
                samples[:, k],
                plotting.FUSED,
                label if k == 0 else None,
                linewidth=0.8,
            )
            axis.axhline(samples[:, k].mean(), color=plotting.WHEELS, label=f'mean {samples[:, k].mean():.4f} {unit}')
            axis.set(ylabel=f'{AXES[k]} ({unit})')
            low, high = axis.get_ylim()
            axis.set_ylim(low, high + 0.25 * (high - low))
            axis.legend(loc='upper right', ncols=2)
        axes[-1].set_xlabel('time (s)')


def histograms(path: Path, errors: np.ndarray, names: Sequence[str], unit: str) -> None:
    """One histogram a column of `errors` (n, k), with the normal curve of its sigma."""
    with plotting.figure(path, 1, errors.shape[1], size=(4 * errors.shape[1], 4)) as (_, axes):
        for k, axis in enumerate(axes):
            sigma = errors[:, k].std(ddof=1)
            axis.hist(errors[:, k], bins=20, density=True, color=plotting.FUSED, alpha=0.7, label='frames')
            x = np.linspace(-4 * sigma, 4 * sigma, 200)
            axis.plot(
                x,
                np.exp(-0.5 * (x / sigma) ** 2) / (sigma * math.sqrt(math.tau)),
                color=plotting.WHEELS,
                label=f'normal, sigma {sigma:.4f}',
            )
            axis.set(xlabel=f'{names[k]}: deviation from the mean ({unit})', ylabel='density' if k == 0 else '')
            axis.set_ylim(top=1.35 * axis.get_ylim()[1])
            axis.legend(loc='upper right')


def yaw_at_rest(minutes: dict[str, Any]) -> list[Figure]:
    """Figures 4.9 to 4.11 and 4.14 of {'node', 'pc': list, 'fixed', 'tenths'} of YawAtRest."""
    captions = (
        (9, 'node', 'calibrated in the sensor node alone'),
        (10, 'pc', 'calibrated on the PC, four times'),
        (11, 'fixed', 'with a fixed offset of -0.645 deg/s'),
        (14, 'tenths', 'sent in tenths of deg/s (last firmware)'),
    )
    return [
        Figure(
            name(number),
            f'Yaw, {caption}.',
            lambda path, trials=(minutes[key] if isinstance(minutes[key], list) else [minutes[key]]): _yaw(
                path, trials
            ),
        )
        for number, key, caption in captions
    ]


def _yaw(path, trials):
    with plotting.figure(path, size=(8, 4)) as (_, axis):
        for number, trial in enumerate(trials, 1):
            axis.plot(
                trial.t,
                trial.yaw,
                linewidth=1.2,
                label=f'{f"{number}: " if len(trials) > 1 else ""}error {trial.yaw[-1] / MINUTE_S:+.4f} deg/s',
            )
        axis.axhline(0.0, color=plotting.TRUE, linewidth=0.8, label='true')
        axis.set(xlabel='time (s)', ylabel='yaw (deg)')
        axis.legend()


def turn_both_ways(path: Path, turns: Sequence[tuple], measured: str, corrected: str) -> None:
    """Figures 4.17 and 4.18: rate and angle of a full turn each way. `turns`: ((t, rate deg/s, angle deg, true deg),
    ...); labels of both lines.
    """
    with plotting.figure(path, 2, len(turns), size=(6 * len(turns), 7), sharex='col') as (_, axes):
        for column, (t, rate, angle, true, gain) in enumerate(turns):
            for row, values, label in ((0, rate, 'angular velocity z (deg/s)'), (1, angle, 'turned angle z (deg)')):
                axis = axes[row][column]
                axis.plot(t, values, color=plotting.FUSED, label=measured)
                axis.plot(t, gain * values, color=plotting.WHEELS, label=f'{corrected} {gain:.4f}')
                if row:
                    axis.plot(t, true, color=plotting.TRUE, linewidth=0.9, linestyle='--', label='true')
                    axis.set_yticks(np.arange(0, 361, 90) * (1 if true[-1] > 0 else -1))
                axis.set(ylabel=label if column == 0 else '')
                axis.legend()
            axes[0][column].set_title('to the left' if true[-1] > 0 else 'to the right')
            axes[1][column].set_xlabel('time (s)')
