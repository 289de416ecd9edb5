"""What the fuzz does to move_base: each input is a function of the trial and chance; the machine's step follows it."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sara_common.planar import Pose2D
from sara_lab.fuzz.navigation import fuzz_world as world
from sara_lab.fuzz.navigation.fuzz_trial import DT, FuzzFailure
from sara_nav.goals.goal_input import GoalError, global_pose
from sara_nav.goals.move_base_config import ABORTED, PREEMPTED
from sara_nav.grids.footprint import FootprintError, pad_footprint, parse_footprint

if TYPE_CHECKING:
    from sara_lab.fuzz.navigation.fuzz_trial import Trial


def nothing(trial: Trial, chance: random.Random) -> None:
    """A cycle like others."""


def good_goal(trial: Trial, chance: random.Random) -> None:
    """A goal in the house, one of five near the robot."""
    if chance.random() < 0.2:
        here = trial.pose
        trial.set_goal(Pose2D(*(value + chance.uniform(-0.1, 0.1) for value in (here.x, here.y, here.yaw))))
    else:
        trial.set_goal(Pose2D(chance.uniform(0.5, 5.5), chance.uniform(0.5, 5.5), chance.uniform(-math.pi, math.pi)))


def goal_message(trial: Trial, chance: random.Random) -> None:
    """A goal as a client sends it, in frames that there are or not, with quaternions that are none."""

    def find(frame):
        if frame != 'odom':
            raise LookupError(f'"{frame}" does not exist')
        return Pose2D(0.5, 0.0, 0.3)

    try:
        pose = global_pose(*world.message(chance), 'map', find)
    except GoalError as error:
        if len(str(error)) < 20:
            raise FuzzFailure(f'a goal is refused with {str(error)!r}') from None
        trial.count('unreadable')
        trial.machine.abort(f'{error}.')
        trial.end(ABORTED)
        return
    if not pose.is_finite():
        raise FuzzFailure(f'a message gave {pose}')
    trial.set_goal(pose)


def raw_goal(trial: Trial, chance: random.Random) -> None:
    """A goal with numbers that are none."""
    trial.set_goal(world.pose(chance, 0.3))


def flood(trial: Trial, chance: random.Random) -> None:
    """Many goals in one cycle."""
    for _ in range(20):
        trial.set_goal(world.pose(chance))


def cancel(trial: Trial, chance: random.Random) -> None:
    """Given up."""
    trial.machine.cancel(trial.t)
    trial.end(PREEMPTED)


def abort(trial: Trial, chance: random.Random) -> None:
    """Given up by whoever stops the robot."""
    trial.machine.abort('Enough.')
    trial.end(ABORTED)


def strange_pose(trial: Trial, chance: random.Random) -> None:
    """No pose, an old one, one that is none, another place; speeds that are none."""
    trial.strange = True
    trial.told = chance.choice((None, trial.pose, world.pose(chance, 0.4)))
    trial.told_at = chance.choice((trial.t, trial.t - 0.3, trial.t - 2.0, trial.t + 1.0, math.nan, -math.inf, math.inf))
    trial.velocity = chance.choice((None, (world.number(chance), world.number(chance))))


def leap(trial: Trial, chance: random.Random) -> None:
    """The clock leaps; back, it ends the goal."""
    by = chance.choice((0.3, 2.0, 30.0, -3.0, -100.0))
    trial.t += by
    if by < -DT - 1e-3:  # the machine saw the time one step ago
        trial.end(ABORTED)


def standing_clock(trial: Trial, chance: random.Random) -> None:
    """Another cycle at the time of the last one."""
    trial.t -= DT


def map_message(trial: Trial, chance: random.Random) -> None:
    """A map, or what is none."""
    _lay(trial, 'map', lambda: world.grid_map(chance), [layer.set_map for layer in trial.static()])


def mask_message(trial: Trial, chance: random.Random) -> None:
    """Keep-out places, slow ones, or what is none."""
    name = chance.choice(('keepout', 'slow'))
    _lay(trial, 'mask', lambda: world.mask(chance), [costmap.layers[name].set_mask for costmap in trial.costmaps()])


def _lay(trial, what, make, layers):
    """Make a map, and give it to layers; either may refuse it in words."""
    try:
        grid_map = make()
        for take in layers:
            take(grid_map)
        trial.machine.replan()
        trial.count(f'{what}s')
    except ValueError as error:
        if not str(error):
            raise FuzzFailure(f'a {what} is refused without a word') from None
        trial.count(f'bad {what}s')


def map_update(trial: Trial, chance: random.Random) -> None:
    """A part of a map, which may lie off it."""
    values = np.full((chance.choice((0, 1, 9)), chance.choice((0, 1, 9))), chance.choice((0, 100, -1)), np.int8)
    x, y = chance.choice((-1, 0, 5, 58, 10**6)), chance.choice((-1, 0, 5, 58, 10**6))
    for layer in trial.static():
        try:
            layer.update_map(x, y, values)
        except ValueError:
            trial.count('bad map updates')


def ranges(trial: Trial, chance: random.Random) -> None:
    """What range sensors say."""
    for costmap in trial.costmaps():
        for source in ('front', 'rear'):
            costmap.layers['ultrasonic'].add_range(world.reading(chance, source, trial.pose, trial.t))


def scan(trial: Trial, chance: random.Random) -> None:
    """What a scanner or a camera says."""
    for costmap in trial.costmaps():
        try:
            costmap.layers['obstacles'].add_observation(world.observation(chance, trial.pose, trial.t))
        except ValueError:
            trial.count('bad observations')


def clear(trial: Trial, chance: random.Random) -> None:
    """The service clear_costmaps."""
    local = trial.pose if trial.offset is None else trial.offset.compose(trial.pose)
    trial.machine.costmaps.reset(trial.t, trial.pose, local)


def make_plan(trial: Trial, chance: random.Random) -> None:
    """The service make_plan."""
    try:
        plan, text = trial.machine.make_plan(
            trial.t, world.pose(chance), world.pose(chance), world.number(chance, 0.0, 0.4)
        )
    except ValueError as error:
        if len(str(error)) < 20:
            raise FuzzFailure(f'make_plan refuses with {str(error)!r}') from None
        trial.count('plans refused')
        return
    if plan is None and not text or plan is not None and not np.isfinite(plan).all():
        raise FuzzFailure(f'make_plan gives {plan!r}, {text!r}')
    trial.count('plans')


def reconfigure(trial: Trial, chance: random.Random) -> None:
    """Another configuration, taken when it has no faults, as dynamic_reconfigure does."""
    config = world.configuration(chance, trial.machine.config)
    if config.faults():
        trial.count('bad configurations')
        return
    trial.machine.reconfigure(config)


def footprint(trial: Trial, chance: random.Random) -> None:
    """Another footprint by topic."""
    corners = [[world.number(chance, -0.3, 0.3, 0.05) for _ in 'xy'] for _ in range(chance.choice((0, 2, 3, 5)))]
    try:
        corners = pad_footprint(parse_footprint(corners), 0.01)
    except FootprintError:
        trial.count('bad footprints')
        return
    if abs(corners).max() < 1.0:
        for costmap in trial.costmaps():
            costmap.set_footprint(corners)


INPUTS = (
    (nothing, 40),
    (good_goal, 6),
    (goal_message, 4),
    (raw_goal, 2),
    (flood, 1),
    (cancel, 2),
    (abort, 1),
    (strange_pose, 6),
    (leap, 2),
    (standing_clock, 3),
    (map_message, 2),
    (map_update, 1),
    (mask_message, 2),
    (ranges, 10),
    (scan, 8),
    (clear, 1),
    (make_plan, 2),
    (reconfigure, 2),
    (footprint, 1),
)
"""Inputs and how often they come."""


def choose(trial: Trial, chance: random.Random) -> Callable[[Trial, random.Random], None]:
    """Return the next input: a calm trial is mostly left to drive, so that the robot gets somewhere."""
    if chance.random() < trial.calm:
        return nothing if trial.machine.active else good_goal
    return chance.choices(*zip(*INPUTS))[0]
