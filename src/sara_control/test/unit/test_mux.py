"""Who drives: twist_mux's rules, and that what the user has interrupted does not go on by itself."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_control.mux.mux import NO_DRIVER, ROBOT, Mux, MuxConfig, SelectedCommand, Source

TOPICS = [
    {'name': 'joystick', 'topic': '/cmd_vel/joystick', 'timeout': 0.5, 'priority': 100},
    {'name': 'touch', 'topic': '/cmd_vel/touch', 'timeout': 0.5, 'priority': 50},
    {'name': 'navigation', 'topic': '/cmd_vel/navigation', 'timeout': 0.5, 'priority': 10},
]
LOCKS = [
    {'name': 'pause', 'topic': '/pause', 'timeout': 0.0, 'priority': 20},
    {'name': 'watchdog', 'topic': '/alive', 'timeout': 1.0, 'priority': 255},
]


def mux(locks=()):
    return Mux(MuxConfig.from_params({'topics': TOPICS, 'locks': list(locks)}))


def test_the_one_who_speaks_drives():
    one = mux()
    assert one.driver == NO_DRIVER and one.update(1.0) is None
    assert one.on_command(1.0, 'navigation', 0.3, 0.1) == SelectedCommand(0.3, 0.1, 'navigation')
    assert one.on_command(1.1, 'navigation', 0.4, 0.1) == SelectedCommand(0.4, 0.1, 'navigation')
    assert one.update(1.6) is None and one.driver == 'navigation'


def test_silence_ends_in_one_zero():
    one = mux()
    one.on_command(1.0, 'navigation', 0.3, 0.1)
    assert one.update(1.51) == SelectedCommand(0.0, 0.0, NO_DRIVER)
    assert one.update(1.53) is None and one.driver == NO_DRIVER
    assert one.take_preempted() == ()


def test_the_higher_priority_wins_and_who_was_driven_out_must_come_anew():
    one = mux()
    one.on_command(1.0, 'navigation', 0.3, 0.0)
    assert one.on_command(1.1, 'joystick', -0.2, 0.0) == SelectedCommand(-0.2, 0.0, 'joystick')
    assert one.take_preempted() == ('navigation',) and one.take_preempted() == ()
    assert one.on_command(1.15, 'navigation', 0.3, 0.0) is None
    assert one.on_command(1.2, 'joystick', 0.0, 0.0) == SelectedCommand(0.0, 0.0, 'joystick')
    t = 1.2
    while t < 3.0:  # navigation goes on as if nothing had been
        t += 0.05
        assert one.on_command(t, 'navigation', 0.3, 0.0) in (None, SelectedCommand(0.0, 0.0, NO_DRIVER))
    assert one.driver == NO_DRIVER
    assert one.on_command(3.1, 'navigation', 0.0, 0.0) == SelectedCommand(0.0, 0.0, 'navigation')
    assert one.on_command(3.2, 'navigation', 0.2, 0.0) == SelectedCommand(0.2, 0.0, 'navigation')


def asked_from(one, t, end):
    """What comes of asking it 50 times a second."""
    return [one.update(t + 0.02 * k) for k in range(1, round((end - t) / 0.02) + 1)]


@pytest.mark.parametrize('pause', [0.0, 0.45, 0.6, 30.0])
def test_a_pause_of_its_own_or_a_clock_that_is_set_forward_lets_nobody_go_on_who_was_interrupted(pause):
    one, t = mux(), 1.0
    one.on_command(t, 'navigation', 0.3, 0.0)
    one.on_command(t, 'joystick', 0.2, 0.0)
    for k in range(200):
        t += 0.02 + (pause if k == 100 else 0.0)
        one.on_command(t, 'navigation', 0.3, 0.0)
        one.update(t)
        assert one.driver != 'navigation'


def test_silence_makes_fresh_too():
    one = mux()
    one.on_command(1.0, 'navigation', 0.3, 0.0)
    one.on_command(1.1, 'joystick', 0.2, 0.0)
    one.on_command(1.15, 'joystick', 0.0, 0.0)
    one.on_command(1.2, 'navigation', 0.3, 0.0)
    assert SelectedCommand(0.0, 0.0, NO_DRIVER) in asked_from(one, 1.2, 1.8)
    assert one.on_command(1.9, 'navigation', 0.3, 0.0) == SelectedCommand(0.3, 0.0, 'navigation')


def test_who_starts_while_another_drives_is_told_so():
    one = mux()
    one.on_command(1.0, 'joystick', 0.2, 0.0)
    assert one.on_command(1.1, 'touch', 0.1, 0.0) is None
    assert one.take_preempted() == ('touch',)
    assert one.on_command(1.2, 'touch', 0.1, 0.0) is None and one.take_preempted() == ()


def test_who_waits_while_another_moves_the_robot_is_preempted_once():
    one = mux()
    one.on_command(1.0, 'navigation', 0.0, 0.0)
    one.on_command(1.1, 'joystick', 0.2, 0.0)
    assert one.take_preempted() == ('navigation',)
    one.on_command(1.2, 'navigation', 0.0, 0.0)
    one.on_command(1.3, 'joystick', 0.2, 0.0)
    assert one.take_preempted() == ()
    one.on_command(1.4, 'joystick', 0.0, 0.0)
    one.on_command(1.5, 'navigation', 0.0, 0.0)
    one.on_command(1.6, 'joystick', 0.0, 0.1)
    assert one.take_preempted() == ('navigation',), 'moved away again'


@pytest.mark.parametrize('v', [0.0, 0.3])
def test_who_is_preempted_and_goes_on_is_told_again_for_it_may_be_about_another_goal(v):
    one, told = mux(), []
    one.on_command(1.0, 'navigation', 0.3, 0.0)
    for k in range(50):  # a goal that comes in the control cycle in which the last one is cancelled sends no zero
        one.on_command(1.1 + 0.05 * k, 'joystick', 0.2, 0.0)
        one.on_command(1.1 + 0.05 * k, 'navigation', v, 0.0)
        told += one.take_preempted()
    assert told == ['navigation'] * 3


def test_who_waits_while_nobody_moves_the_robot_is_not_preempted():
    one = mux()
    one.on_command(1.0, 'navigation', 0.0, 0.0)
    one.on_command(1.1, 'joystick', 0.0, 0.0)
    assert one.take_preempted() == ()
    one.on_lock(1.15, 'pause', True)
    assert one.take_preempted() == ()
    one.on_robot(1.2, True)
    assert one.take_preempted() == ('joystick', 'navigation') and not one.is_blocked('navigation')


def test_turning_is_wanting_too():
    one = mux()
    one.on_command(1.0, 'navigation', 0.0, 0.3)
    one.on_command(1.1, 'joystick', 0.2, 0.0)
    assert one.take_preempted() == ('navigation',)


def test_the_chairs_own_joystick():
    one = mux()
    one.on_command(1.0, 'navigation', 0.3, 0.0)
    assert one.on_robot(1.1, True) == SelectedCommand(0.0, 0.0, ROBOT) and one.driver == ROBOT
    assert one.take_preempted() == ('navigation',)
    assert one.on_command(1.2, 'navigation', 0.3, 0.0) is None and one.on_command(1.2, 'joystick', 0.3, 0.0) is None
    assert one.on_robot(1.3, False) == SelectedCommand(0.0, 0.0, NO_DRIVER)
    assert one.on_command(1.4, 'navigation', 0.3, 0.0) is None
    one.on_command(1.45, 'navigation', 0.0, 0.0)
    assert one.on_command(1.5, 'navigation', 0.3, 0.0) == SelectedCommand(0.3, 0.0, 'navigation')


def test_locks():
    one = mux([LOCKS[0]])
    assert one.locked(1.0) == 0
    one.on_command(1.0, 'navigation', 0.3, 0.0)
    assert one.on_lock(1.1, 'pause', True) == SelectedCommand(0.0, 0.0, NO_DRIVER) and one.locked(9.9) == 20
    assert one.on_command(1.2, 'touch', 0.2, 0.0) == SelectedCommand(0.2, 0.0, 'touch')
    assert one.on_command(1.2, 'navigation', 0.2, 0.0) is None
    one.on_lock(1.3, 'pause', False)
    assert one.locked(1.3) == 0 and one.update(2.0) == SelectedCommand(0.0, 0.0, NO_DRIVER)


def test_a_lock_that_falls_silent_locks():
    one = mux([LOCKS[1]])
    assert one.locked(1.0) == 255 and one.on_command(1.0, 'joystick', 0.3, 0.0) is None
    one.on_lock(1.0, 'watchdog', False)
    one.on_command(1.1, 'joystick', 0.0, 0.0)
    assert one.on_command(1.1, 'joystick', 0.3, 0.0) == SelectedCommand(0.3, 0.0, 'joystick')
    for t in (1.4, 1.8):
        one.on_command(t, 'joystick', 0.3, 0.0)
    assert one.update(2.01) == SelectedCommand(0.0, 0.0, NO_DRIVER)


def test_of_equals_the_first_and_a_lock_of_the_same_priority_lets_pass():
    topics = [dict(topic, priority=7) for topic in TOPICS]
    one = Mux(MuxConfig.from_params({'topics': topics, 'locks': [dict(LOCKS[0], priority=7)]}))
    one.on_lock(1.0, 'pause', True)
    one.on_command(1.0, 'navigation', 0.3, 0.0)
    assert one.on_command(1.1, 'touch', 0.2, 0.0) == SelectedCommand(0.2, 0.0, 'touch')
    assert one.on_command(1.1, 'navigation', 0.3, 0.0) is None


@given(st.sampled_from([math.nan, math.inf, -math.inf]), st.booleans())
def test_what_is_not_finite_is_dropped_and_counted(bad, angular):
    one = mux()
    one.on_command(1.0, 'navigation', 0.3, 0.0)
    command = (0.0, bad) if angular else (bad, 0.0)
    assert one.on_command(1.1, 'joystick', *command) is None and one.on_command(1.1, 'navigation', *command) is None
    assert one.driver == 'navigation' and one.dropped == {'joystick': 1, 'navigation': 1}
    assert one.update(1.51) == SelectedCommand(0.0, 0.0, NO_DRIVER), 'a bad command kept a source alive'


def test_a_clock_set_back_makes_silent():
    one = mux()
    one.on_command(100.0, 'navigation', 0.3, 0.0)
    assert one.update(5.0) == SelectedCommand(0.0, 0.0, NO_DRIVER)


EVENTS = st.lists(
    st.tuples(
        st.sampled_from(['joystick', 'touch', 'navigation', 'robot', 'free', 'lock', 'unlock', 'wait']),
        st.sampled_from([0.0, 0.3]),
        st.floats(0.0, 0.4),
    ),
    min_size=1,
    max_size=40,
)


@given(EVENTS)
def test_never_two_and_never_the_lesser(events):
    """Whatever happens: no motion but by the driver; nobody of a lower priority while a higher one wants to move; none
    past the robot.
    """
    one = mux([LOCKS[0]])
    t, newest, robot, priority = 1.0, {}, False, {topic['name']: topic['priority'] for topic in TOPICS}
    for event, v, dt in events:
        t += dt
        if event in priority:
            selected = one.on_command(t, event, v, 0.0)
            newest[event] = (v, t)
        elif event in ('robot', 'free'):
            robot = event == 'robot'
            selected = one.on_robot(t, robot)
        elif event in ('lock', 'unlock'):
            selected = one.on_lock(t, 'pause', event == 'lock')
        else:
            selected = one.update(t)
        if selected is not None and selected.v:
            assert not robot and selected.source == one.driver and newest[selected.source] == (selected.v, t)
            assert priority[selected.source] >= one.locked(t)
            assert not any(
                priority[name] > priority[selected.source] and value and t - stamp <= 0.5 and one.driver != name
                for name, (value, stamp) in newest.items()
                if not one._inputs[name].blocked
            )


def test_config_is_twist_muxs_and_names_every_fault():
    config = MuxConfig.from_params({'topics': TOPICS, 'locks': LOCKS})
    assert config.topics[0] == Source('joystick', '/cmd_vel/joystick', 0.5, 100) and len(config.locks) == 2
    with pytest.raises(ConfigError) as error:
        MuxConfig.from_params(
            {
                'topics': [
                    dict(TOPICS[0], timeout=0),
                    dict(TOPICS[0], priority=256, topic=''),
                    5,
                    dict(TOPICS[1], timeout=math.nan, colour=1),
                ],
                'locks': 'none',
            }
        )
    text = str(error.value)
    for part in (
        'timeout of joystick is 0',
        'topics[1]: priority is 256',
        "topics[1]: topic is ''",
        'topics[2] is 5',
        'topics[3]: timeout is nan',
        'topics[3]: colour is 1',
        "locks is 'none'",
    ):
        assert part in text, part
    with pytest.raises(ConfigError, match='topics is empty'):
        MuxConfig.from_params({})
    with pytest.raises(ConfigError, match="name is 'joystick' more than once"):
        MuxConfig.from_params({'topics': [TOPICS[0], TOPICS[0]]})


def test_where_the_clock_is_set_back_a_lock_that_fell_silent_locks():
    one = mux(LOCKS)
    one.on_lock(100.0, 'watchdog', False)
    t = 40.0
    for _ in range(30):
        t += 0.1
        assert (one.on_command(t, 'navigation', 0.5, 0.0) or SelectedCommand(0.0, 0.0, '')).v == 0.0
    assert one.locked(t) == 255


def test_where_the_clock_is_set_back_who_was_interrupted_has_not_paused_and_old_commands_are_none():
    one = mux()
    one.on_command(100.0, 'navigation', 0.3, 0.0)
    one.on_command(100.1, 'joystick', 0.4, 0.0)
    t = 90.0
    for _ in range(130):  # past 100.1 again
        t += 0.1
        one.on_command(t, 'navigation', 0.3, 0.0)
        assert one.driver == NO_DRIVER
    assert set(one.take_preempted()) == {'navigation'}
    asked_from(one, t, t + 0.6)
    assert one.on_command(t + 0.7, 'navigation', 0.3, 0.0) == SelectedCommand(0.3, 0.0, 'navigation')
