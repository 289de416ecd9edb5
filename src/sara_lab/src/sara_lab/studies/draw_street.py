"""`draw_street SEED OUT.png`: a chair's kilometre along the street: its true way, the receiver's fixes, the way by
compass and wheels alone, and what the filter of the map makes of all.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from sara_bringup.paths import share
from sara_lab.experiments.plotting import figure
from sara_lab.studies.street_drive import HOME, StreetDrive, kept
from sara_lab.studies.street_filter import Replay, replay
from sara_lab.workers.sources import folder_of
from sara_nav.maps.map_io import load_map

MAP = 'street.yaml'


def reckoned(drive: StreetDrive) -> np.ndarray:
    """(n, 3) t, x, y by the wheels' speed along the compass's heading, from the true start."""
    t, yaw = drive.headings[:, 0], drive.headings[:, 3]
    step = np.interp(t, drive.wheels[:, 0], drive.wheels[:, 1]) * np.gradient(t)
    x, y, _ = drive.pose(t[0])
    return np.column_stack((t, x + np.cumsum(step * np.cos(yaw)), y + np.cumsum(step * np.sin(yaw))))


def picture(drive: StreetDrive, done: Replay, path: Path) -> None:
    """Above the map with all ways; below, over time, how far fixes and estimate are off, and what the latter claims."""
    grid = load_map(str(share() / 'maps' / MAP))
    g, (rows, columns) = grid.geometry, grid.data.shape
    times = np.array([estimate.time for estimate in done.estimates])
    errors = np.array([estimate.error for estimate in done.estimates])
    claimed = np.array([estimate.covariance for estimate in done.estimates])
    true = np.array([drive.pose(time)[:2] for time in times])
    fixes = drive.fixes[drive.fixes[:, 1] >= 0]
    antenna = np.array([drive.pose(row[0])[:2] for row in fixes]) + fixes[:, 7:9]
    thrown = fixes[:, 6] > 0
    with figure(path, 2, 1, (11.0, 8.5), height_ratios=(3, 2)) as (_, (above, below)):
        extent = 0.0, columns * g.resolution, 0.0, rows * g.resolution
        above.imshow(np.where(grid.data > 0, 0.75, 1.0), origin='lower', extent=extent, cmap='gray', vmin=0, vmax=1)
        above.plot(*antenna[~thrown].T, '.', ms=2, color='tab:orange', label='fixes')
        above.plot(*antenna[thrown].T, 'x', ms=3, color='tab:red', label='fixes, multipath')
        above.plot(*reckoned(drive)[:, 1:].T, lw=1, color='tab:green', label='compass and wheels alone')
        above.plot(*(true + errors[:, :2]).T, lw=1.2, color='tab:blue', label='filter of the map')
        above.plot(*true.T, lw=1, color='black', label='true')
        above.plot(HOME.x, HOME.y, 'o', color='black')
        above.set(xlabel='x, m (east)', ylabel='y, m (north)', aspect='equal')
        above.legend(loc='upper right', fontsize=8)
        below.plot(fixes[~thrown, 0], np.hypot(*fixes[~thrown, 7:9].T), '.', ms=2, color='tab:orange', label='fixes')
        below.plot(times, np.hypot(*errors[:, :2].T), color='tab:blue', label='filter of the map')
        sigma = np.sqrt(np.trace(claimed[:, :2, :2], axis1=1, axis2=2))
        below.plot(times, sigma, color='tab:blue', lw=0.8, ls='--', label='what it claims (r.m.s.)')
        for begin, end in drive.outages:
            below.axvspan(begin, end, color='0.9')
        below.set(xlabel='s (grey: no fixes)', ylabel='off, m', ylim=(0.0, None))
        below.legend(loc='upper right', fontsize=8)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog='draw_street', description=__doc__)
    parser.add_argument('seed', type=int, help='which chair')
    parser.add_argument('out', type=Path, metavar='OUT.png')
    parser.add_argument('--drives', type=Path, default=Path('out/campaign'), help='where the campaign keeps its drives')
    given = parser.parse_args(arguments)
    folder = folder_of(given.drives)
    folder.mkdir(parents=True, exist_ok=True)
    drive = kept(given.seed, folder)
    picture(drive, replay(drive, given.seed), given.out)
