"""`draw_rides`: the circuits, with what a rider wished for and the way that was driven; a PNG for each circuit.

A row for each rider, a column for each way to drive. Blue: the body's middle, and its outline every few metres; red
strokes: where the stick's wish alone would have led within a second and a half; black crosses: contacts; green: the way
of somebody who knows it.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sara_bringup.lockstep.lockstep import world_of
from sara_bringup.paths import share
from sara_common.planar import advanced
from sara_common.platforms import chosen
from sara_lab.experiments.plotting import figure
from sara_lab.journeys.drawing import body_at, draw_map
from sara_lab.rides.circuits import Circuit, circuits
from sara_lab.rides.ride import WAYS, Log, Ride, logged_ride
from sara_nav.planners.planning import distances_along
from sara_sim.riders.riders import RIDERS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = ('late', 'blind')
WISH_S, WISHES = 1.5, 16  # s that a wish is drawn for; one of so many readings is drawn
OUTLINE_M = 1.5  # m between two outlines of the body
WIDTH = 15  # inches


def draw_ride(axis: Axes, circuit: Circuit, driven: tuple[Ride, Log]) -> None:
    """One ride on its map."""
    made, log = driven
    draw_map(axis, world_of(circuit.grid))
    axis.plot(*np.transpose(circuit.task.way), color='tab:green', lw=0.8)
    poses, slip = np.array(log.poses), chosen().parameters('safety_gate')['turn_slip']
    for step, reading in log.readings[::WISHES]:
        v, w = reading.wish
        pose = log.poses[min(step, len(log.poses) - 1)][1:]
        ends = [advanced(*pose, v, w / slip, share * WISH_S)[:2] for share in np.linspace(0.0, 1.0, 7)]
        axis.plot(*np.transpose(ends), color='tab:red', lw=0.8)
    axis.plot(poses[:, 1], poses[:, 2], color='tab:blue', lw=1.2)
    way = distances_along(poses[:, 1:3])
    for along in np.arange(0.0, way[-1] + OUTLINE_M, OUTLINE_M):
        k = min(int(np.searchsorted(way, along)), len(poses) - 1)
        axis.add_patch(body_at(poses[k, 1:], fill=False, ec='tab:blue', lw=0.5))
    for contact in made.contacts:
        k = min(int(np.searchsorted(poses[:, 0], contact['t'])), len(poses) - 1)
        axis.plot(poses[k, 1], poses[k, 2], 'kx', ms=6)
    end = f'{made.seconds:.0f} s' if made.completed else f'given up at {made.passed} of {len(circuit.checkpoints)}'
    axis.set_title(f'{made.rider}, {made.way}: {end}, {len(made.contacts)} contacts', fontsize=8)
    axis.set_xticks([])
    axis.set_yticks([])


def picture(name: str, riders: Sequence[str], ways: Sequence[str], path: Path, seed: int = 0) -> None:
    """A circuit's PNG: its riders on the chair `seed`, in some of the WAYS."""
    circuit = circuits()[name]
    geometry = circuit.grid.geometry
    size = WIDTH, WIDTH / len(ways) * geometry.height / geometry.width * len(riders) * 1.15
    with figure(path, len(riders), len(ways), size, squeeze=False) as (_, axes):
        for row, rider in zip(axes, riders):
            for axis, way in zip(row, ways):
                draw_ride(axis, circuit, logged_ride(name, rider, way, seed))


def main(words: list[str] | None = None) -> None:
    """Entry point of nodes/draw_rides."""
    parser = argparse.ArgumentParser(prog='draw_rides', description=__doc__)
    parser.add_argument('circuits', nargs='*', metavar='CIRCUIT', help=f'of {", ".join(circuits())}; all without it')
    parser.add_argument(
        '--riders', nargs='+', default=SHOWN, choices=RIDERS, metavar='RIDER', help='(default: %(default)s)'
    )
    parser.add_argument(
        '--ways', nargs='+', default=('gate', 'assisted'), choices=WAYS, metavar='WAY', help='(default: %(default)s)'
    )
    parser.add_argument('--seed', type=int, default=0, help='which chair, and whose luck')
    parser.add_argument(
        '--out', type=Path, default=share('sara_lab') / 'docs' / 'images', help='folder (default: %(default)s)'
    )
    options = parser.parse_args(words)
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.circuits or circuits():
        picture(name, options.riders, options.ways, options.out / f'ride_{name}.png', options.seed)
