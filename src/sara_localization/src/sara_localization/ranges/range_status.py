"""What range_localization says of itself in /diagnostics, as plain data."""

from __future__ import annotations

import math
from typing import NamedTuple

from sara_common.diagnostics import ERROR, OK, WARN, Status, new_faults
from sara_localization.ranges.range_correction import FAULTS, RangeCorrection

SILENT_AFTER = 5.0
"""s without a range, or without dead reckoning, until that is told."""
LOST_SIGMA = 0.3
"""m of standard deviation from which on the estimate is of little use."""


class Heard(NamedTuple):
    """When the last pose and the last range came (s), None before the first; the sentence about a transform that is not
    there; while the place is searched for, the sentence how far that has come; the probability that the pose is wrong.
    """

    last_pose: float | None = None
    last_range: float | None = None
    missing: str = ''
    searching: str = ''
    lost: float = 0.0


def status(
    name: str, correction: RangeCorrection, now: float, heard: Heard, before: dict[str, int] | None = None
) -> Status:
    """The node's status at a time (s); `before`: the counts of the last time, for faults are told when they are new."""
    last_pose, last_range, missing, searching, lost = heard
    counts, (place, yaw) = correction.counts, correction.sigma
    faults = new_faults(counts, before or {}, (what for what in FAULTS if what != 'no_map'))
    level, message = OK, f'the pose is corrected by {counts["used"]} ranges'
    if correction.map is None:
        level, message = ERROR, 'waiting for the map'
    elif last_pose is None or now - last_pose > SILENT_AFTER:
        level, message = ERROR, 'waiting for dead reckoning on odom'
    elif missing:
        level, message = ERROR, missing
    elif last_range is None or now - last_range > SILENT_AFTER:
        what = 'the place is not found' if searching else 'the pose is dead reckoning'
        level, message = WARN, f'no range has come for {SILENT_AFTER:g} s or more: {what}'
    elif searching:
        level, message = WARN, searching
    elif place > LOST_SIGMA:
        level, message = WARN, f'the pose is uncertain by {place:.2f} m: no wall of the map was heard for long'
    elif faults:
        level, message = WARN, faults
    x, y, turn = correction.offset
    values: tuple[tuple[str, str], ...] = tuple((what, str(count)) for what, count in sorted(counts.items())) + (
        ('sigma (m)', f'{place:.3f}'),
        ('sigma (deg)', f'{math.degrees(yaw):.2f}'),
        ('correction (m, m, deg)', f'{x:.3f} {y:.3f} {math.degrees(turn):.2f}'),
        ('probability of being lost', f'{lost:.3f}'),
        ('scale of turns', f'{correction.scale:.4f} +- {correction.turn_scale.sigma:.4f}'),
    )
    return Status(name, level, message, values)
