"""`draw_explored`: how the chair explores a map, frame by frame."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.colors import ListedColormap

from sara_bringup.paths import share
from sara_lab.experiments.plotting import figure
from sara_lab.journeys.drawing import body_at
from sara_lab.journeys.travel_cases import MAPS
from sara_lab.studies.explored import Exploration, Frame
from sara_nav.maps.map_io import OCCUPIED, UNKNOWN

ROWS, COLUMNS, WIDE = 2, 3, 12.0
EVERY_S = 5.0
SHADES = ListedColormap(['0.75', '1.0', '0.0'])  # unknown, free, occupied


def picture(frames: Sequence[Frame], path: Path) -> None:
    """Write a picture of ROWS x COLUMNS of the Frames, as far apart by the way driven as can be, the last one last."""
    ways = np.array([frame.way for frame in frames])
    wanted = np.linspace(0.0, ways[-1], ROWS * COLUMNS)
    shown = [frames[int(np.abs(ways - way).argmin())] for way in wanted[:-1]] + [frames[-1]]
    g = frames[-1].grid.geometry
    known = np.argwhere(frames[-1].grid.data != UNKNOWN)[:, ::-1] * g.resolution + (g.origin_x, g.origin_y)
    (left, low), (right, high) = known.min(0) - 0.2, known.max(0) + 0.2
    tall = WIDE * (high - low) / (right - left) * ROWS / COLUMNS + 0.8
    with figure(path, ROWS, COLUMNS, size=(WIDE, tall), sharex=True, sharey=True) as (_, axes):
        for axis, frame in zip(axes.ravel(), shown):
            _draw(axis, frame)
            axis.set(xlim=(left, right), ylim=(low, high), aspect='equal')
        for axis in axes[-1]:
            axis.set_xlabel('x (m)')
        for axis in axes[:, 0]:
            axis.set_ylabel('y (m)')


def _draw(axis, frame):
    g, data = frame.grid.geometry, frame.grid.data
    shades = np.where(data == UNKNOWN, 0, np.where(data >= OCCUPIED, 2, 1))
    width, height = g.size
    extent = (g.origin_x, g.origin_x + width, g.origin_y, g.origin_y + height)
    axis.imshow(shades, origin='lower', cmap=SHADES, vmin=0, vmax=2, interpolation='nearest', extent=extent)
    axis.set_facecolor('0.75')
    axis.plot(*frame.trail.T, color='tab:blue', linewidth=1.0)
    axis.plot(*frame.cells.T, 's', color='tab:orange', markersize=1.2)
    axis.add_patch(body_at(frame.pose, facecolor='none', edgecolor='tab:red', linewidth=1.2, zorder=3))
    axis.set_title(f'{frame.seconds:.0f} s, {frame.way:.0f} m')
    axis.grid(False)


def main(words: list[str] | None = None) -> None:
    """Entry point of nodes/draw_explored."""
    parser = argparse.ArgumentParser(prog='draw_explored', description=__doc__)
    parser.add_argument('--map', choices=MAPS, default='flat', help='which (default: %(default)s)')
    parser.add_argument('--number', type=int, default=0, metavar='N', help='seed of chair and start (default: 0)')
    folder = share('sara_slam') / 'docs' / 'images'
    parser.add_argument('--out', type=Path, default=folder, help='folder (default: %(default)s)')
    options = parser.parse_args(words)
    found = Exploration(options.map, options.number).run(EVERY_S, lambda sentence: print(sentence, flush=True))
    options.out.mkdir(parents=True, exist_ok=True)
    picture(found.frames, options.out / f'explored_{options.map}.png')
