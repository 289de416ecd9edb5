"""Recovery behaviours: what a robot does that has no way on. Names, parameters and defaults are the peers'.

A behaviour is stepped by move_base, one control cycle at a time, so that it ends with that cycle when the goal is given
up:
``start(situation)``, then ``update(situation)`` until it says ``done``. The C++ behaviours hold their thread until they
are through, and cannot be cancelled.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sara_common.planar import Pose2D, wrap
from sara_nav.config.registry import Registry
from sara_nav.costmaps.costmap_pair import CostmapPair
from sara_nav.costmaps.layered_costmap import LayeredCostmap
from sara_nav.goals.driven_path import Track
from sara_nav.grids.collision import LocalWorld

NOT_CLEARED = (
    'costmap_2d::StaticLayer',
    'sara_nav/KeepoutFilter',
    'sara_nav/SpeedFilter',
    'costmap_2d::InflationLayer',
)
"""Layers that hold nothing a sensor has seen."""


class RecoveryRegistry(Registry):
    """Behaviours by the name users write into ``recovery_behaviors``, with or without its package."""

    def find(self, name: str) -> type:
        """Return the class of that name; raises UnknownPlanner, whose text says what there is."""
        full = [known for known in (*self.names(), *self.refused) if name == known.split('/')[-1]]
        return super().find(full[0] if full else name)


RECOVERIES = RecoveryRegistry(
    'recovery_behaviors',
    ('sara_nav.recovery.back_out', 'sara_nav.recovery.help'),
    refused={
        'move_slow_and_clear/MoveSlowAndClear': 'clear_costmap_recovery/ClearCostmapRecovery to clear, and the '
        "local planner's max_vel_x to be slow"
    },
)


@dataclass(frozen=True)
class Situation:
    """What a behaviour is given: now (s) and since the last step, the robot's pose in the global frame and in the local
    costmap's, its velocity (v, w), the LocalWorld to look for collisions in, and the CostmapPair; the Track it came by,
    the goal (Pose2D), what led to recovery, in words, and what returns a new plan (n, 3) or raises PlanError.
    """

    t: float
    dt: float
    pose: Pose2D
    local_pose: Pose2D
    velocity: tuple
    world: LocalWorld
    costmaps: CostmapPair
    track: Track | None = None
    goal: Pose2D | None = None
    why: str = ''
    plan: Callable[[], np.ndarray] | None = None


@dataclass(frozen=True)
class RecoveryStep:
    """What to drive (v m/s, w rad/s), whether the behaviour is through, and what there is to say. help: what a person
    is asked for, or ''.
    """

    command: tuple = (0.0, 0.0)
    done: bool = True
    text: str = ''
    help: str = ''


@dataclass(frozen=True)
class ClearCostmapConfig:
    """reset_distance: side (m) of the square about the robot outside which (inside with invert_area_to_clear) is
    cleared.
    layer_names: the layers that are; unset, those that sensors mark. (The peer's default is a layer called
    ``obstacles``, which its own default costmap does not have.) force_updating: update the costmaps at once, not when
    they are due.
    """

    reset_distance: float = 3.0
    invert_area_to_clear: bool = False
    force_updating: bool = False
    affected_maps: str = 'both'
    layer_names: tuple = None

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = []
        if not (math.isfinite(self.reset_distance) and self.reset_distance >= 0.0):
            result.append(f'reset_distance is {self.reset_distance!r}, allowed are numbers of 0 or more')
        if self.affected_maps not in ('both', 'global', 'local'):
            result.append(f'affected_maps is {self.affected_maps!r}, allowed are both, global and local')
        names = self.layer_names
        if names is not None and not (isinstance(names, (list, tuple)) and all(isinstance(n, str) for n in names)):
            result.append(f'layer_names is {names!r}, allowed is a list of names')
        return result


class Recovery:
    """A behaviour called ``name``, with its ``config``."""

    config_class: type
    clears_only = False
    """It does no more than to clear costmaps."""

    def __init__(self, name: str, config: object = None) -> None:
        self.name = name
        self.config = self.config_class() if config is None else config

    def start(self, situation: Situation) -> None:
        """Begin."""

    def missing(self, global_costmap: LayeredCostmap, local_costmap: LayeredCostmap) -> list[str]:
        """Return sentences on what the costmaps do not have though it is asked for."""
        return []

    def excuse_standing(self) -> None:
        """It is not in vain that the robot has stood until now."""

    def update(self, situation: Situation) -> RecoveryStep:
        """Return what to do in this control cycle."""
        raise NotImplementedError


@RECOVERIES.register('clear_costmap_recovery/ClearCostmapRecovery')
class ClearCostmapRecovery(Recovery):
    """Forgets what sensors marked, away from the robot; through in one step."""

    config_class = ClearCostmapConfig
    clears_only = True

    def layers(self, costmap: LayeredCostmap) -> list[str]:
        """Return the names of the costmap's layers that are cleared; one named by several parts is known by its
        last.
        """
        if self.config.layer_names is None:
            return [n for n, layer in costmap.layers.items() if getattr(layer, 'plugin_name', '') not in NOT_CLEARED]
        return [n for n in costmap.layers if n.split('/')[-1] in self.config.layer_names]

    def missing(self, global_costmap: LayeredCostmap, local_costmap: LayeredCostmap) -> list[str]:
        """Return sentences about names in layer_names that no affected costmap has, and about having nothing to
        clear.
        """
        costmaps = [costmap for costmap, _, _ in self._affected(global_costmap, local_costmap)]
        there = {name.split('/')[-1] for costmap in costmaps for name in costmap.layers}
        result = [
            '{}/layer_names holds {!r} but no affected costmap has that layer (there are: {})'.format(
                self.name, name, ', '.join(sorted(there))
            )
            for name in self.config.layer_names or ()
            if name not in there
        ]
        if not any(self.layers(costmap) for costmap in costmaps):
            result.append(f'recovery behaviour {self.name} has nothing to clear: no affected costmap has such a layer')
        return result

    def update(self, situation: Situation) -> RecoveryStep:
        """Clear; the text says what."""
        c, said = self.config, []
        both = situation.costmaps
        affected = self._affected(both.world, both.local, situation.pose, situation.local_pose)
        for costmap, kind, pose in affected:
            names = self.layers(costmap)
            half = 0.5 * c.reset_distance
            if names:
                costmap.clear_area(
                    pose.x - half, pose.y - half, pose.x + half, pose.y + half, c.invert_area_to_clear, names
                )
                if c.force_updating:
                    both.refresh(costmap, situation.t, pose)
            said.append('{}: {}'.format(kind, ', '.join(names) or 'nothing'))
        return RecoveryStep(
            text='{}: cleared what lies {} a square of {:.2f} m about the robot ({})'.format(
                self.name, 'inside' if c.invert_area_to_clear else 'outside', c.reset_distance, '; '.join(said)
            )
        )

    def _affected(self, global_costmap, local_costmap, pose=None, local_pose=None):
        both = (global_costmap, 'global', pose), (local_costmap, 'local', local_pose)
        return [entry for entry in both if self.config.affected_maps in ('both', entry[1])]


@dataclass(frozen=True)
class RotateRecoveryConfig:
    """Limits of the turn (rad, rad/s, rad/s2). sim_granularity: how far apart (rad) the footprint is tried. frequency:
    of no effect, as a turn is commanded in each control cycle.
    """

    sim_granularity: float = 0.017
    frequency: float = 20.0
    acc_lim_theta: float = 3.2
    max_vel_theta: float = 1.0
    min_in_place_vel_theta: float = 0.4
    yaw_goal_tolerance: float = 0.10

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        return [
            f'{name} is {getattr(self, name)!r}, allowed are numbers above 0'
            for name in self.__dataclass_fields__
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0)
        ]


@RECOVERIES.register('rotate_recovery/RotateRecovery')
class RotateRecovery(Recovery):
    """Turns once about, counter-clockwise; stops when any part of what is left of the turn would touch something.

    The peer looks at the footprint's outline; here its inside counts too. The turn is measured in the local costmap's
    frame, which does not jump. A robot that does not turn as told is given up on after twice the time that the slowest
    turn takes.
    """

    config_class = RotateRecoveryConfig
    SLOW_ENOUGH = 0.05
    """Speed (m/s) below which a robot that was driving may begin to turn."""

    def start(self, situation: Situation) -> None:
        """Begin."""
        self._yaw = situation.local_pose.yaw
        self._turned = self._rate = 0.0
        self._began = situation.t

    def update(self, situation: Situation) -> RecoveryStep:
        """Return the turn for this cycle: as fast as lets it stop in time, within the limits."""
        c, pose = self.config, situation.pose
        self._turned += wrap(situation.local_pose.yaw - self._yaw)
        self._yaw = situation.local_pose.yaw
        left = 2.0 * math.pi - self._turned
        if left <= c.yaw_goal_tolerance:
            return RecoveryStep(text=f'{self.name}: turned once about')
        slowest = min(c.min_in_place_vel_theta, c.max_vel_theta)
        if situation.t - self._began > 4.0 * math.pi / slowest:
            return RecoveryStep(
                text=f'{self.name}: given up after {situation.t - self._began:.0f} s, having turned '
                f'{math.degrees(self._turned):.0f} deg'
            )
        angles = pose.yaw + np.arange(0.0, left, c.sim_granularity)
        poses = np.column_stack([np.full(len(angles), pose.x), np.full(len(angles), pose.y), angles])
        touched = np.flatnonzero(situation.world.touched(poses))
        if len(touched):
            return RecoveryStep(
                text=f"{self.name}: Rotate recovery can't rotate in place because there is a potential collision, "
                f'{math.degrees(touched[0] * c.sim_granularity):.0f} deg on'
            )
        if abs(situation.velocity[0]) > self.SLOW_ENOUGH:
            return RecoveryStep(done=False, text=f'{self.name}: coming to rest')
        wanted = min(max(math.sqrt(2.0 * c.acc_lim_theta * left), slowest), c.max_vel_theta)
        self._rate = min(wanted, self._rate + c.acc_lim_theta * situation.dt)
        return RecoveryStep((0.0, self._rate), False, f'{self.name}: {math.degrees(left):.0f} deg to turn')
