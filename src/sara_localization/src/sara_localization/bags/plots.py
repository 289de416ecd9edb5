"""Pictures of a drive: where the filter says the robot went, beside what its inputs say by themselves.

matplotlib is loaded when a picture is drawn, and draws into a file: no display is needed.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from sara_localization.bags.export import InputTrack, Track


def figure(rows: int, columns: int, size: tuple[float, float]) -> tuple[Any, Any]:
    """(figure, axes) of a canvas without a display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    drawing = Figure(figsize=size, constrained_layout=True)
    FigureCanvasAgg(drawing)
    return drawing, drawing.subplots(rows, columns, squeeze=False)


def draw_drive(
    path: str, track: Track, inputs: Iterable[InputTrack] = (), title: str = '', reference: np.ndarray | None = None
) -> None:
    """The path, yaw and its uncertainty over time, and the speeds, into an image file.

    The paths of the inputs begin where the estimate begins: they are in frames of their own. reference: (n, 2) m, in
    the estimate's frame.
    """
    drawing, axes = figure(2, 2, (11.0, 8.5))
    t = np.array(track.t)
    pose, sigma, speed = (np.array(a, dtype=float) for a in (track.pose, track.sigma, track.speed))
    begin = t[0]
    way, heading, spread, speeds = axes.ravel()
    for i in inputs:
        table = i.array
        if table is None:
            continue
        x, y = brought_to(pose[0], table)
        way.plot(x, y, lw=0.8, label=i.name)
        if np.isfinite(table[:, 3]).all():
            yaw = np.unwrap(table[:, 3])
            heading.plot(table[:, 0] - begin, np.degrees(yaw - yaw[0] + pose[0, 2]), lw=0.8, label=i.name)
    if reference is not None:
        way.plot(reference[:, 0], reference[:, 1], '.', ms=2, color='tab:red', label='reference')
    way.plot(pose[:, 0], pose[:, 1], 'k', lw=1.4, label='filtered')
    heading.plot(t - begin, np.degrees(np.unwrap(pose[:, 2])), 'k', lw=1.2, label='filtered')
    way.plot(*pose[0, :2], 'ko', ms=4)
    way.set_aspect('equal', adjustable='datalim')
    way.set(xlabel='x, m', ylabel='y, m', title='way (starts laid together)')
    heading.set(xlabel='time, s', ylabel='yaw, deg', title='yaw')
    for k, (name, factor) in enumerate((('x, m', 1.0), ('y, m', 1.0), ('yaw, 0.01 rad', 100.0))):
        spread.plot(t - begin, sigma[:, k] * factor, lw=1.0, label=name)
    spread.set(xlabel='time, s', ylabel='standard deviation', title='what the filter thinks of itself')
    speeds.plot(t - begin, speed[:, 0], lw=1.0, label='vx, m/s')
    speeds.plot(t - begin, speed[:, 1], lw=1.0, label='vyaw, rad/s')
    speeds.set(xlabel='time, s', title='speeds')
    for axis in axes.ravel():
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    if title:
        drawing.suptitle(title)
    drawing.savefig(path, dpi=110)


def brought_to(start: tuple[float, float, float], table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x, y (n,) of a way (n, 4: t, x, y, yaw) moved so that it begins at start (x, y, yaw). One without a yaw (NaN)
    stays as it is.
    """
    if np.isnan(table[0, 3]):
        return table[:, 1], table[:, 2]
    turn = start[2] - table[0, 3]
    c, s = np.cos(turn), np.sin(turn)
    dx, dy = table[:, 1] - table[0, 1], table[:, 2] - table[0, 2]
    return start[0] + c * dx - s * dy, start[1] + s * dx + c * dy
