"""`draw_encounters`: the chair meets a pedestrian in a door, in a corridor and at a crossing, frame by frame, as a PNG.

The pedestrian is one of the social force model (sara_sim.pedestrians), who sees the chair. The pose is the true one.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.patches import Circle

from sara_bringup.lockstep.lockstep import Lockstep, world_of
from sara_bringup.paths import share
from sara_lab.experiments.plotting import figure
from sara_lab.journeys.drawing import body_at, draw_map
from sara_lab.journeys.tight_places import block
from sara_lab.journeys.travel import Recorder, reach
from sara_lab.judge import gaps
from sara_nav.maps import map_io
from sara_sim.pedestrians.pedestrian import Pedestrian, PedestrianConfig

PATIENCE_S = 120.0
FRAMES, APART_S, BEFORE = 8, 2.0, 4  # so many pictures, s between them; the nearest approach comes after so many
WIDTH = 16  # inches
CHAIR, PEDESTRIAN = 'tab:blue', 'tab:orange'
SPEED = 1.0  # m/s at which the pedestrian walks


class Scene(NamedTuple):
    """grid: the map. start, goal: poses (x, y, yaw) of the chair, m, rad. walk: places of the pedestrian. delay: s
    after the chair's goal is given that they set out.
    """

    grid: map_io.GridMap
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    walk: tuple[tuple[float, float], tuple[float, float]]
    delay: float


class Frame(NamedTuple):
    """`t`: s. `chair`: (x, y, yaw). `pedestrian`: (x, y). `speed`: m/s of the chair. `gap`: m between them."""

    t: float
    chair: tuple[float, float, float]
    pedestrian: tuple[float, float]
    speed: float
    gap: float


def scenes() -> dict[str, Scene]:
    """All by name."""
    door = block((8.2, 3.0), ((0.0, 0.0, 4.0, 3.0), (4.0, 1.05, 4.2, 1.95), (4.2, 0.0, 8.2, 3.0)))
    corridor = block((12.0, 1.8), ((0.0, 0.0, 12.0, 1.8),))
    crossing = block((9.0, 9.0), ((0.0, 3.6, 9.0, 5.4), (3.6, 0.0, 5.4, 9.0)))
    return {
        'door': Scene(door, (1.2, 1.5, 0.0), (6.8, 1.5, 0.0), ((7.4, 1.5), (0.6, 0.6)), 2.0),
        'corridor': Scene(corridor, (1.2, 0.9, 0.0), (10.6, 0.9, 0.0), ((11.2, 0.9), (0.8, 0.9)), 2.0),
        'crossing': Scene(crossing, (1.2, 4.5, 0.0), (7.8, 4.5, 0.0), ((4.5, 0.6), (4.5, 8.4)), 4.0),
    }


def drive(scene: Scene) -> tuple[list[Frame], bool]:
    """Drive a scene; returns (a Frame for each step from the pedestrian's start on, whether the goal was reached)."""
    lockstep, frames = Lockstep(scene.grid, scene.start, 0, localization='fake'), []
    world = lockstep.chair.world
    config = PedestrianConfig('pedestrian', scene.walk, speed=SPEED, waits=(PATIENCE_S, PATIENCE_S))
    pedestrian = Pedestrian(config, world)

    def watch(_):
        if lockstep.time >= begin + scene.delay and not world.obstacles.all:
            world.obstacles.add(pedestrian)
        elif world.obstacles.all:
            place, chair = pedestrian.pose(lockstep.time), lockstep.chair
            gap = gaps.to_shape(chair.pose, chair.platform.size, pedestrian.shape(lockstep.time))
            frames.append(Frame(lockstep.time - begin, chair.pose, place[:2], chair.velocity[0], gap))

    begin = math.inf
    recorder = Recorder(lockstep, watch)
    lockstep.start_up()
    begin = lockstep.time
    goal, _ = reach(recorder, scene.goal, PATIENCE_S)
    return frames, goal.reached


def chosen(frames: Sequence[Frame]) -> list[Frame]:
    """FRAMES of them about the nearest approach, APART_S apart."""
    nearest = frames[int(np.argmin([frame.gap for frame in frames]))].t
    first = max(nearest - BEFORE * APART_S, frames[0].t)
    times = [first + APART_S * k for k in range(FRAMES)]
    return [min(frames, key=lambda frame, t=t: abs(frame.t - t)) for t in times]


def _draw(axis, world, frames, now):
    """A frame on its map, with the ways until then."""
    draw_map(axis, world)
    past = [frame for frame in frames if frame.t <= now.t]
    for places, colour in (([f.chair[:2] for f in past], CHAIR), ([f.pedestrian for f in past], PEDESTRIAN)):
        axis.plot(*np.transpose(places), color=colour, lw=0.8)
    axis.add_patch(body_at(now.chair, color=CHAIR))
    axis.add_patch(Circle(now.pedestrian, PedestrianConfig.radius, color=PEDESTRIAN))
    axis.set_title(f'{now.t:.0f} s   {now.speed:.2f} m/s   {now.gap:.2f} m', fontsize=8)
    axis.set_xticks([])
    axis.set_yticks([])


def picture(driven: dict[str, tuple[Scene, Sequence[Frame]]], path: Path) -> None:
    """A row of pictures for each scene."""
    heights = [scene.grid.geometry.height / scene.grid.geometry.width for scene, _ in driven.values()]
    size = WIDTH, WIDTH / FRAMES * sum(heights) + 0.4 * len(driven)
    ratios = {'height_ratios': heights}
    with figure(path, len(driven), FRAMES, size, squeeze=False, gridspec_kw=ratios) as (canvas, axes):
        for row, (name, (scene, frames)) in zip(axes, driven.items()):
            world = world_of(scene.grid)
            for axis, frame in zip(row, chosen(frames)):
                _draw(axis, world, frames, frame)
            row[0].set_ylabel(name)
        canvas.suptitle('the chair (blue) meets a pedestrian of the model: time, speed of the chair, gap', fontsize=10)


def main(words: list[str] | None = None) -> None:
    """Entry point of nodes/draw_encounters."""
    parser = argparse.ArgumentParser(prog='draw_encounters', description=__doc__)
    parser.add_argument(
        '--out', type=Path, default=share().parents[1] / 'docs' / 'images', help='folder (default: %(default)s)'
    )
    options = parser.parse_args(words)
    driven = {}
    for name, scene in scenes().items():
        frames, reached = drive(scene)
        least = min(frame.gap for frame in frames)
        print(f'{name}: {"reached" if reached else "NOT reached"} after {frames[-1].t:.0f} s, nearest {least:.2f} m')
        driven[name] = scene, frames
    options.out.mkdir(parents=True, exist_ok=True)
    picture(driven, options.out / 'encounters.png')
