"""Which of the robot's variables an input measures, when its sensor is not mounted along the robot's axes.

A list S_config counts along the sensor's own axes, and is turned with its data (measurement.py). An IMU that stands
upright and is to give "vyaw" gives the robot's vroll or vpitch: robot_localization says nothing then, and the robot
drives straight on for ever.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sara_common.diagnostics import ERROR, OK
from sara_localization.checks.findings import Finding
from sara_localization.checks.variables import unmeasured
from sara_localization.config.filter_config import FilterConfig
from sara_localization.filters.state import ACCELERATION, ANGLES, NAMES, RATES, VELOCITY
from sara_localization.geometry.rigid import Transform, quaternion_from_rpy, rotation_matrix

SMALLEST = 1e-6


def turned_mask(mask: Sequence[bool], mounting: Transform, imu: bool) -> tuple[bool, ...]:
    """(15,) which of the robot's variables come out, of a (15,) mask along the axes of a sensor mounted by
    robot_from_sensor.
    """
    turned = np.array(mask, dtype=bool)
    R = rotation_matrix(mounting.rotation)
    blocks = [(VELOCITY, R), (RATES, R), (ACCELERATION, R)]
    if imu:
        blocks.append((ANGLES, rotation_matrix(quaternion_from_rpy(0.0, 0.0, mounting.yaw))))
    for block, matrix in blocks:
        turned[block] = np.sqrt(((matrix * turned[block]) ** 2).sum(axis=1)) >= SMALLEST
    return tuple(turned.tolist())


def check_mountings(config: FilterConfig, mountings: dict[str, Transform]) -> tuple[list[Finding], set[str]]:
    """What the mountings (robot_from_sensor, by input) change, and what is not measured by the turned sensors.

    The second: the keys of check_config's findings that these replace.
    """
    found, inputs = [], []
    for i in config.inputs:
        mask = turned_mask(i.mask, mountings[i.name], i.kind == 'imu') if i.name in mountings else i.mask
        inputs.append(replace(i, mask=mask))
        if mask != i.mask:
            asked, given = (', '.join(name for name, taken in zip(NAMES, flags) if taken) for flags in (i.mask, mask))
            found.append(
                Finding(
                    OK,
                    i.name + '_mounting',
                    f'{i.name}_config counts along the axes of its sensor, which is mounted turned: '
                    f'{asked} there is {given} of the robot.',
                )
            )
    after = unmeasured(replace(config, inputs=tuple(inputs)))
    found += [Finding(ERROR, finding.key, finding.sentence.split(' (Unless')[0]) for finding in after]
    return found, {finding.key for finding in unmeasured(config)}
