"""The thesis's figures of a drive: path, turn rates, angles and position over time, from the `trace` of
drives.course_driven.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sara_lab.experiments import plotting
from sara_lab.experiments.plotting import FUSED, IMU, TRUE, WHEELS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ARROW = 30.0  # points
Walls = tuple[np.ndarray, float, tuple[float, float]]
"""What is occupied (rows, columns), the resolution (m), the origin (x, y; m) of a map."""


def path(
    file: Path,
    traces: dict[str, dict[str, np.ndarray]],
    goals: Sequence[tuple[float, float, float]],
    start: Sequence[float],
    walls: Walls | None = None,
    size: tuple[float, float] = (7, 6.5),
    window: tuple[float, float, float, float] | None = None,
    blue: str = 'fused',
) -> None:
    """The paths of {title: trace}, a panel each, with the goals (x, y, deg) as arrows. `walls`: (occupied, resolution,
    origin) of the map; `window`: (x0, x1, y0, y1) of it that is shown, m. `blue`: what the localization is called.
    """
    with plotting.figure(
        file, 1, len(traces), size=(size[0] * len(traces) * (0.75 if len(traces) > 1 else 1.0), size[1]), squeeze=False
    ) as (made, grid):
        for axis, (title, trace) in zip(grid[0], traces.items()):
            if walls:
                _walls(axis, *walls)
            for name, colour, label, width, style in (
                ('true', TRUE, 'true', 2.2, '-'),
                ('fused', FUSED, blue, 1.3, '-'),
                ('wheels', WHEELS, 'wheel odometry alone', 1.1, '--'),
            ):
                plotting.series(
                    axis, trace[name][:, 0], trace[name][:, 1], colour, label, linewidth=width, linestyle=style
                )
            axis.plot(*start[:2], 'o', color=IMU, label='start')
            axis.plot(*np.array(goals).reshape(-1, 3)[:, :2].T, alpha=0.0)  # goals belong into the picture
            axis.plot([], [], color=IMU, linewidth=2.5, label='goals')
            axis.set(xlabel='x (m)', ylabel='y (m)', title=title)
            axis.margins(0.12)
            axis.set_aspect('equal', adjustable='box' if window else 'datalim')
            if window:
                axis.set(xlim=window[:2], ylim=window[2:])
            _goals(axis, goals)
        handles, labels = grid[0][0].get_legend_handles_labels()
        made.legend(
            handles,
            labels,
            loc='upper center',
            bbox_to_anchor=(0.5, 0.0),
            ncols=5 if len(traces) > 1 or size[0] > 8 else 3,
        )


def _goals(axis, goals):
    """Arrows of one length, however much the picture shows, and their numbers, legible on any line."""
    for number, (x, y, yaw) in enumerate(goals, 1):
        axis.annotate(
            '',
            (x, y),
            (ARROW * math.cos(math.radians(yaw)), ARROW * math.sin(math.radians(yaw))),
            textcoords='offset points',
            arrowprops={'color': IMU, 'arrowstyle': '<|-', 'linewidth': 2.5, 'shrinkA': 0, 'shrinkB': 0},
        )
        axis.annotate(
            str(number),
            (x, y),
            xytext=(7, -13),
            textcoords='offset points',
            color=IMU,
            bbox={'boxstyle': 'round,pad=0.1', 'facecolor': 'white', 'edgecolor': 'none', 'alpha': 0.8},
        )


def _walls(axis, occupied, resolution, origin):
    extent = (
        origin[0],
        origin[0] + occupied.shape[1] * resolution,
        origin[1],
        origin[1] + occupied.shape[0] * resolution,
    )
    axis.imshow(occupied, origin='lower', extent=extent, cmap='Greys', vmin=0, vmax=2)


def definition(file: Path, goals: Sequence[tuple[float, float, float]], start: tuple[float, float, float]) -> None:
    """Figure 4.21: the course as it is asked for."""
    with plotting.figure(file, size=(6, 5.5)) as (_, axis):
        points = np.array([start[:2], *(goal[:2] for goal in goals)])
        axis.plot(*points.T, '--o', color=FUSED, label='course')
        for number, (x, y, yaw) in enumerate([start, *goals]):
            axis.annotate(
                '',
                (x + 0.6 * math.cos(math.radians(yaw)), y + 0.6 * math.sin(math.radians(yaw))),
                (x, y),
                arrowprops={'color': IMU, 'width': 1.5, 'headwidth': 7},
            )
            axis.annotate(
                'start' if number == 0 else f'{number}: {yaw:g} deg',
                (x, y),
                xytext=(8, 12 if number else -16),
                textcoords='offset points',
            )
        axis.plot([], [], color=IMU, linewidth=2.5, label='heading asked for')
        axis.set(xlabel='x (m)', ylabel='y (m)')
        axis.margins(0.25)
        axis.set_aspect('equal', adjustable='datalim')
        axis.legend(loc='center')


def _ends(axis, trace):
    for end in trace['ends']:
        axis.axvline(end, color='dimgrey', linewidth=1.0, linestyle=':')


def rates(file: Path, trace: dict[str, np.ndarray]) -> None:
    """Turn rate of IMU and wheels over time."""
    with plotting.figure(file, size=(9, 4)) as (_, axis):
        plotting.series(axis, trace['t'], trace['imu_rate'], IMU, 'IMU')
        plotting.series(axis, trace['t'], trace['wheel_rate'], WHEELS, 'wheel odometry', linestyle='--')
        _ends(axis, trace)
        axis.plot([], [], color='dimgrey', linewidth=1.0, linestyle=':', label='a goal ends')
        axis.set(xlabel='time (s)', ylabel='angular velocity z (rad/s)')
        axis.legend(loc='upper left', ncols=3, bbox_to_anchor=(0.0, 1.14))


def angles(file: Path, trace: dict[str, np.ndarray], position: str = 'fused') -> None:
    """Yaw of IMU, wheels and truth over time, and below it x and y as navigation has them (`position`)."""
    with plotting.figure(file, 2, size=(9, 6.5), sharex=True, height_ratios=(3, 2)) as (_, (axis, below)):
        for name, values, colour, style, width in (
            ('true', trace['true'][:, 2], TRUE, '-', 2.8),
            ('IMU', trace['imu_yaw'], IMU, '-', 1.2),
            ('wheel odometry', trace['wheels'][:, 2], WHEELS, '--', 1.2),
        ):
            plotting.series(axis, trace['t'], turned(values), colour, name, linestyle=style, linewidth=width)
        quarters(axis)
        axis.plot([], [], color='dimgrey', linewidth=1.0, linestyle=':', label='a goal ends')
        axis.set(ylabel='yaw (deg)')
        for k, (name, colour) in enumerate((('x', FUSED), ('y', 'tab:orange'))):
            plotting.series(below, trace['t'], trace[position][:, k], colour, name)
        below.set(xlabel='time (s)', ylabel='position (m)')
        for one in (axis, below):
            low, high = one.get_ylim()
            one.set_ylim(low, high + 0.22 * (high - low))
            _ends(one, trace)
            one.legend(loc='upper left', ncols=4)


def quarters(axis: Axes) -> None:
    """Ticks of an angle in deg at quarters, or at whole turns where there are many."""
    low, high = axis.get_ylim()
    step = 90 if high - low < 1000 else 360
    axis.set_yticks(np.arange(step * math.ceil(low / step), high + 1, step))


def turned(yaw: np.ndarray) -> np.ndarray:
    """An angle over time, unwrapped, deg; from where it began, brought into one turn. It is not a number where it was
    none.
    """
    known, found = np.isfinite(yaw), np.full(len(yaw), np.nan)
    if known.any():
        unwrapped = np.degrees(np.unwrap(yaw[known]))
        found[known] = unwrapped - 360.0 * round(unwrapped[0] / 360.0)
    return found


def boxes(file: Path, groups: dict[str, dict[str, Sequence[float]]], label: str) -> None:
    """Distributions side by side on a logarithmic axis: {group: {name: values}}; `label` of the axis. Boxes hold half
    the values, whiskers 5 to 95 %, a point is a chair.
    """
    names = list(dict.fromkeys(name for group in groups.values() for name in group))
    colours = dict(zip(names, ('tab:red', 'tab:orange', 'tab:purple', 'tab:blue', 'tab:grey', 'tab:green')))
    with plotting.figure(file, size=(1.6 + 1.2 * len(groups) + 0.4 * sum(map(len, groups.values())), 5.2)) as (_, axis):
        at, ticks = 0.0, []
        for title, group in groups.items():
            first = at
            for name, values in group.items():
                lines = {'color': colours[name], 'linewidth': 1.6}
                drawn = axis.boxplot(
                    [values],
                    positions=[at],
                    widths=0.6,
                    patch_artist=True,
                    whis=(5, 95),
                    showfliers=False,
                    medianprops={'color': 'black', 'zorder': 4},
                    whiskerprops=lines,
                    capprops=lines,
                )
                drawn['boxes'][0].set(facecolor=colours[name], edgecolor=colours[name], linewidth=1.6, alpha=0.5)
                axis.plot(
                    at + np.linspace(-0.22, 0.22, len(values)) if len(values) > 1 else [at],
                    values,
                    '.',
                    color=colours[name],
                    markersize=5,
                )
                at += 1.0
            ticks.append(((first + at - 1.0) / 2.0, title))
            axis.axvline(at, color='grey', linewidth=0.7)
            at += 1.0
        axis.set_xlim(-1.0, at - 1.0)
        axis.set_yscale('log')
        axis.yaxis.set_major_formatter(lambda value, _: f'{value:g}')
        axis.set_xticks([tick for tick, _ in ticks], [title for _, title in ticks])
        axis.set_ylabel(f'{label}, logarithmic')
        axis.grid(axis='x', visible=False)
        for name in names:
            axis.plot([], [], 's', color=colours[name], label=name)
        axis.legend(loc='lower center', bbox_to_anchor=(0.5, 1.0), ncols=3)
