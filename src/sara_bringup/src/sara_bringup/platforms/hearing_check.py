"""Where the range sensors leave a gap between their cones, just before or behind a robot."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sara_bringup.platforms.gate_settings import safety_of
from sara_common.planar import wrap
from sara_common.platforms import Platform

STEP, FARTHEST = 0.01, 1.0  # m: of the places that are tried, and how far off
WORTH_A_WORD = 0.2  # m: nearer gaps are within what the safety gate keeps free


def remarks(platform: Platform) -> Iterator[str]:
    """A sentence for each end of the body before which there is such a gap, and how far it reaches. That is no mistake:
    most robots have one, and move_base remembers what stood there.
    """
    safety = safety_of(platform)
    if safety is None:
        return
    zones, (length, width) = safety.zones, platform.size
    across = round(0.5 * width / STEP)
    away, aside = np.meshgrid(
        np.arange(0.0, FARTHEST + STEP, STEP), np.linspace(-0.5 * width, 0.5 * width, 2 * across + 1)
    )
    for end, sign in (('ahead', 1.0), ('astern', -1.0)):
        x = sign * (0.5 * length + away)
        heard = np.zeros(x.shape, bool)
        for sensor in zones.sensors:
            bearing = np.arctan2(aside - sensor.y, x - sensor.x)
            heard |= np.abs(wrap(bearing - sensor.yaw)) <= 0.5 * zones.field_of_view
        gap = float(away[~heard].max(initial=0.0))
        if gap > WORTH_A_WORD:
            yield f'{end}, up to {gap:.2f} m off, is a gap between the cones of the range sensors'
