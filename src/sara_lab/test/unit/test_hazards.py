"""Each fault of the simulator, on the whole stack in lockstep: what the stack does about it."""

import functools
import math
import os
import tempfile
import traceback
from pathlib import Path

import pytest

from sara_common.planar import Pose2D
from sara_common.platforms import chosen
from sara_lab.campaign import hazards
from sara_lab.campaign.hazards import GOAL, HAZARDS, WATCHED_S, happen, obstacle_ahead, run
from sara_sim.faults.faults import FAULTS

SONARS = chosen().sonars
FRONT_LEFT = max(SONARS, key=lambda name: (SONARS[name].x, SONARS[name].y))
RIDE_S = 25.0
# sonars that tell of things that are not there let the chair wait now and then: it takes 12 to 76 s, as the dice fall
ARRIVES_S = 120.0


driving = functools.cache(hazards.driving)
cruising = functools.cache(hazards.cruising)


def in_a_copy(begin, seed=0):
    """The test runs in a copy of this process, in which the chair is on its way already: it drives there once for all
    tests. `begin`: driving or cruising; `seed`: where the test has no argument of that name.
    """

    def of(test):
        @functools.wraps(test)
        def copied(**arguments):
            begin(arguments.get('seed', seed))
            with tempfile.TemporaryFile('w+') as said:
                child = os.fork()
                if not child:
                    try:
                        hazards.driving, hazards.cruising = driving, cruising
                        test(**arguments)
                        os._exit(0)
                    except BaseException:  # it must not go on as a second pytest, whatever it was
                        said.write(traceback.format_exc())
                        said.flush()
                    finally:
                        os._exit(1)
                _, status = os.waitpid(child, 0)
                said.seek(0)
                assert status == 0, said.read()

        return copied

    return of


def test_a_test_that_fails_in_a_copy_fails():
    def test(seed):
        assert driving(seed).chair.contacts == 7

    with pytest.raises(AssertionError, match='contacts == 7'):
        in_a_copy(driving)(test)(seed=0)


@pytest.mark.parametrize('name', HAZARDS)
@in_a_copy(driving)
def test_the_chair_stands_in_time_and_goes_on_a_fresh_goal_only(name):
    assert happen(name, seed=0).faults == []


@pytest.mark.parametrize('name', HAZARDS)
@in_a_copy(cruising, 1)
def test_a_stream_of_commands_that_goes_on_does_not_move_it_again(name):
    assert happen(name, seed=1, cruise=True).faults == []


@pytest.mark.parametrize('seed', (0, 1, 2))
@in_a_copy(cruising)
def test_something_that_appears_ahead_is_not_touched(seed):
    speed, stopped, gap, contacts = obstacle_ahead(seed)
    assert speed > 0.75 and stopped < WATCHED_S and gap > 0.0 and contacts == 0


def ride(fault, seed=0, patience=RIDE_S, **arguments):
    """Drive with a fault that stays. Returns the Lockstep a second after the goal's end, or after `patience` (s)."""
    lockstep = driving(seed)
    lockstep.chair.faults.add(fault, **arguments)
    end = lockstep.time + patience
    while lockstep.result is None and lockstep.time < end:
        lockstep.step()
    run(lockstep, 1.0)
    assert lockstep.chair.contacts == 0
    return lockstep


def wandered(lockstep):
    """How far the chair gets from where it is in three seconds, m."""
    stood = lockstep.chair.pose
    run(lockstep, 3.0)
    return math.dist(lockstep.chair.pose[:2], stood[:2])


def error(lockstep):
    """Distance of the true pose from the goal, m."""
    return math.dist(lockstep.chair.pose[:2], GOAL[:2])


@pytest.mark.parametrize(
    'fault, arguments',
    (
        ('frames_dropped', {'probability': 0.02}),
        ('frames_delayed', {'delay': 0.1}),
        ('frames_duplicated', {}),
        ('sonar_stuck', {'sensor': FRONT_LEFT, 'range': 0}),
        ('sonar_noisy', {'sensor': 'all'}),
        ('battery_low', {}),
        ('push', {'turn': 0.3}),
    ),
)
@in_a_copy(driving)
def test_it_drives_on_and_arrives(fault, arguments):
    lockstep = ride(fault, patience=ARRIVES_S, **arguments)
    assert lockstep.result.text == 'Goal reached.'
    assert error(lockstep) < 0.1


@pytest.mark.parametrize(
    'fault, arguments, words',
    (
        ('frames_dropped', {'probability': 0.4}, ('do not answer', 'does not answer')),
        ('frames_delayed', {'delay': 0.5}, ('do not answer', 'does not answer')),
        ('imu_stuck', {}, ('turn sensor always says the same',)),
        ('imu_noisy', {}, ('hit by something', 'contradict')),
        ('push', {'left': 0.4}, ('hit by something',)),
        ('wheel_slip', {'factor': 0.3}, ('hit by something',)),  # it loses its hold with a jerk
        ('joystick_grabbed', {'y': 900, 'duration': 1.0}, ('user has taken over', 'joystick drives')),
    ),
)
@in_a_copy(driving)
def test_it_stops_and_says_why(fault, arguments, words):
    lockstep = ride(fault, **arguments)
    assert any(word in lockstep.result.text for word in words), lockstep.result.text
    assert lockstep.result.status != 'succeeded'
    lockstep.chair.faults.clear()
    run(lockstep, 3.0)
    assert wandered(lockstep) < 0.01


