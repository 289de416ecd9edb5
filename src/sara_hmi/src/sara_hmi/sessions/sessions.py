"""Sessions and the one driver among them.

A rider or a carer takes the driving where nobody has it. Where somebody has it, that driver is asked: the driver grants
or refuses. A driver who neither answers nor drives within `ask_s` is taken to be away, and the one who asked drives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from sara_hmi.config.config import CARER, RIDER, SessionsConfig

TAKE_REFUSED, TAKE_PENDING, NOT_DRIVER = 'error.take_refused', 'error.take_pending', 'error.not_driver'
NOT_ASKED, MAY_NOT = 'error.not_asked', 'error.may_not'


@dataclass(frozen=True)
class Session:
    """role: look, carer or rider. name: as its owner wishes to be shown, "" for none."""

    number: int
    role: str
    name: str = ''


class DriverChanged(NamedTuple):
    """Sessions' numbers, None for nobody."""

    old: int | None
    new: int | None


class Asked(NamedTuple):
    """`driver` is asked by `by` and has so many seconds."""

    driver: int
    by: int
    seconds: float


class Refused(NamedTuple):
    """What `session` wished is not done; key: why."""

    session: int
    key: str


class Ask(NamedTuple):
    """Who asks, and until when (s) it is waited for an answer."""

    by: int
    until: float


Event = DriverChanged | Asked | Refused


class Sessions:
    """All sessions. Every method returns the list of events that it causes."""

    def __init__(self, config: SessionsConfig) -> None:
        self._config = config
        self.members: dict[int, Session] = {}
        self.driver: int | None = None
        self._ask: Ask | None = None
        self._drove = False

    @property
    def asking(self) -> int | None:
        """The session that waits for the driver's answer."""
        return None if self._ask is None else self._ask.by

    def join(self, session: Session) -> list[Event]:
        """A session begins, or has another role; one that may not drive any more does not drive any more."""
        events = []
        if session.number in self.members and session.role not in (CARER, RIDER):
            events = self.leave(session.number)
        self.members[session.number] = session
        return events

    def leave(self, number: int) -> list[Event]:
        """A session ends."""
        self.members.pop(number, None)
        if self.asking == number:
            self._ask = None
        return self._pass_on() if self.driver == number else []

    def take(self, t: float, number: int) -> list[Event]:
        """A session wants to drive, at t (s)."""
        if self.members[number].role not in (CARER, RIDER):
            return [Refused(number, MAY_NOT)]
        if self.driver == number:
            return []
        if self.driver is None:
            return self._drive(number)
        if self._ask is not None:
            return [] if self._ask.by == number else [Refused(number, TAKE_PENDING)]
        self._ask, self._drove = Ask(number, t + self._config.ask_s), False
        return [Asked(self.driver, number, self._config.ask_s)]

    def release(self, number: int) -> list[Event]:
        """A session does not want to drive, or to ask for it, any more."""
        if self.asking == number:
            self._ask = None
        return self._pass_on() if self.driver == number else []

    def grant(self, number: int, to: int) -> list[Event]:
        """The driver lets the one who asked drive."""
        return self._answer(number, to) or self._pass_on()

    def refuse(self, number: int, to: int) -> list[Event]:
        """The driver does not."""
        refused = self._answer(number, to)
        if not refused:
            self._ask = None
            refused = [Refused(to, TAKE_REFUSED)]
        return refused

    def drove(self) -> None:
        """The driver has commanded a motion, so is there."""
        self._drove = True

    def step(self, t: float) -> list[Event]:
        """The time for an answer may be over at t (s)."""
        if self._ask is None or t < self._ask.until:
            return []
        if not self._drove:
            return self._pass_on()
        by, self._ask = self._ask.by, None
        return [Refused(by, TAKE_REFUSED)]

    def _answer(self, number, to):
        """What is wrong with an answer of `number` to `to`."""
        if self.driver != number:
            return [Refused(number, NOT_DRIVER)]
        return [] if self.asking == to else [Refused(number, NOT_ASKED)]

    def _pass_on(self):
        """The driver drives no longer: who asked does, or nobody."""
        asking, self._ask = self.asking, None
        return self._drive(asking)

    def _drive(self, number):
        old, self.driver = self.driver, number
        return [DriverChanged(old, number)]
