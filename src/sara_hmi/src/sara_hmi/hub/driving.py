"""Who drives and what: sessions and freshness together. Every method returns the actions that it causes."""

from __future__ import annotations

from sara_hmi.config.config import HmiConfig
from sara_hmi.freshness.freshness import Freshness
from sara_hmi.hub.actions import Action, Everyone, Motion, Send, error
from sara_hmi.protocol.frames import Frame
from sara_hmi.sessions.sessions import Asked, DriverChanged, Session, Sessions

NOT_DRIVER, STOPPED, UNHEARD = 'error.drive_not_driver', 'error.drive_stopped', 'error.drive_unheard'


class Driving:
    """`stopped`: the emergency stop was pressed on a page; nothing is driven until it is released. `obeyed`: whether
    somebody takes the commands.
    """

    def __init__(self, config: HmiConfig) -> None:
        self._config = config
        self.sessions = Sessions(config.sessions)
        self._fresh: Freshness | None = None
        self._next_beat = 1
        self.stopped, self.obeyed = False, True

    @property
    def driver(self) -> int | None:
        """The driver's session."""
        return self.sessions.driver

    @property
    def moving(self) -> bool:
        """Whether the driver moves the robot."""
        return self._fresh is not None and self._fresh.moving

    def join(self, session: Session) -> list[Action]:
        """A session begins or has another role."""
        return self._heed(self.sessions.join(session), 'hello')

    def leave(self, number: int) -> list[Action]:
        """A session ends; where it drove, that is one zero."""
        return self._heed(self.sessions.leave(number), '')

    def take(self, t: float, number: int) -> list[Action]:
        """It wants to drive."""
        return self._heed(self.sessions.take(t, number), 'take')

    def release(self, number: int) -> list[Action]:
        """It does not want to drive any more."""
        return self._heed(self.sessions.release(number), 'release')

    def answer(self, number: int, frame: Frame) -> list[Action]:
        """The driver grants or refuses."""
        decide = self.sessions.grant if frame.op == 'grant' else self.sessions.refuse
        return self._heed(decide(number, frame.get('session')), frame.op)

    def drive(self, t: float, number: int, frame: Frame) -> list[Action]:
        """A command."""
        if number != self.driver:
            return [_ack(number, frame, NOT_DRIVER)]
        if self.stopped:
            return [_ack(number, frame, STOPPED)]
        if not self.obeyed:
            return [_ack(number, frame, UNHEARD)]
        motion, why = self._fresh.drive(t, frame.get('seq'), frame.get('n'), (frame.get('v'), frame.get('w')))
        actions: list[Action] = [] if motion is None else [Motion(*motion)]
        if not why and self.moving:
            self.sessions.drove()
        return [*actions, _ack(number, frame, why)]

    def halt(self, number: int, frame: Frame) -> list[Action]:
        """The finger is lifted."""
        if number != self.driver:
            return [_ack(number, frame, NOT_DRIVER)]
        return [*_motion(self._fresh.halt(frame.get('seq'))), _ack(number, frame, '')]

    def stop(self) -> list[Action]:
        """The emergency stop: nothing is driven from now on."""
        self.stopped = True
        return _motion(self._fresh.stop()) if self._fresh else []

    def step(self, t: float) -> list[Action]:
        """What is due at t (s): beats, repetitions, the end of what is not fresh any more, the end of a question."""
        actions = self._heed(self.sessions.step(t), 'take')
        if self._fresh is None:
            return actions
        actions += _motion(self._fresh.step(t))
        beat = self._fresh.beat(t)
        if beat is not None:
            actions.append(Send(self.driver, {'op': 'beat', 'n': beat}))
        return actions

    def due(self, t: float) -> float:
        """When `step` is to be called next (s); a question's end waits for a second."""
        return min(t + 1.0, self._fresh.due(t)) if self._fresh else t + 1.0

    def frame(self) -> dict:
        """Who drives, as a frame."""
        session = self.sessions.members.get(self.driver)
        return {'op': 'driver', 'session': self.driver, 'name': session.name if session else ''}

    def _heed(self, events, of):
        actions: list[Action] = []
        for event in events:
            if isinstance(event, DriverChanged):
                actions += self._change(event.new)
            elif isinstance(event, Asked):
                name = self.sessions.members[event.by].name
                asked = {'op': 'asked', 'session': event.by, 'name': name, 'seconds': event.seconds}
                actions.append(Send(event.driver, asked))
            else:
                actions.append(error(event.session, event.key, of))
        return actions

    def _change(self, new):
        """Another driver begins at rest, with beats whose numbers nobody has had before."""
        actions: list[Action] = []
        if self._fresh is not None:
            actions += _motion(self._fresh.stop())
            self._next_beat = self._fresh.next_beat
        self._fresh = None if new is None else Freshness(self._config.freshness, self._next_beat)
        return [*actions, Everyone(self.frame())]


def _motion(motion: tuple[float, float] | None) -> list[Action]:
    return [] if motion is None else [Motion(*motion)]


def _ack(number: int, frame: Frame, why: str) -> Send:
    answer = {'op': 'ack', 'seq': frame.get('seq'), 't': frame.get('t', 0), 'ok': not why}
    return Send(number, {**answer, 'why': why} if why else answer)
