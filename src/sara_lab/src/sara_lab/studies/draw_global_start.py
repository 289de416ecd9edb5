"""`draw_global_start`: our amcl finds a robot that may be anywhere in an office, scan by scan, as a PNG.

The drive is the C++ amcl's test `global_localization_stage` (amcl_drives.py). A frame before the first scan, and one
after each scan that counted, until no more than max_particles are left.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.lines import Line2D

from sara_bringup.paths import share
from sara_common.planar import compose
from sara_lab.experiments.plotting import FUSED, TRUE, figure
from sara_lab.journeys.drawing import draw_map
from sara_lab.studies.amcl_drives import AMCL_TESTS, AmclTest, Pose
from sara_lab.studies.amcl_trial import Localised, maps
from sara_localization.particles.beams import BeamChoice, chosen
from sara_localization.particles.scan_input import ScanInput
from sara_localization.ranges.range_data import RangeMap
from sara_sim.world.world import World

COLUMNS, WIDTH, HEIGHT = 3, 12, 3.75  # pictures in a row; inches of a row's width and height
PARTICLES, BEAMS, ESTIMATE = 'tab:red', 'tab:green', FUSED
ARROW = 4.0  # m: larger than the robot, to be seen
CELLS = 3  # of the map along each side of a cell that is drawn, so that no wall gets lost between pixels
CLOSE = 1.8  # m about the robot in the close-up
FAINT = 20_000  # of more particles each is drawn the fainter


class Frame(NamedTuple):
    """t: s. truth, estimate: poses (x, y, yaw; m, rad), the estimate None before the first scan. particles: (n, 3)
    poses. beams: (m, 2) where those of the newest scan end, in the map, m.
    """

    t: float
    truth: Pose
    estimate: Pose | None
    particles: np.ndarray
    beams: np.ndarray


def drive(test: AmclTest, world: World, world_map: RangeMap, seed: int) -> Iterator[Frame]:
    """The frames of a test's drive; to its end where the search does not end before."""
    localised = Localised(test, world_map, seed)
    yield Frame(0.0, test.start, None, localised.particles, np.empty((0, 2)))
    for moment in test.drive(world, seed):
        scans = localised.on_moment(moment)
        if scans:
            ends = _ends(scans[-1], moment.truth, test.parameters['laser_max_beams'])
            yield Frame(moment.t, moment.truth, localised.estimate(), localised.particles, ends)
            if len(localised.particles) <= test.parameters['max_particles']:
                return


def _ends(scan: ScanInput, truth: Pose, beams: int) -> np.ndarray:
    points = chosen(scan.sweep, scan.mount, BeamChoice(beams)).points
    return np.array([compose(truth, (*point, 0.0))[:2] for point in points]).reshape(-1, 2)


def coarse(world: World) -> World:
    """The same walls in cells that are CELLS times as large."""
    rows, columns = (-size % CELLS for size in world.occupied.shape)
    padded = np.pad(world.occupied, ((0, rows), (0, columns)))
    height, width = (size // CELLS for size in padded.shape)
    blocks = padded.reshape(height, CELLS, width, CELLS)
    return World(blocks.any((1, 3)), CELLS * world.resolution, world.origin)


def title(frame: Frame, scans: int) -> str:
    """What a frame shows; scans: how many have counted."""
    count = f'{len(frame.particles):,} particles'.replace(',', ' ')
    if frame.estimate is None:
        return f'before the first scan: {count}'
    off = math.dist(frame.estimate[:2], frame.truth[:2])
    after = f'after {round(frame.t, 2):g} s, {scans} scan{"s" * (scans > 1)}'
    return f'{after}: {count}, {off:.2f} m off'


def _arrow(axis, pose, length, width, colour):
    """From a pose on, m."""
    x, y, yaw = pose
    style = {'width': width, 'head_width': 2.5 * width, 'head_length': 0.5 * length, 'lw': 0, 'zorder': 3}
    axis.arrow(x, y, length * math.cos(yaw), length * math.sin(yaw), fc=colour, length_includes_head=True, **style)


def _draw(axis, world, frame, length=ARROW):
    """A frame on its map; length: m of the arrows."""
    draw_map(axis, world)
    limits = axis.axis()
    alpha = max(0.2, min(1.0, FAINT / len(frame.particles)))
    axis.plot(*frame.particles[:, :2].T, ',', color=PARTICLES, alpha=alpha)
    for end in frame.beams:
        axis.plot(*zip(frame.truth[:2], end), color=BEAMS, lw=0.7)
    _arrow(axis, frame.truth, length, 0.32 * length, TRUE)
    if frame.estimate is not None:
        _arrow(axis, frame.estimate, length, 0.16 * length, ESTIMATE)
    axis.axis(limits)
    axis.set(xticks=[], yticks=[])


def _close_up(axis, world, frame):
    """The surroundings of the robot, in a corner."""
    x, y, _ = frame.truth
    inset = axis.inset_axes((0.52, 0.02, 0.46, 0.46))
    _draw(inset, world, frame, 1.0)
    inset.plot(*frame.particles[:, :2].T, '.', color=PARTICLES, ms=1.5, mew=0, zorder=4)
    inset.set(xlim=(x - CLOSE, x + CLOSE), ylim=(y - CLOSE, y + CLOSE))
    axis.indicate_inset_zoom(inset, edgecolor='black')


def picture(frames: Sequence[Frame], world: World, path: Path) -> None:
    """All frames, in rows; the last one with a close-up."""
    rows, walls = math.ceil(len(frames) / COLUMNS), coarse(world)
    with figure(path, rows, COLUMNS, (WIDTH, HEIGHT * rows), squeeze=False) as (canvas, axes):
        for scans, (axis, frame) in enumerate(zip(axes.flat, frames)):
            _draw(axis, walls, frame)
            axis.set_title(title(frame, scans), fontsize=10)
        for axis in axes.flat[len(frames) :]:
            axis.remove()
        _close_up(axes.flat[len(frames) - 1], world, frames[-1])
        marks = [
            Line2D([], [], color=colour, marker=marker, ls=line, lw=2, label=label)
            for colour, marker, line, label in (
                (TRUE, '>', '-', 'where the robot is'),
                (ESTIMATE, '>', '-', 'where amcl says it is'),
                (PARTICLES, '.', '', 'particles: where it may be'),
                (BEAMS, '', '-', "the newest scan's beams"),
            )
        ]
        canvas.legend(handles=marks, loc='lower center', bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False)


def main(words: list[str] | None = None) -> None:
    """Entry point of nodes/draw_global_start."""
    parser = argparse.ArgumentParser(prog='draw_global_start', description=__doc__)
    folder = share('sara_localization') / 'docs' / 'images'
    parser.add_argument('--out', type=Path, default=folder, help='folder (default: %(default)s)')
    parser.add_argument('--seed', type=int, default=5, help='of the robot and the particles (default: %(default)s)')
    options = parser.parse_args(words)
    world, world_map = maps()
    frames = list(drive(AMCL_TESTS['global_localization_stage'], world, world_map, options.seed))
    for scans, frame in enumerate(frames):
        print(title(frame, scans))
    options.out.mkdir(parents=True, exist_ok=True)
    picture(frames, world, options.out / 'global_start.png')
