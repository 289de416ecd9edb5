"""`draw_skills`: a strip of four moments for each skill, a PNG each.

Blue: the body, with a line towards its front, and the way of its middle so far; dashed: where it is to come to; orange:
what the map does not show; green: a slope, with an arrow uphill; red: a threshold.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep, world_of
from sara_bringup.paths import share
from sara_common.platforms import chosen
from sara_lab.experiments.plotting import figure
from sara_lab.journeys.drawing import body_at, draw_map
from sara_lab.rides.skills.items import skills
from sara_lab.rides.skills.skill import Skill
from sara_lab.rides.skills.trial import WAYS, drive
from sara_sim.world.terrain import Ramp, Threshold

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOMENTS = 4
EVERY = 10  # steps between two that are kept
WIDTH, LEAST_HEIGHT = 12.0, 1.2  # inches
LONG = 6  # times as wide as high: its moments stand below each other


class Moment(NamedTuple):
    """t: s. pose: (x, y, yaw). shapes: rows of Obstacles.shapes."""

    t: float
    pose: tuple[float, float, float]
    shapes: np.ndarray


class Film:
    """Keeps a drive's Moments: call it with the Lockstep after each step."""

    def __init__(self) -> None:
        self.moments: list[Moment] = []

    def __call__(self, lockstep: Lockstep) -> None:
        if self.moments and lockstep.time < self.moments[-1].t:  # the next speed of a Push
            self.moments.clear()
        if lockstep.tick % EVERY == 0:
            chair = lockstep.chair
            self.moments.append(Moment(lockstep.time, chair.pose, chair.world.obstacles.shapes.copy()))


def draw_shape(axis: Axes, shape: np.ndarray) -> None:
    """A row of Obstacles.shapes."""
    from matplotlib.patches import Circle, Rectangle

    x, y, c, s, long, wide = shape
    if wide < 0.0:
        axis.add_patch(Circle((x, y), long, color='tab:orange'))
        return
    turned = math.degrees(math.atan2(s, c))
    axis.add_patch(
        Rectangle((x - long, y - wide), 2 * long, 2 * wide, angle=turned, rotation_point='center', color='tab:orange')
    )


def draw_floor(axis: Axes, of: Ramp | Threshold, colour: str) -> None:
    """What slopes or is higher."""
    from matplotlib.patches import Rectangle

    corner, turned = (of.x - 0.5 * of.length, of.y - 0.5 * of.width), math.degrees(of.yaw)
    axis.add_patch(
        Rectangle(corner, of.length, of.width, angle=turned, rotation_point='center', color=colour, alpha=0.3, lw=0)
    )


def draw_slope(axis: Axes, ramp: Ramp) -> None:
    """A slope, and an arrow uphill."""
    draw_floor(axis, ramp, 'tab:green')
    rise = math.copysign(0.35 * min(ramp.length, ramp.width), ramp.slope)
    dx, dy = rise * math.cos(ramp.yaw), rise * math.sin(ramp.yaw)
    axis.annotate('', (ramp.x + dx, ramp.y + dy), (ramp.x - dx, ramp.y - dy), arrowprops={'arrowstyle': '->'})


def draw_moment(axis: Axes, skill: Skill, moments: list[Moment], number: int) -> None:
    """Moment `number` of a drive, and the way until then."""
    draw_map(axis, world_of(skill.grid))
    now = moments[number]
    for ramp in skill.ramps:
        draw_slope(axis, ramp)
    for threshold in skill.thresholds:
        draw_floor(axis, threshold, 'tab:red')
    for goal in skill.goals:
        axis.add_patch(body_at(goal, fill=False, ec='black', lw=0.8, ls='--'))
    for shape in now.shapes:
        draw_shape(axis, shape)
    way = np.array([moment.pose for moment in moments[: number + 1]])
    axis.plot(way[:, 0], way[:, 1], color='tab:blue', lw=1.0)
    axis.add_patch(body_at(now.pose, facecolor='tab:blue', edgecolor='tab:blue', alpha=0.5))
    front = 0.5 * chosen().size[0]
    x, y, yaw = now.pose
    axis.plot([x, x + front * math.cos(yaw)], [y, y + front * math.sin(yaw)], color='black', lw=1.2)
    geometry = skill.grid.geometry
    axis.set_xlim(geometry.origin_x + 0.3, geometry.origin_x + geometry.width * geometry.resolution - 0.3)
    axis.set_ylim(geometry.origin_y + 0.3, geometry.origin_y + geometry.height * geometry.resolution - 0.3)
    axis.set_title(f'{now.t - moments[0].t:.0f} s', fontsize=8)
    axis.set_aspect('equal')
    axis.grid(False)
    axis.set_xticks([])
    axis.set_yticks([])


def strip(name: str, way: str, seed: int, path: Path) -> None:
    """Drive a skill and draw it."""
    film, skill = Film(), skills()[name]
    drive(name, way, seed, film)
    geometry = skill.grid.geometry
    long = geometry.width > LONG * geometry.height
    rows, columns = (MOMENTS, 1) if long else (1, MOMENTS)
    height = max(WIDTH / columns * geometry.height / geometry.width, LEAST_HEIGHT / rows) + 0.25
    with figure(path, rows, columns, (WIDTH, rows * height), squeeze=False) as (_, axes):
        for axis, number in zip(axes.flat, np.linspace(0, len(film.moments) - 1, MOMENTS).round().astype(int)):
            draw_moment(axis, skill, film.moments, int(number))


def main(words: list[str] | None = None) -> None:
    """Entry point of nodes/draw_skills."""
    parser = argparse.ArgumentParser(prog='draw_skills', description=__doc__)
    parser.add_argument('skills', nargs='*', metavar='SKILL', help=f'of {", ".join(skills())}; all without it')
    parser.add_argument('--way', choices=WAYS, default='goals', help='(default: %(default)s)')
    parser.add_argument('--seed', type=int, default=0, help='which chair')
    parser.add_argument(
        '--out',
        type=Path,
        default=share('sara_lab') / 'docs' / 'images' / 'skills',
        help='folder (default: %(default)s)',
    )
    options = parser.parse_args(words)
    unknown = [name for name in options.skills if name not in skills()]
    if unknown:
        parser.error(f'there is no skill {", ".join(unknown)}; there are {", ".join(skills())}')
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.skills or skills():
        strip(name, options.way, options.seed, options.out / f'{name}.png')
