"""Random fields, rates, wheels and clocks into the compass: it must not raise, nor say a heading that is none.

Half of the robots are calibrated as robots are, the others at random within what a calibration file may hold. Of each,
a share of the inputs of its own is wild, so that the heading begins before it is attacked. With each, another one turns
on the spot to either side: if none of its fields is wild, the calibration must be right; otherwise it is plausible, or
refused in words.
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
EARTH, MOST_OFF = (25.7, 37.1), math.radians(2.0)
"""uT, horizontal and down; rad within which a calibrated compass tells its heading."""
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
    yaw, time, share = 0.0, chance.choice((0.0, 1.7e9)), chance.choice((0.0, 0.02, 0.5))
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
            compass.on_field(time, _field(chance, yaw, wild))
            report.kinds['fields'] += 1
        else:
            compass.on_wheel(time, chance.choice((RIGHT, LEFT)), chance.randrange(2**32), chance.random() < 0.1)
            report.kinds['wheels'] += 1
    _calibrated(chance, report)


def _iron(chance):
    if chance.random() < 0.5:
        return Iron((0.0, 0.0, 0.0), IDENTITY, *EARTH, motors=(0.5, -0.5))
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
        return EARTH[0] * math.cos(angle) + noise(), EARTH[0] * math.sin(angle) + noise(), -EARTH[1] + noise()
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


class _Turner:
    """A robot with iron of its own that turns on the spot; share: of its fields that are wild."""

    def __init__(self, chance, share):
        self.turns, self._chance, self._share = Turns(), chance, share
        stretch, skew = chance.uniform(0.85, 1.15), chance.uniform(-0.05, 0.05)
        self._soft = (stretch, skew), (skew, 2.0 - stretch)
        self._hard = tuple(chance.uniform(-50.0, 50.0) for _ in range(3))
        self._motors = tuple(chance.uniform(-2.0, 2.0) for _ in range(2))

    def measured(self, yaw, side=0):
        """The field (uT) at a yaw (rad) while the robot turns to that side."""
        across, along = EARTH[0] * math.sin(yaw), EARTH[0] * math.cos(yaw)
        x, y = (row[0] * across + row[1] * along + side * m for row, m in zip(self._soft, self._motors))
        return x + self._hard[0], y + self._hard[1], self._hard[2] - EARTH[1]

    def turn(self, side, whole):
        """A turn, or a part of one."""
        chance, count = self._chance, self._chance.randint(60, 160)
        for number in range(count):
            done = number / count
            yaw = whole * math.tau * (done if side > 0 else 1.0 - done)
            wild = chance.random() < self._share
            field = (
                _field(chance, yaw, True) if wild else [v + chance.gauss(0.0, 0.3) for v in self.measured(yaw, side)]
            )
            angle = chance.uniform(-1e9, 1e9) if wild and chance.random() < 0.1 else yaw
            self.turns.add(tuple(field), angle, (0.0, 0.0, 0.6 * side), (0.3 * side, -0.3 * side))


def _calibrated(chance, report):
    """What two turns give as a calibration: the right one, a plausible one, or a sentence."""
    share, whole = chance.choice((0.0, 0.0, 0.005, 0.1, 1.0)), chance.choice((1.05, 1.05, 1.05, 0.9))
    robot, earth = _Turner(chance, share), EARTH
    for side in (1, -1):
        robot.turn(side, whole)
    if chance.random() < 0.2:
        earth = chance.uniform(1.0, 70.0), chance.uniform(-70.0, 70.0)
    honest = not share and whole > 1.0 and earth == EARTH
    try:
        found = robot.turns.result(*earth, 1.0, 0.0, 0.5 * math.pi)
    except IronError as error:
        report.kinds['refused calibrations'] += 1
        if honest or not str(error):
            report.faults.append(f'a calibration was refused: {error}')
        return
    report.kinds['calibrations'] += 1
    report.faults += found.iron.faults()
    if honest:
        report.kinds['right calibrations'] += 1
        yaw = chance.uniform(-math.pi, math.pi)
        x, y, _ = found.iron.corrected(robot.measured(yaw))
        off = math.remainder(0.5 * math.pi - math.atan2(y, x) - yaw, math.tau)
        if abs(off) > MOST_OFF:
            report.faults.append(f'{math.degrees(off):.1f} deg off at {yaw} by {found}')
