"""Why the chair does not do as it is told, in words its rider understands: one sentence each."""

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
    MANUAL = 'manual'  # somebody else drives


class Reason(enum.Enum):
    """Each is a clause that follows 'because'."""

    START = 'it has just been started'
    CLOCK = 'its clock was set back'
    EMERGENCY_STOP = 'the emergency stop was pressed'
    IMPACT = 'the chair was hit by something'
    BUS = 'the chair does not answer'
    ENCODERS = 'the wheel sensors do not answer'
    FROZEN = 'a wheel does not turn as it should'
    RUNAWAY = 'a wheel turns as nobody told it to'
    IMU = 'the turn sensor does not answer'
    TURN = 'the turn sensor and the wheels contradict each other'
    RANGES = 'an obstacle sensor does not answer'
    LOCALIZATION = 'the chair does not know where it is'
    COMMANDS = 'commands stopped coming'
    UNKNOWN_DRIVER = 'the chair has not said yet who drives'
    JOYSTICK = 'the joystick drives'
    FRONT = 'something is close in front'
    REAR = 'something is close behind'
    LEFT = 'something is close on the left'
    RIGHT = 'something is close on the right'
    PEOPLE = 'somebody is about'
    EXPECTED = 'people are expected'
    CROWD = 'people have been about for long'


_TEXTS = {
    State.SLOWED: 'The chair goes slowly because {}.',
    State.BLOCKED: 'The chair does not go that way because {}.',
    State.FADING: 'The chair slows down because {}.',
    State.BRAKING: 'The chair is stopping because {}.',
    State.HELD: 'The chair stands still because {}.',
    State.WAITING: 'The chair stopped because {}; it is well again and waits for a new command.',
    State.MANUAL: 'The computer does not drive because {}.',
    State.IDLE: 'The chair is ready.',
    State.DRIVING: 'The chair drives as it is told.',
}
_GRAVE = frozenset({State.BRAKING, State.HELD, State.WAITING, State.MANUAL})


def sentence(state, reason):
    """The sentence for a State and its Reason (None where there is none)."""
    return _TEXTS[state].format('' if reason is None else reason.value)


class Announcer:
    """Says what is new, but not in a flood: what is grave at once, the rest at most every `period` s."""

    def __init__(self, period=1.0):
        self._period = period
        self._said = None
        self._said_at = None

    def say(self, t, state, reason):
        """The sentence to publish at t (s), or None if it has been said or is not due."""
        text = sentence(state, reason)
        if text == self._said:
            return None
        due = self._said_at is None or not 0.0 <= t - self._said_at < self._period
        if not (due or state in _GRAVE):
            return None
        self._said, self._said_at = text, t
        return text
