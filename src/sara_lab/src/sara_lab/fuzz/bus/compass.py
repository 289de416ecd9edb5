"""Random fields, rates, wheels and clocks into the compass: it must not raise, nor say a heading that is none.

Half of the robots are calibrated as robots are, the others at random within what a calibration file may hold. Of each,
a share of the inputs of its own is wild, so that the heading begins before it is attacked.
"""

from __future__ import annotations

import math
import random
from functools import partial

from canserial.calibration.iron import Iron, IronError
from canserial.calibration.turns import Turns
from canserial.reader.compass import Compass
from canserial.reader.compass_config import CompassConfig
from canserial.reader.faults import KINDS
from canserial.reader.heading_filter import ANY_YAW
from canserial.reader.readings import LEFT, RIGHT, ImuReading
from sara_lab.fuzz.blocks import Report

INPUTS_PER_ROBOT, CALM = 500, 160
STRONGEST, FASTEST, HARDEST = 320.0, 4.4, 22.0
"""uT, rad/s, m/s2: what the reader passes on."""
STEPS_OF_TIME = (0.0, 0.01, 0.02, 0.05, 0.05, 0.05, 0.1, 0.5, 3.0, 1e4, -0.02, -5.0, -1e9)
IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def fuzz_compass(count: int, seed: int) -> Report:
    """So many inputs; the same seed gives the same."""
    chance, report = random.Random(seed), Report(inputs=count)
    for first in range(0, count, INPUTS_PER_ROBOT):
        _robot(min(INPUTS_PER_ROBOT, count - first), chance, report)
    return report


def _robot(count, chance, report):
    def drop(kind, _stamp):
        report.kinds[kind] += 1
        if kind not in KINDS:
            report.faults.append(f'{kind} has no sentence')

    compass = Compass(CompassConfig(), _iron(chance), chance.uniform(0.5, 2.0), 1e-4, drop)
    turns, yaw, time, share = Turns(), 0.0, chance.choice((0.0, 1.7e9)), chance.choice((0.0, 0.02, 0.5))
    for number in range(count):
        wild = number > CALM and chance.random() < share
        time = max(time + chance.choice(STEPS_OF_TIME if wild else (0.01, 0.05)), 0.0)
        luck = chance.random()
        if luck < 0.5:
            rates = tuple(chance.uniform(-FASTEST, FASTEST) * (1.0 if wild else 0.02) for _ in range(3))
            yaw += 0.05 * rates[2]
            still = chance.random() < 0.2 if wild else number < CALM
            _rates(compass, (time, rates, still), wild, chance, report)
        elif luck < 0.9:
            field = _field(chance, yaw, wild)
            compass.on_field(time, field)
            turns.add(field, yaw, (0.0, 0.0, chance.uniform(-1.0, 1.0)), compass.efforts)
            report.kinds['fields'] += 1
        else:
            compass.on_wheel(time, chance.choice((RIGHT, LEFT)), chance.randrange(2**32), chance.random() < 0.1)
            report.kinds['wheels'] += 1
    _calibrated(turns, chance, report)


def _iron(chance):
    if chance.random() < 0.5:
        return Iron((0.0, 0.0, 0.0), IDENTITY, 25.7, 37.1, motors=(0.5, -0.5))
    draw = partial(chance.uniform)
    return Iron(
        tuple(draw(-300.0, 300.0) for _ in range(3)),
        tuple(draw(-3.0, 3.0) for _ in range(9)),
        draw(1.0, 70.0),
        draw(-70.0, 70.0),
        tuple(draw(-300.0, 300.0) for _ in range(2)),
        tuple(draw(-0.2, 0.2) for _ in range(2)),
        draw(0.5, 2.0),
        draw(0.0, 180.0),
    )


def _field(chance, yaw, wild):
    """The earth's, nearly, or any."""
    if not wild:
        angle, noise = 0.5 * math.pi - yaw, partial(chance.gauss, 0.0, 0.3)
        return 25.7 * math.cos(angle) + noise(), 25.7 * math.sin(angle) + noise(), -37.1 + noise()
    return tuple(chance.choice((chance.uniform(-STRONGEST, STRONGEST), 0.0, STRONGEST)) for _ in range(3))


def _rates(compass, said, wild, chance, report):
    time, rates, still = said
    accelerations, unseen, frozen = (0.0, 0.0, 9.81), 0.0, False
    if wild:
        accelerations = tuple(chance.uniform(-HARDEST, HARDEST) for _ in range(3))
        unseen, frozen = chance.choice((0.0, 1.0, ANY_YAW)), chance.random() < 0.1
    reading = ImuReading(time, 0.0, 0.0, 0.0, rates, accelerations, unseen, frozen)
    heading = compass.on_imu(reading, still)
    report.kinds['rates'] += 1
    if heading is None:
        return
    report.kinds['headings'] += 1
    numbers = (*heading[1:4], *heading.angular_velocity, heading.yaw_variance)
    if not all(map(math.isfinite, numbers)) or not 0.0 <= heading.yaw_variance <= ANY_YAW + 1e-9:
        report.faults.append(f'{reading} gave {heading}')


def _calibrated(turns, chance, report):
    """What comes of the same fields as a calibration: a plausible one, or a sentence."""
    try:
        found = turns.result(chance.uniform(1.0, 70.0), chance.uniform(-70.0, 70.0), 1.0, None, 1.5)
    except IronError as error:
        report.kinds['refused calibrations'] += 1
        if not str(error):
            report.faults.append('a calibration was refused without a sentence')
    else:
        report.kinds['calibrations'] += 1
        report.faults += found.iron.faults()
