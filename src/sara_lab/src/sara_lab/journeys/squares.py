"""The thesis's square, to the left and to the right, driven by a planner alone (true pose) or by the whole stack (fused
pose), and judged.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.lockstep.mission_drive import drive
from sara_bringup.missions.drive import Drive
from sara_bringup.missions.mission import load_mission
from sara_bringup.paths import config_file, share
from sara_lab.judge.drives import track_of
from sara_lab.judge.judge import judge

if TYPE_CHECKING:
    from sara_lab.judge.judgement import Judgement

MISSIONS = {'left': 'square.yaml', 'right': 'square_right.yaml'}
POSES = {'true': 'fake', 'fused': 'ekf'}  # whose pose is driven by: the lockstep's localization


def square(
    direction: str,
    pose: str,
    seed: int,
    gain: float | None = None,
    navigation: dict | None = None,
    prepare: Callable[[Lockstep], None] | None = None,
) -> tuple[Drive, Judgement]:
    """Drive a square on the chair `seed`; returns (Drive, Judgement), judged by the true pose.

    `direction` of MISSIONS, `pose` of POSES, `gain` of that chair's gyro, `navigation`: a tree laid over sara_nav.yaml;
    `prepare`: called with the Lockstep before it starts.
    """
    mission, room = load_mission(config_file(MISSIONS[direction])), share() / 'maps' / 'room.yaml'
    lockstep = Lockstep(
        room, mission.start, seed, gain=gain, localization=POSES[pose], navigation=navigation, ranges=False
    )
    if prepare is not None:
        prepare(lockstep)
    driven = drive(lockstep, mission, Drive(f'square_{direction}', seed, mission.start))
    return driven, judge(track_of(driven), lockstep.chair.drive.world)
