"""What the chair does and why, for its rider: one sentence each."""

import enum


class State(enum.Enum):
    """What the safety gate does."""

    IDLE = 'idle'  # stands, and would drive
    DRIVING = 'driving'  # as commanded, gently
    SLOWED = 'slowed'  # as commanded, more slowly
    BLOCKED = 'blocked'  # not that way
    FADING = 'fading'  # commands are late: slows down gently
    BRAKING = 'braking'  # brakes hard
    HELD = 'held'  # stands until the reason is gone
    WAITING = 'waiting'  # stands; the reason is gone, a fresh command is missing
    MANUAL = 'manual'  # the chair's own joystick drives


class Reason(enum.Enum):
    """Each is a clause that follows 'because'."""

    START = 'it has just been started'
    CLOCK = 'its clock was set back'
    EMERGENCY_STOP = 'the emergency stop was pressed'
    IMPACT = 'the chair was hit by something'
    BUS = 'the chair does not answer'
    ENCODERS = 'the wheel sensors do not answer'
    FROZEN = 'a wheel does not turn as it should'
    RUNAWAY = 'a wheel turns without a command'
    IMU = 'the turn sensor does not answer'
    IMU_FROZEN = 'the turn sensor always says the same'
    TURN = 'the turn sensor and the wheels contradict each other'
    RANGES = 'an obstacle sensor does not answer'
    LOCALIZATION = 'the chair does not know where it is'
    COMMANDS = 'commands stopped coming'
    UNKNOWN_DRIVER = 'it is not known yet who drives'
    JOYSTICK = 'the joystick drives'
    FRONT = 'something is close in front'
    REAR = 'something is close behind'
    LEFT = 'something is close on the left'
    RIGHT = 'something is close on the right'
    PEOPLE = 'people are nearby'
    EXPECTED = 'people are expected'
    CROWD = 'people have been in its way for long'


_TEXTS = {
    State.SLOWED: 'The chair goes slowly because {}.',
    State.BLOCKED: 'The chair does not go that way because {}.',
    State.FADING: 'The chair slows down because {}.',
    State.BRAKING: 'The chair is stopping because {}.',
    State.HELD: 'The chair stands still because {}.',
    State.WAITING: 'The chair stopped because {}; that is over, and it waits for a new command.',
    State.MANUAL: 'The computer does not drive because {}.',
    State.IDLE: 'The chair is ready.',
    State.DRIVING: 'The chair follows its commands.',
}
_GRAVE = frozenset({State.BRAKING, State.HELD, State.WAITING, State.MANUAL})


def sentence(state: State, reason: Reason | None) -> str:
    """The sentence for a State and its Reason (None where there is none)."""
    return _TEXTS[state].format('' if reason is None else reason.value)


HOLDS = frozenset(sentence(state, reason) for state in (State.HELD, State.MANUAL) for reason in Reason)
"""What the safety gate says while no goal would do."""
STOPS = frozenset(sentence(state, reason) for state in _GRAVE for reason in Reason if reason is not Reason.COMMANDS)
"""What it says when it has stopped the chair for more than an obstacle or a command that is late."""


class Announcer:
    """Limits the rate of sentences: grave ones are published at once, others at most every `period` s."""

    def __init__(self, period: float = 1.0) -> None:
        self._period = period
        self._published = None
        self._published_at = None

    def say(self, t: float, state: State, reason: Reason | None) -> str | None:
        """The sentence to publish at t (s), or None if it is the last one again or not due."""
        text = sentence(state, reason)
        if text == self._published:
            return None
        due = self._published_at is None or not 0.0 <= t - self._published_at < self._period
        if not (due or state in _GRAVE):
            return None
        self._published, self._published_at = text, t
        return text
