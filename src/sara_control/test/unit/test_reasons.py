"""What the rider is told."""

from sara_control.gate.reasons import Announcer, Reason, State, sentence


def test_every_state_and_reason_makes_one_sentence():
    for state in State:
        for reason in Reason:
            text = sentence(state, reason)
            assert (
                text[0].isupper()
                and text.endswith('.')
                and text.count('.') == 1
                and '{' not in text
                and '_' not in text
            )
    assert sentence(State.BRAKING, Reason.IMU) == 'The chair is stopping because the turn sensor does not answer.'
    assert sentence(State.IDLE, None) == 'The chair is ready.'


def test_not_twice_and_not_in_a_flood():
    one = Announcer(period=1.0)
    assert one.say(0.0, State.IDLE, None) == 'The chair is ready.'
    assert one.say(0.1, State.IDLE, None) is None
    said = [
        one.say(0.1 + 0.02 * i, *((State.SLOWED, Reason.FRONT) if i % 2 else (State.DRIVING, None))) for i in range(500)
    ]
    assert 9 <= sum(text is not None for text in said) <= 11


def test_what_is_grave_is_said_at_once():
    one = Announcer(period=1.0)
    one.say(0.0, State.DRIVING, None)
    for t, state in ((0.1, State.BRAKING), (0.2, State.HELD), (0.3, State.WAITING), (0.4, State.MANUAL)):
        assert one.say(t, state, Reason.BUS) == sentence(state, Reason.BUS)


def test_what_was_withheld_is_said_when_due_and_a_clock_set_back_does_not_silence():
    one = Announcer(period=1.0)
    one.say(10.0, State.IDLE, None)
    assert one.say(10.5, State.DRIVING, None) is None
    assert one.say(11.0, State.DRIVING, None) is not None
    assert one.say(1.0, State.IDLE, None) is not None
