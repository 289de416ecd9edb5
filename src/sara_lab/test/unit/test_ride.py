"""What the rider feels and where the chair fits through, on the whole stack in lockstep."""

import math

import numpy as np
import pytest
from steady import whole

from sara_bringup.lockstep.lockstep import COMMAND_STEPS, STEP_S, Lockstep
from sara_bringup.lockstep.mission_drive import drive
from sara_bringup.missions.drive import Drive
from sara_bringup.missions.mission import load_mission
from sara_bringup.paths import config_file, share
from sara_common.planar import Pose2D
from sara_common.platforms import chosen
from sara_lab.campaign.hazards import run
from sara_lab.experiments.gains import gain_of
from sara_lab.experiments.missions import EXPERIMENTS
from sara_lab.judge import gaps
from sara_sim.world.obstacles import Obstacle

ACCELERATION, BRAKING, JERK = 0.4, 0.8, 0.8  # the standard profile, m/s2 and m/s3
SMOOTHED_S, MARGIN = 0.5, 1.15
EXACT = 1e-9
JAMB = 1.5
NEAR, SLOWLY = 0.3, 0.6  # m from the body to a wall; m/s


class Felt(Lockstep):
    """A Lockstep that notes the gate's commands and the true speed, m/s, at 50 Hz."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.commanded, self.true = [], []

    def step(self):
        super().step()
        if self.tick % COMMAND_STEPS == 0:
            self.commanded.append(self.wheels.decision.v)
            self.true.append(self.chair.velocity[0])


def rates(speed, smooth=lambda values: values):
    """(speeding up, slowing down, jerk): the largest of each, m/s2 and m/s3; speed and acceleration are each smoothed
    before they are derived.
    """
    dt = COMMAND_STEPS * STEP_S
    speed = smooth(np.asarray(speed))
    acceleration = np.diff(speed) / dt
    toward_zero = np.abs(speed[1:]) < np.abs(speed[:-1])
    return (
        np.abs(acceleration[~toward_zero]).max(),
        np.abs(acceleration[toward_zero]).max(),
        np.abs(np.diff(smooth(acceleration))).max() / dt,
    )


def smoothed(values):
    """The mean over SMOOTHED_S: wheel commands have steps of 16 mm/s, which nobody feels and every derivative shows."""
    width = round(SMOOTHED_S / (COMMAND_STEPS * STEP_S))
    return np.convolve(values, np.ones(width) / width, mode='valid')


@pytest.mark.parametrize('seed', range(whole(3, 1)))
def test_the_square_is_comfortable(seed):
    mission = load_mission(config_file(EXPERIMENTS['square']))
    felt = Felt(share() / 'maps' / 'room.yaml', mission.start, seed)
    drive(felt, mission, Drive('square', seed, mission.start))
    up, down, jerk = rates(felt.commanded)
    assert up <= ACCELERATION + EXACT and down <= BRAKING + EXACT and jerk <= JERK + 1e-6
    up, down, jerk = rates(felt.true, smoothed)
    assert up <= MARGIN * ACCELERATION and down <= MARGIN * BRAKING and jerk <= MARGIN * JERK
    assert up > 0.5 * ACCELERATION  # it was a drive


@pytest.mark.parametrize('scan', [False, True])
@pytest.mark.parametrize('seed', range(whole(3, 1)))
def test_walls_that_the_map_does_not_show_are_passed_slowly(seed, scan, tmp_path):
    gain = gain_of(seed, tmp_path)
    lockstep = Lockstep(share() / 'maps' / 'hall.yaml', (1.0, 4.0, 0.0), seed, gain=gain, scan=scan)
    lockstep.start_up()
    chair = lockstep.chair
    for name, side in (('left', 1), ('right', -1)):
        chair.world.obstacles.add(Obstacle(name, size=(0.1, JAMB), at=(5.0, 4.0 + side * (0.4 + 0.5 * JAMB)), yaw=0.0))
    lockstep.move_base.set_goal(Pose2D(8.0, 4.0, 0.0), lockstep.time)
    beside, end = [], lockstep.time + 60.0
    while lockstep.result is None and lockstep.time < end:
        run(lockstep, 0.1)
        if abs(chair.pose[0] - 5.0) < 1.0 and gaps.at(chair.world, chair.pose, chosen().size) < NEAR:
            beside.append(abs(chair.velocity[0]))
    assert lockstep.result.text == 'Goal reached.' and chair.contacts == 0
    assert max(beside, default=0.0) < SLOWLY
    assert math.dist(chair.pose[:2], (8.0, 4.0)) < 0.1
