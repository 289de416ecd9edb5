"""What a person sees of a drive: a table in the terminal and two figures. Matplotlib is loaded only for the figures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sara_common.planar import wrap
from sara_common.platforms import Platform, chosen

if TYPE_CHECKING:
    from sara_bringup.missions.drive import Drive

CORNER_POSITION_M = 0.20  # a corner counts as reached by the true pose within this
CORNER_YAW_DEG = 5.0
YAW_ERROR_DEG = 3.0
SLIP_SHARE = (
    0.6  # of what castors slip at least, by which the wheels' odometry must be off: else the simulated slip is missing
)


def verdict(drive: Drive, goals: int, platform: Platform | None = None) -> list[str]:
    """What of the square's acceptance does not hold, one sentence each; an empty list is a pass. `platform`: the robot,
    the chosen one where none is given.
    """
    faults = []
    if len(drive.corners) != goals:
        faults.append(f'{len(drive.corners)} of {goals} corners driven')
    for number, corner in enumerate(drive.corners, 1):
        if not corner.reached:
            faults.append(f'corner {number} not reached: {corner.text}')
        if not corner.position_error() <= CORNER_POSITION_M:
            faults.append(
                f'corner {number}: true position {corner.position_error():.3f} m off (at most {CORNER_POSITION_M})'
            )
        if not abs(math.degrees(corner.yaw_error())) <= CORNER_YAW_DEG:
            faults.append(
                f'corner {number}: true yaw {math.degrees(corner.yaw_error()):.1f} deg off (at most {CORNER_YAW_DEG})'
            )
    if not math.degrees(drive.yaw_error_max()) <= YAW_ERROR_DEG:
        faults.append(f'fused yaw up to {math.degrees(drive.yaw_error_max()):.2f} deg off (at most {YAW_ERROR_DEG})')
    slip = (platform or chosen()).simulated['slip_range'][0] - 1.0
    if not drive.odometry_heading_error() >= SLIP_SHARE * slip:
        faults.append(f"odometry's heading only {100 * drive.odometry_heading_error():.1f} % off: the slip is missing")
    if drive.contacts:
        faults.append(f'{drive.contacts} contacts')
    return faults


def table(drive: Drive) -> str:
    """The corners as text: asked, estimated, true and odometry pose, then the figures of the whole drive."""

    def pose(p):
        return (
            '      (not known)     '
            if math.isnan(p[0])
            else f'{p[0]:6.2f} {p[1]:6.2f} {math.degrees(p[2]) % 360.0:7.1f}'
        )

    head = (
        f'{"corner":6} | {"asked":^21} | {"estimated":^21} | {"true":^21} | {"wheel odometry alone":^21} | true - asked'
    )
    lines = [f'ekf:={drive.ekf}   seed {drive.seed}   (x m, y m, yaw deg)', head, '-' * len(head)]
    for number, c in enumerate(drive.corners, 1):
        lines.append(
            f'{number:6} | {pose(c.asked)} | {pose(c.estimated)} | {pose(c.true)} | {pose(c.odometry)} | '
            f'{c.position_error():.3f} m {math.degrees(c.yaw_error()):+.1f} '
            f'deg{"" if c.reached else "  NOT REACHED: " + c.text}'
        )
    lines.append(
        f'{drive.sim_time():.0f} s driven, {drive.contacts} contacts; fused yaw at most '
        f'{math.degrees(drive.yaw_error_max()):.2f} deg from the true one; '
        f'odometry turned {100 * drive.odometry_heading_error():+.1f} % against the truth'
    )
    return '\n'.join(lines)


PATHS = (
    ('true', 'black', '-', 2.2),
    ('fused (EKF)', 'tab:blue', '-', 1.4),
    ('wheel odometry alone', 'tab:red', '--', 1.4),
)


def figures(drive: Drive, folder: Path, world: tuple | None = None, stem: str | None = None) -> None:
    """Write STEM_paths.png and STEM_yaw.png into `folder` (a Path); `world` is (occupied (rows, columns), resolution,
    origin) or None.
    """
    import matplotlib

    matplotlib.use('Agg')
    from matplotlib import pyplot

    stem = stem or f'square_{drive.ekf}'
    figure, axes = pyplot.subplots(figsize=(8, 8))
    _draw_paths(axes, drive, world)
    figure.savefig(folder / f'{stem}_paths.png', dpi=110, bbox_inches='tight')
    pyplot.close(figure)

    figure, (axes, error) = pyplot.subplots(2, 1, figsize=(9, 7), sharex=True, height_ratios=(3, 1))
    _draw_yaw(axes, error, drive)
    figure.savefig(folder / f'{stem}_yaw.png', dpi=110, bbox_inches='tight')
    pyplot.close(figure)


def _draw_paths(axes, drive, world):
    _, *paths = drive.arrays()
    if world is not None:
        occupied, resolution, origin = world
        extent = (
            origin[0],
            origin[0] + occupied.shape[1] * resolution,
            origin[1],
            origin[1] + occupied.shape[0] * resolution,
        )
        axes.imshow(occupied, origin='lower', extent=extent, cmap='Greys', vmin=0, vmax=2)
    for (label, colour, style, width), path in zip(PATHS, paths):
        axes.plot(path[:, 0], path[:, 1], style, color=colour, linewidth=width, label=label)
    for number, corner in enumerate(drive.corners, 1):
        x, y, yaw = corner.asked
        axes.annotate(
            '',
            (x + 0.4 * math.cos(yaw), y + 0.4 * math.sin(yaw)),
            (x, y),
            arrowprops={'color': 'tab:green', 'width': 2},
        )
        axes.annotate(str(number), (x, y), xytext=(8, -14), textcoords='offset points', color='tab:green', fontsize=12)
    axes.plot([], [], color='tab:green', linewidth=3, label='asked pose')
    axes.set(xlabel='x (m)', ylabel='y (m)', aspect='equal', title=f'The square, ekf:={drive.ekf}, seed {drive.seed}')
    axes.grid(alpha=0.3)
    axes.legend(loc='upper center', bbox_to_anchor=(0.5, -0.08), ncols=4)


def _draw_yaw(axes, error, drive):
    t, *paths = drive.arrays()
    for (label, colour, style, width), path in zip(PATHS, paths):
        axes.plot(t - t[0], np.degrees(np.unwrap(path[:, 2])), style, color=colour, linewidth=width, label=label)
    axes.set(ylabel='yaw (deg)', title=f'Yaw over time, ekf:={drive.ekf}, seed {drive.seed}')
    axes.set_yticks(np.arange(0, 541, 90))
    axes.legend()
    error.plot(t - t[0], np.degrees(wrap(paths[1][:, 2] - paths[0][:, 2])), color='tab:blue')
    error.set(xlabel='time (s)', ylabel='fused - true (deg)')
    for axis in (axes, error):
        axis.grid(alpha=0.3)
