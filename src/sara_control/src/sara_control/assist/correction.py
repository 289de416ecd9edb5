"""What shared control does otherwise than asked, for its rider: one sentence each."""

from __future__ import annotations

import enum


class Correction(enum.Enum):
    """What is done otherwise than asked, or why nothing is, as a sentence for the rider."""

    LEFT = 'The chair steers to the left to keep clear.'
    RIGHT = 'The chair steers to the right to keep clear.'
    SLOWER = 'The chair goes slower because room is short.'
    CALMER = 'The chair does not follow how the stick trembles because room is short.'
    VEERS = 'The chair drives on as it turns because room is short.'
    STOPS = 'The chair does not go that way because there is no room.'
    OVERRIDE = 'The chair does not help: the rider wants to go alone.'
    INSISTED = 'The chair does not help until the stick is let go: the rider insists on this way.'
    OFF = 'The chair does not help: its help is switched off.'
    UNKNOWN = 'The chair does not help: it does not know what is around it.'


_HELPS = 'The chair follows the rider.'


def sentence(correction: Correction | None) -> str:
    """The sentence for a Correction; None: there is none."""
    return _HELPS if correction is None else correction.value
