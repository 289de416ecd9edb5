"""The probability that the pose of range_localization is wrong, from how well what the sensors hear agrees with the map
there.

RangeCorrection cannot tell: what does not fit its pose it takes for people and boxes, and the covariance stays small.
As in lost.py, each reading agrees with the map, is shorter, or comes from behind a wall; or nothing is heard of a wall
that the beam meets squarely. People cause the second kind. What stands elsewhere than on the map causes all, but on a
part of the way only. So the readings of the last STEPS steps are judged together, by the Dirichlet-multinomial
distributions of their counts at right and at wrong poses.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from sara_localization.particles.lost import Agreement, Dirichlet, log_ratio
from sara_localization.ranges import map_echo
from sara_localization.ranges.map_echo import Cone
from sara_localization.ranges.range_correction import RangeCorrection
from sara_localization.ranges.range_data import RangeData

NEAR, TURNED = 0.35, math.radians(15.0)
"""m, rad from the robot from which on a pose is wrong: somewhat more than max_innovation corrects."""
TOLERANCE = 0.15
"""m by which a reading that agrees may be off."""
STEPS = 5
"""Steps, of search_min_d or search_min_a each, that are judged together."""
AGREES, SILENT, SHORT, LONG = range(4)
"""What a reading does, in the order of Agreement; `behind` counts walls of which nothing is heard."""


class RangeLaw(NamedTuple):
    """found, lost: the distributions of readings at right and at wrong poses. prior: probability of a wrong pose."""

    found: Dirichlet
    lost: Dirichlet
    prior: float


LAW = RangeLaw((0.629, 0.0183, 0.0575, 0.0522), (0.177, 0.3, 0.613, 0.473), 0.02)
"""What `rosrun sara_lab fit_range_lost` finds: simulated drives of 25 m in a flat, a school and a hall, alone, among
boxes that the map lacks and among pedestrians, by maps with and without boxes that are gone. The prior is chosen.
"""


class RangeLost:
    """Judges the pose of a RangeCorrection. `probability`: that it is wrong, 0 to 1; `agreement`: the newest step's,
    None before the first.
    """

    def __init__(self, correction: RangeCorrection, law: RangeLaw = LAW):
        self._correction, self._law = correction, law
        self.start()

    def start(self) -> None:
        """The pose is another one, which nothing speaks against yet."""
        self.probability, self.agreement = self._law.prior, None
        self._steps: deque[Agreement] = deque(maxlen=STEPS)
        self._last, self._newest = None, {}

    def on_range(self, reading: RangeData) -> None:
        """Take a reading. Wherever the robot has moved on by a step, the newest of each sensor count."""
        correction, c = self._correction, self._correction.config
        if correction.fault(reading):
            return
        here, now = correction.at(reading.stamp - c.range_delay), correction.dead_reckoned
        if here is None:
            return
        self._last = self._last or now
        self._newest[reading.name] = here, reading
        if c.has_moved(self._last, now):
            newest, self._last, self._newest = self._newest, now, {}
            self._judge(newest.values())

    def _judge(self, readings):
        counts = [0, 0, 0, 0]
        for here, reading in readings:
            what = self._compared(here, reading)
            if what is not None:
                counts[what] += 1
        if not any(counts):
            return
        self.agreement = Agreement(*counts)
        self._steps.append(self.agreement)
        found, lost, prior = self._law
        log_odds = math.log(prior / (1.0 - prior)) + log_ratio(Agreement(*map(sum, zip(*self._steps))), found, lost)
        self.probability = 1.0 / (1.0 + math.exp(-log_odds))

    def _compared(self, here, r):
        """What a reading does; None where the map does not say what is to be heard."""
        c, m = self._correction.config, self._correction.map
        limit = min(c.range_max_range, r.most)
        if r.range < max(c.range_min_range, r.least):
            return None
        cone = Cone(0.5 * r.field_of_view, limit + TOLERANCE, c.plane_tolerance)
        what, distance, _ = map_echo.echo(m.cells, m.resolution, self._correction.sensor_in_grid(here, r.mount), cone)
        if what == map_echo.AMBIGUOUS:
            return None
        if r.range > limit:
            return SILENT if what == map_echo.PLANE and distance < limit - TOLERANCE else None
        if what == map_echo.SILENT or r.range < distance - TOLERANCE:
            return SHORT
        return AGREES if r.range <= distance + TOLERANCE else LONG
