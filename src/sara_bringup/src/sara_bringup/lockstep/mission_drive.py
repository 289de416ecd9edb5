"""A mission's goals driven in lockstep, one after the other, and recorded."""

from __future__ import annotations

import gc
import math
from collections.abc import Callable
from contextlib import contextmanager
from typing import TYPE_CHECKING

from sara_bringup.lockstep.lockstep import FILTER_STEPS, Lockstep
from sara_common.planar import Pose2D
from sara_nav.goals.move_base_config import SUCCEEDED
from sara_sim.chair import STEP_S

if TYPE_CHECKING:
    from sara_bringup.missions.drive import Drive
    from sara_bringup.missions.mission import Mission


def drive(lockstep: Lockstep, mission: Mission, record: Drive, progress: Callable[[str], None] | None = None) -> None:
    """Drive a mission's goals and fill `record` (drive.Drive); `progress`, if given, is called with a sentence per
    corner.
    """
    with _no_collections():
        return _drive(lockstep, mission, record, progress)


@contextmanager
def _no_collections():
    """What a drive leaves is not in cycles: the garbage collector would look for some, and find none, a dozen times."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def _drive(lockstep, mission, record, progress):
    settle = round(1.0 / STEP_S)
    lockstep.start_up()

    def step():
        lockstep.step()
        if lockstep.tick % FILTER_STEPS == 0:
            record.add_sample(lockstep.time, lockstep.chair.pose, lockstep.fused, lockstep.odometry)

    for number, pose in enumerate(mission.goals, 1):
        lockstep.result, given = None, lockstep.time
        lockstep.move_base.set_goal(Pose2D(*pose), given)
        end = given + mission.leg_timeout_s
        while lockstep.result is None:
            if lockstep.time > end:
                lockstep.move_base.cancel(lockstep.time, f'not there after {mission.leg_timeout_s:.0f} s')
            step()
        ended = lockstep.time
        for _ in range(settle):
            step()
        record.add_corner(pose, lockstep.result.status == SUCCEEDED, lockstep.result.text, given, ended)
        corner = record.corners[-1]
        if progress:
            progress(
                f'corner {number} of {len(mission.goals)}: '
                f'{"reached" if corner.reached else "NOT reached: " + corner.text}, true pose '
                f'{corner.position_error():.3f} m and {math.degrees(corner.yaw_error()):+.2f} deg off, '
                f'{lockstep.time:.0f} s'
            )
    record.contacts = lockstep.chair.contacts
    return record
