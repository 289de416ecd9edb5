"""Drives of the simulated chair as of somebody who draws a map, recorded as a map builder with the nine ultrasonic
sensors alone hears them: dead reckoning of an uncalibrated chair, and ranges.

move_base drives by the true pose and the true map, as somebody would who knows where they are: each time to where the
sensors hear most walls that they have not heard, and back to the start when all are.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from sara_bringup.lockstep.localization import Filter
from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.planar import Pose2D
from sara_lab.journeys.travel_cases import grid_of, map_file, random_of, roomy_pose
from sara_lab.studies.map_drives import Guided
from sara_lab.studies.sonar_survey import EVERYWHERE, FINISHING, Survey
from sara_lab.studies.wandering import Ear, Recording, kept_recording
from sara_sim.world.world import World

MAPS = ('room', 'doorway', 'flat', 'school')
LIMIT_S, LEG_S, STOP_S = 1195.0, 60.0, 2.0
"""Of a drive, of the way to a place, and until the chair stands when it is given up."""
WHOLE_S = 3600.0
"""Limit of a drive that is to lead everywhere: one with more time than LIMIT_S goes into every room before it finishes
one.
"""


def record(name: str, number: int, limit: float = LIMIT_S) -> Recording:
    """Drive `number` on a map, s long at most: the seed of chair, start and way."""
    world = World.from_yaml(map_file(name))
    start = roomy_pose(grid_of(name), world, random_of(name, 'map', number))
    lockstep = Lockstep(map_file(name), start, number, localization='fake')
    reckoned = Filter(start, 'ekf', 'default', lockstep.reader.config.variances)
    ear = Ear(reckoned, lockstep.chair)
    lockstep.localization = Guided(lockstep.localization, ear)
    lockstep.start_up()
    way = 0.0
    survey = Survey(grid_of(name), EVERYWHERE if limit > LIMIT_S else FINISHING)
    while lockstep.time < limit:
        stop = survey.next_stop(lockstep.chair.pose, limit - lockstep.time)
        if stop is None:
            break
        lockstep.result, end = None, min(lockstep.time + LEG_S, limit)
        lockstep.move_base.set_goal(Pose2D(*stop), lockstep.time)
        while lockstep.result is None and lockstep.time < end + STOP_S:
            if lockstep.time > end:
                lockstep.move_base.cancel(lockstep.time, f'not there after {LEG_S:.0f} s')
            before = lockstep.chair.pose
            lockstep.step()
            survey.hear(lockstep.chair.pose)
            way += math.dist(before[:2], lockstep.chair.pose[:2])
    return Recording(np.array(ear.poses), np.array(ear.ranges), tuple(ear.sensors), way)


def kept(name: str, number: int, folder: Path, limit: float = LIMIT_S) -> Recording:
    """As `record`; made once and kept in a folder of drives with that limit."""
    return kept_recording(folder / f'sonar_{name}_{number}.npz', lambda: record(name, number, limit))
