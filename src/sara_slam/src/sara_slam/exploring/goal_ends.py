"""What move_base's words tell of why a goal was not reached."""

from __future__ import annotations

from sara_control.gate import reasons
from sara_nav.goals.goal import BY_CONTROL, BY_OSCILLATION, BY_PLANNING, BY_STUCK

ABORTED = 'Goal aborted: '
OF_THE_GOAL = tuple(text.split('.')[0] for text in (BY_PLANNING, BY_CONTROL, BY_OSCILLATION, BY_STUCK)) + (
    'Goal refused',
    f'{ABORTED}{reasons.sentence(reasons.State.BLOCKED, reasons.Reason.CROWD)}',
)


def is_out_of_reach(text: str) -> bool:
    """Whether the goal cannot be reached; else something is wrong with the robot."""
    return text.startswith(OF_THE_GOAL)


def is_stop(text: str) -> bool:
    """Whether the safety gate has stopped the robot until somebody lets it go on."""
    return text.removeprefix(ABORTED) in reasons.STOPS
