"""calibrate_odometry put to the test: a chair whose track is 28 % off and one of whose wheels is 1.5 % larger drives
UMBmark in the hall.

The whole stack drives it, in lockstep: the manoeuvres are commanded as navigation would, through the safety gate.
"""

import dataclasses
from typing import Any

import numpy as np

from canserial.reader.readings import ImuReading
from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_control.calibration.calibration import Geometry, calibrate, end_errors
from sara_control.calibration.drive_log import DriveLog
from sara_control.calibration.manoeuvres import Manoeuvres

START = (15.0, 4.0, 0.0)
SLIP, RIGHT, LEFT = 1.28, 1.0075, 0.9925  # separation and radii over the nominal ones
WITHIN, TIMES_BETTER = 0.01, 10.0
LONGEST_S = 400.0


class LoggedDrive(Lockstep):
    """A Lockstep that keeps what calibrate_odometry reads from a bag, and the truth at the wheels' stamps."""

    def __init__(self, seed: int) -> None:
        super().__init__(share() / 'maps' / 'hall.yaml', START, seed)
        nominal = self.chair.config.wheel_radius
        drawn = dataclasses.replace(
            self.chair.chair, slip=1.0 / SLIP, right_radius=RIGHT * nominal, left_radius=LEFT * nominal
        )
        self.chair.chair = self.chair.drive.chair = drawn
        self.rates, self.positions, self.truth = [], [], []

    def _on_reading(self, reading):
        super()._on_reading(reading)
        if isinstance(reading, ImuReading):
            self.rates.append((reading.stamp, reading.angular_velocity[2]))
        wheels = self.wheels.positions
        if wheels is not None and (not self.positions or wheels.stamp > self.positions[-1][0]):
            self.positions.append((wheels.stamp, wheels.left, wheels.right))
            self.truth.append(self.chair.pose)


def trial(seed: int) -> dict[str, Any]:
    """{'separation', 'left', 'right': what was found over the truth, less 1; 'before', 'after': return errors, m;
    'contacts', 'faults'} of one chair.
    """
    lockstep = LoggedDrive(seed)
    lockstep.start_up()
    manoeuvres = Manoeuvres()
    lockstep.pilot = lambda now: manoeuvres.step(now, *lockstep.odometry)
    del lockstep.positions[:], lockstep.truth[:]
    while not manoeuvres.done and lockstep.time < LONGEST_S:
        lockstep.step()
    log = DriveLog(*np.array(lockstep.positions).T, *np.array(lockstep.rates).T, np.array(lockstep.truth))
    separation, radius = (
        lockstep.wheels.controller.config.wheel_separation,
        lockstep.wheels.controller.config.wheel_radius,
    )
    found = calibrate(log, separation, radius)
    runs = end_errors(log, Geometry(separation, radius, radius), found.geometry(separation, radius), found.bias)
    result = {
        'seed': seed,
        'separation': found.separation / SLIP - 1.0,
        'left': found.left / LEFT - 1.0,
        'right': found.right / RIGHT - 1.0,
        'before': [run.position_before for run in runs],
        'after': [run.position_after for run in runs],
        'contacts': lockstep.chair.contacts,
    }
    result['faults'] = [
        f'{name} is {100 * result[name]:+.2f} % off, allowed is {100 * WITHIN:g} %'
        for name in ('separation', 'left', 'right')
        if not abs(result[name]) <= WITHIN
    ]
    if not manoeuvres.done:
        result['faults'].append(f'the drive did not end within {LONGEST_S:g} s')
    if result['contacts']:
        result['faults'].append(f'{result["contacts"]} contacts')
    return result