@pytest.mark.parametrize('seed', (0, 1, 2))
@in_a_copy(driving)
def test_the_touch_screen_takes_over_and_navigation_does_not_go_on_by_itself(seed):
    lockstep = driving(seed)
    for _ in range(20):
        lockstep.wheels.on_command('touch', 0.0, 0.2, lockstep.time)
        run(lockstep, 0.1)
    assert lockstep.result.text == 'The user has taken over.' and lockstep.wheels.mux.driver == 'touch'
    assert abs(lockstep.chair.velocity[0]) < 0.05 and lockstep.chair.velocity[1] > 0.05
    run(lockstep, 2.0)
    assert wandered(lockstep) < 0.01


@pytest.mark.parametrize('seed', (0, 1, 2))
@in_a_copy(driving)
def test_a_wheel_that_seems_to_run_away_stops_the_chair(seed):
    lockstep = driving(seed)
    began, contacts = lockstep.time, 0
    lockstep.chair.faults.add('encoder_noisy', wheel='right', sigma=20000.0)
    while lockstep.result is None and lockstep.time < began + 5.0:
        lockstep.step()
    assert 'wheel' in lockstep.result.text
    run(lockstep, 2.0)
    assert abs(lockstep.chair.velocity[0]) < 0.01 and lockstep.chair.contacts == contacts


@pytest.mark.parametrize('seed', (0, 1, 2))
@pytest.mark.parametrize('v, w', ((math.nan, 0.0), (math.inf, 0.0), (0.0, -math.inf)))
@in_a_copy(driving)
def test_commands_that_are_no_numbers_are_as_if_they_had_not_come(v, w, seed):
    lockstep = driving(seed)
    lockstep.move_base.cancel(lockstep.time)
    lockstep.pilot = lambda now: (v, w)
    run(lockstep, 3.0)
    assert abs(lockstep.chair.velocity[0]) < 0.01 and lockstep.wheels.mux.dropped['navigation'] > 10


@in_a_copy(driving)
def test_an_obstacle_that_a_broken_sonar_invents_is_named_and_ends_the_goal_in_words():
    lockstep = driving(0)
    lockstep.chair.faults.add(
        'sonar_stuck', sensor=FRONT_LEFT, range=0.1
    )  # nearer than it can measure: that is touching
    said, end = set(), lockstep.time + 5.0
    while lockstep.time < end:
        lockstep.step()
        said.add(lockstep.wheels.decision.reason and lockstep.wheels.decision.reason.value)
    assert 'something is close in front' in said
    while lockstep.result is None and lockstep.time < 200.0:
        lockstep.step()
    assert lockstep.result.status == 'aborted' and 'Even after executing recovery behaviors' in lockstep.result.text
    assert lockstep.chair.contacts == 0
    lockstep.chair.faults.clear()
    run(lockstep, 2.0)  # it may have been backing out, and comes to rest gently
    assert wandered(lockstep) < 0.01  # the obstacle is gone; it stands until it is told to go
    lockstep.result = None
    lockstep.move_base.set_goal(Pose2D(*GOAL), lockstep.time)
    run(lockstep, 60.0)
    assert lockstep.result.status == 'succeeded' and error(lockstep) < 0.1


@in_a_copy(driving)
def test_corrupted_frames_never_make_it_race():
    lockstep = driving(0)
    lockstep.chair.faults.add('frames_corrupted', probability=0.2, bits=2)
    fastest = 0.0
    for _ in range(2000):
        lockstep.step()
        fastest = max(fastest, abs(lockstep.chair.velocity[0]))
    assert fastest < 0.9 and lockstep.chair.contacts == 0


@in_a_copy(driving)
def test_a_noisy_encoder_does_not_lead_it_astray():
    assert error(ride('encoder_noisy', wheel='left')) < 0.15


@in_a_copy(driving)
def test_a_slipping_wheel_turns_the_chair_back_to_its_way_by_the_gyroscope():
    lockstep = ride('wheel_slip', wheel='left', factor=0.7)
    assert abs(lockstep.chair.pose[1] - GOAL[1]) < 0.3


@in_a_copy(driving)
def test_a_low_battery_is_told():
    lockstep = driving(0)
    lockstep.chair.faults.add('battery_low', voltage=20.5)
    run(lockstep, 3.0)
    assert lockstep.reader.battery == pytest.approx(20.5, abs=0.5)


def test_every_fault_of_the_simulator_is_met_here():
    own = Path(__file__)
    besides = own.with_name('test_scanned.py'), own.with_name('test_compass_lab.py')
    files = (own, *besides, Path(HAZARDS['impact'].make.__code__.co_filename))
    text = ''.join(file.read_text() for file in files)
    assert [name for name in FAULTS if f"'{name}'" not in text] == []
