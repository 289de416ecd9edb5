"""One goal of the page at a time; it can be paused, which cancels it at move_base and remembers it."""

from __future__ import annotations

from typing import NamedTuple

GOING, PAUSED = 'going', 'paused'
NO_GOAL, NOT_PAUSED, NOT_GOING = 'error.no_goal', 'error.not_paused', 'error.not_going'
Pose = tuple[float, float, float]


class Send(NamedTuple):
    """A goal to send to move_base; number: which one it is, for `ended`."""

    number: int
    pose: Pose


class Cancel(NamedTuple):
    """What was sent is to be cancelled."""

    number: int


class Goal(NamedTuple):
    """place: its name, "" for a pose."""

    place: str
    pose: Pose


class Mission:
    """`goal` is None where there is none; `state` is going or paused."""

    def __init__(self) -> None:
        self.goal: Goal | None = None
        self.state = ''
        self._number = 0

    def go(self, place: str, pose: Pose) -> list[Send | Cancel]:
        """A new goal, instead of any other."""
        self.goal, self.state = Goal(place, pose), GOING
        self._number += 1
        return [Send(self._number, pose)]

    def pause(self) -> tuple[list[Send | Cancel], str]:
        """(what to do, why it cannot be done or "")."""
        if self.state != GOING:
            return [], NOT_GOING
        self.state = PAUSED
        return [self._void()], ''

    def resume(self) -> tuple[list[Send | Cancel], str]:
        """(what to do, why it cannot be done or "")."""
        if self.state != PAUSED:
            return [], NOT_PAUSED
        return self.go(*self.goal), ''

    def cancel(self) -> tuple[list[Send | Cancel], str]:
        """(what to do, why it cannot be done or "")."""
        if self.goal is None:
            return [], NO_GOAL
        was_going = self.state == GOING
        self.goal, self.state = None, ''
        return ([self._void()] if was_going else []), ''

    def ended(self, number: int) -> Goal | None:
        """move_base says that a goal has ended: which Goal it was, or None where it is not the present one."""
        if number != self._number or self.state != GOING:
            return None
        goal, self.goal, self.state = self.goal, None, ''
        return goal

    def _void(self):
        """Cancel what was sent last; what is said of it from now on is not heard."""
        number, self._number = self._number, self._number + 1
        return Cancel(number)
