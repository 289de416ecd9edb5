"""What a drive of the whole stack in lockstep was like, kept while it is made: for a picture, or a bag."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.planar import compose, inverse
from sara_lab.campaign.fingerprints import watched
from sara_lab.experiments import drive_figures
from sara_nav.goals.move_base_config import ACTIVE, SUCCEEDED
from sara_sim.world.world import World

EVERY_STEPS = 5  # 20 Hz
Pose = tuple[float, float, float]


class RecordingError(ValueError):
    """There is nothing to show of a drive."""


class Sample(NamedTuple):
    """The chair at a time `t` (s). `true`, `velocity` (m/s, rad/s): of the simulator. `fused`: in the map, None before
    it is known. `map_from_odom`, `odometry`: poses (x, y, yaw; m, rad). `asked`: by the navigation (v, w), None without
    a goal. `passed`: by the safety gate. `contacts`: until then.
    """

    t: float
    true: Pose
    velocity: tuple[float, float]
    fused: Pose | None
    map_from_odom: Pose | None
    odometry: Pose
    asked: tuple[float, float] | None
    passed: tuple[float, float] | None
    contacts: int


@dataclass
class Recording:
    """A drive: Samples, goals (s, pose in the map), their ends (s, reached, in words), and the World."""

    world: World
    samples: list[Sample] = field(default_factory=list)
    goals: list[tuple[float, Pose]] = field(default_factory=list)
    ends: list[tuple[float, bool, str]] = field(default_factory=list)

    def draw(self, path: Path, title: str) -> None:
        """Write a PNG: the true, the fused and the wheels' path on the map, with the goals."""
        origin = compose(self.samples[0].true, inverse(self.samples[0].odometry))
        unknown = (math.nan,) * 3
        trace = {
            'true': np.array([sample.true for sample in self.samples]),
            'fused': np.array([sample.fused or unknown for sample in self.samples]),
            'wheels': np.array([compose(origin, sample.odometry) for sample in self.samples]),
        }
        goals = [(x, y, math.degrees(yaw)) for _, (x, y, yaw) in self.goals]
        walls = self.world.occupied, self.world.resolution, self.world.origin
        drive_figures.path(path, {title: trace}, goals, self.samples[0].true, walls)


def recorded(make: Callable[[], Any]) -> tuple[Any, Recording | None]:
    """(what `make` gives, the Recording of the Lockstep that it began last; None where it began none)."""
    kept: dict[str, Any] = {'lockstep': None, 'recording': None}

    def on_step(lockstep):
        if lockstep is not kept['lockstep']:
            kept.update(lockstep=lockstep, recording=Recording(lockstep.chair.world), goal=None, result=None)
        _keep(kept, lockstep)

    with watched(on_step):
        made = make()
    return made, kept['recording']


def _keep(kept, lockstep):
    """A sample where it is time for one, goals and ends as they are new."""
    recording, goal, result = kept['recording'], lockstep.move_base.goal, lockstep.result
    if goal is not None and goal is not kept['goal']:
        recording.goals.append((lockstep.time, tuple(goal)))
    if result is not None and result is not kept['result']:
        recording.ends.append((lockstep.time, result.status == SUCCEEDED, result.text))
    kept.update(goal=goal, result=result)
    if lockstep.tick % EVERY_STEPS == 0:
        recording.samples.append(_sample(lockstep))


def _sample(lockstep: Lockstep) -> Sample:
    newest, decision, chair = lockstep.newest, lockstep.wheels.decision, lockstep.chair
    return Sample(
        lockstep.time,
        tuple(chair.pose),
        tuple(chair.velocity[:2]),
        lockstep.fused and tuple(lockstep.fused),
        lockstep.localization.map_from_odom and tuple(lockstep.localization.map_from_odom),
        tuple(lockstep.odometry),
        tuple(newest.command) if newest is not None and newest.status == ACTIVE else None,
        (decision.v, decision.w) if decision is not None else None,
        chair.contacts,
    )
