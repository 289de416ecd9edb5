"""Missions that are experiments by themselves, driven in lockstep by the whole stack: the thesis's square."""

from collections.abc import Callable

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.lockstep.mission_drive import drive
from sara_bringup.missions.drive import Drive
from sara_bringup.missions.mission import load_mission
from sara_bringup.paths import config_file, share

EXPERIMENTS = {'square': 'square.yaml'}


def run(
    name: str, seed: int, ekf: str = 'default', progress: Callable[[str], None] | None = None, gain: float | None = None
) -> tuple[Drive, Lockstep]:
    """Drive the experiment `name` on the chair `seed`, whose gyro has been calibrated to `gain`, or not; return its
    Drive and the Lockstep it ran on.
    """
    mission = load_mission(config_file(EXPERIMENTS[name]))
    lockstep = Lockstep(share() / 'maps' / 'room.yaml', mission.start, seed, ekf, gain, ranges=False)
    return drive(lockstep, mission, Drive(name, seed, mission.start, ekf), progress), lockstep
