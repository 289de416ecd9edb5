"""The controller: kinematics there and back, and everything that must stop the wheels."""

import itertools
import math

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_control.wheels.config import ControllerConfig
from sara_control.wheels.controller import DiffDriveController
from sara_control.wheels.limiter import KINDS

PARAMS = {
    'wheel_separation': 0.525,
    'wheel_radius': 0.155,
    'left_wheel': 'left',
    'right_wheel': ['right'],
    'pose_covariance_diagonal': [0.0] * 6,
    'twist_covariance_diagonal': [1.0] * 6,
    'velocity_rolling_window_size': 1,
}
CONFIG = ControllerConfig.from_params(PARAMS)


def driving(v=0.5, w=0.2, t=10.0, config=CONFIG):
    controller = DiffDriveController(config)
    controller.on_wheels(0.0, 0.0, t)
    controller.on_command(v, w, t)
    return controller


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_wheels_that_obey_give_back_the_command(v, w):
    controller = driving(v, w)
    left, right = controller.update(10.0)
    state = controller.on_wheels(left * 0.1, right * 0.1, 10.1)
    assert (state.linear, state.angular) == pytest.approx((v, w), abs=1e-9)


def test_the_interval_of_the_wheels_own_clock_makes_the_speed():
    controller = driving()
    state = controller.on_wheels(1.0, 1.0, 10.107, 0.1)
    assert state.linear == pytest.approx(1.55) and state.stamp == 10.107


def test_a_command_is_obeyed_for_its_timeout_and_no_longer():
    controller = driving()
    controller.on_wheels(0.0, 0.0, 10.4)
    assert controller.update(10.5) != (0.0, 0.0)
    assert controller.update(10.51) == (0.0, 0.0)
    assert controller.update(10.4) == (0.0, 0.0), 'an old command came back'


def test_without_encoders_the_wheels_stop_until_a_fresh_command_after_they_came_back():
    controller = driving()
    for k in range(1, 10):
        controller.on_command(0.5, 0.0, 10.0 + 0.1 * k)
    assert controller.update(10.5) != (0.0, 0.0)
    controller.on_command(0.5, 0.0, 10.6)
    assert controller.update(10.6) == (0.0, 0.0)
    controller.on_wheels(0.0, 0.0, 10.7)
    assert controller.update(10.7) == (0.0, 0.0)
    controller.on_command(0.5, 0.0, 10.8)
    assert controller.update(10.8) != (0.0, 0.0)


def test_before_any_encoder_nothing_moves():
    controller = DiffDriveController(CONFIG)
    controller.on_command(1.0, 0.0, 0.0)
    assert controller.update(0.0) == (0.0, 0.0)


@pytest.mark.parametrize('bad', [(math.nan, 0.0), (0.0, math.inf)])
def test_commands_that_are_not_finite_are_dropped_and_counted(bad):
    controller = driving()
    before = controller.update(10.0)
    controller.on_command(*bad, 10.0)
    assert controller.update(10.0) == before
    assert controller.counters['command_not_finite'] == 1


def test_a_clock_set_back_stops_the_wheels():
    controller = driving()
    controller.on_wheels(0.0, 0.0, 1.0)
    assert controller.update(1.0) == (0.0, 0.0)
    assert controller.on_wheels(0.0, 0.0, 1.1) is not None


@given(st.lists(st.tuples(st.sampled_from('cwu'), st.floats(), st.floats(), st.floats(0.0, 100.0)), max_size=30))
def test_no_input_makes_a_wheel_speed_that_is_not_finite(events):
    controller = DiffDriveController(CONFIG)
    for kind, a, b, t in events:
        if kind == 'c' and not (abs(a) > 1e300 or abs(b) > 1e300):
            controller.on_command(a, b, t)
        elif kind == 'w' and not (abs(a) > 1e100 or abs(b) > 1e100):
            controller.on_wheels(a, b, t)
        else:
            assert all(map(math.isfinite, controller.update(t)))


@given(
    st.sampled_from(['limits', 'brake', 'open', 'plain']),
    st.lists(
        st.tuples(
            st.sampled_from('cwwuuj'),
            st.floats(-1e3, 1e3) | st.just(math.nan),
            st.floats(-1e3, 1e3) | st.just(math.inf),
            st.floats(-0.1, 0.3),
            st.floats(0.0, 2.0),
        ),
        max_size=100,
    ),
)
def test_whatever_comes_the_state_stays_a_number_and_a_stop_stays_a_stop(kind, events):
    controller = DiffDriveController(
        config(
            **{'limits': LIMITS, 'brake': {'stop_deceleration': 1.0}, 'open': {'open_loop': True}, 'plain': {}}[kind]
        )
    )
    t, commanded = 10.0, False
    for what, a, b, dt, lost in events:
        t += dt
        if what == 'c':
            controller.on_command(a, b, t)
            commanded = True
        elif what == 'w':
            controller.on_wheels(a, b, t, abs(dt), lost, lost * (lost > 1.0))
        else:
            speeds = controller.update(t, driving=what != 'j')
            assert all(map(math.isfinite, speeds))
            assert commanded or speeds == (0.0, 0.0)
        if controller.state is not None:
            state = controller.state
            assert all(
                map(
                    math.isfinite,
                    (state.x, state.y, state.heading, state.linear, state.angular, *state.pose_covariance),
                )
            )
            assert min(state.pose_covariance + state.twist_covariance) >= 0.0


def test_repeated_positions_are_counted():
    controller = driving()
    assert controller.on_wheels(1.0, 1.0, 10.0) is None
    assert controller.counters['wheels_not_newer'] == 1


@pytest.mark.parametrize('back', (0.05, 0.1, 0.15, 0.25, 0.29, 0.5))
def test_a_clock_set_back_makes_no_speed(back):
    """Readings every 0.1 s by the wheels' own clock, at one speed."""
    controller, speeds = DiffDriveController(config()), []
    for k in range(60):
        wheels = 0.1 * k
        state = controller.on_wheels(wheels, wheels, 100.0 + 0.1 * k - (back if k >= 30 else 0.0), 0.1)
        speeds += [state.linear] if state is not None and k else []
    assert max(speeds) == pytest.approx(min(speeds)) and len(speeds) >= 58
    assert not controller.counters['wheels_not_newer']


def test_multipliers_scale_the_geometry():
    config = ControllerConfig.from_params(
        {**PARAMS, 'wheel_separation_multiplier': 2.0, 'wheel_radius_multiplier': 0.5}
    )
    assert config.separation == 1.05 and config.radii == (0.0775, 0.0775)


def config(**changes):
    return ControllerConfig.from_params({**PARAMS, **changes})


class Ideal:
    """Wheels that do at once what they are told, 100 cycles a second."""

    def __init__(self, config, start=(0.0, 0.0)):
        self.controller = DiffDriveController(config)
        self.angles, self.t = list(start), 100.0
        self.obey = (1.0, 1.0)
        self.commands = []
        self.controller.on_wheels(*self.angles, self.t)
        self.controller.update(self.t)

    def run(self, seconds, v=None, w=0.0, dt=0.01, encoders=True):
        for _ in range(round(seconds / dt)):
            if v is not None:
                self.controller.on_command(v, w, self.t)
            speeds = self.controller.update(self.t)
            self.commands.append(self.controller.command)
            self.angles = [angle + speed * dt * obeys for angle, speed, obeys in zip(self.angles, speeds, self.obey)]
            self.t += dt
            if encoders:
                self.controller.on_wheels(*self.angles, self.t)
        return self.controller.odometry


VARIANTS = {
    'plain': {},
    'open_loop': {'open_loop': True},
    'multipliers': {'wheel_separation_multiplier': 1.3, 'wheel_radius_multiplier': 0.9},
    'left_and_right': {'left_wheel_radius_multiplier': 1.05, 'right_wheel_radius_multiplier': 0.95},
    'several_wheels': {'left_wheel': ['a', 'b', 'c'], 'right_wheel': ['d', 'e', 'f']},
}


@pytest.mark.parametrize('name', VARIANTS)
def test_forward_goes_forward(name):
    """0.1 m/s for 10 s: 1 m, and nothing else."""
    odometry = Ideal(config(**VARIANTS[name])).run(10.0, 0.1)
    assert odometry.x == pytest.approx(1.0, abs=0.01)
    assert odometry.y == pytest.approx(0.0, abs=1e-9) and odometry.heading == pytest.approx(0.0, abs=1e-9)
    assert (odometry.linear, odometry.angular) == pytest.approx((0.1, 0.0), abs=1e-6)


@pytest.mark.parametrize('name', VARIANTS)
def test_a_turn_turns_on_the_spot(name):
    odometry = Ideal(config(**VARIANTS[name])).run(10.0, 0.0, math.pi / 10.0)
    assert odometry.heading == pytest.approx(math.pi, abs=0.03)
    assert math.hypot(odometry.x, odometry.y) < 0.01
    assert odometry.angular == pytest.approx(math.pi / 10.0, abs=1e-6)


def test_a_side_with_several_joints_counts_as_their_mean():
    controller = DiffDriveController(config(left_wheel=['a', 'b'], right_wheel=['c', 'd']))
    controller.on_wheels((1.0, 3.0), (2.0, 2.0), 1.0)
    state = controller.on_wheels((2.0, 4.0), (3.5, 2.5), 2.0)
    assert state.x == pytest.approx(0.155) and state.heading == pytest.approx(0.0)
    assert controller.on_wheels((2.0, math.nan), (3.0, 3.0), 3.0) is None, 'one joint of a side is not known'
    assert controller.on_wheels((), (3.0, 3.0), 3.0) is None


LIMITS = {
    'linear/x/has_velocity_limits': True,
    'linear/x/max_velocity': 1.0,
    'linear/x/has_acceleration_limits': True,
    'linear/x/max_acceleration': 1.0,
    'linear/x/has_jerk_limits': True,
    'linear/x/max_jerk': 3.0,
    'angular/z/has_velocity_limits': True,
    'angular/z/max_velocity': 2.0,
    'angular/z/has_acceleration_limits': True,
    'angular/z/max_acceleration': 2.0,
}


def test_commands_are_limited_in_jerk_then_acceleration_then_speed():
    robot = Ideal(config(**LIMITS))
    robot.run(0.5, 10.0)
    v = robot.controller.command[0]
    assert v == pytest.approx(1.0 / 3.0 / 2.0 + (0.5 - 1.0 / 3.0), abs=0.02)  # to 1 m/s2 in 1/3 s, then on
    robot.run(4.0, 10.0)
    assert robot.controller.command[0] == pytest.approx(1.0)
    speeds = [command[0] for command in robot.commands]
    assert max(b - a for a, b in zip(speeds, speeds[1:])) <= 0.01 + 1e-9


def test_turns_are_limited_too():
    robot = Ideal(config(**LIMITS))
    robot.run(0.5, 0.0, 10.0)
    assert robot.controller.command[1] == pytest.approx(1.0, abs=0.05)
    robot.run(1.0, 0.0, 10.0)
    assert robot.controller.command[1] == 2.0


def test_a_late_cycle_does_not_leap():
    """A second's pause of the process is no second's acceleration."""
    robot = Ideal(config(**{'linear/x/has_acceleration_limits': True, 'linear/x/max_acceleration': 1.0}))
    robot.t += 0.4
    robot.controller.on_wheels(*robot.angles, robot.t)
    robot.controller.on_command(5.0, 0.0, robot.t)
    robot.controller.update(robot.t)
    assert robot.controller.command[0] == pytest.approx(0.1)  # five periods of 20 ms


def stopping_distance(cycles):
    """Metres from 1 m/s to rest at 0.5 m/s2 with a jerk of 5 m/s3, cycles (s) as given, over and over."""
    limits = {f'has_{kind}_limits': True for kind in KINDS}
    limits |= {'max_velocity': 1.0, 'max_acceleration': 0.5, 'max_jerk': 5.0}
    controller = DiffDriveController(config(open_loop=True, linear={'x': limits}))
    t = distance = 0.0
    for dt in itertools.cycle(cycles):
        controller.on_command(1.0 if t < 4.0 else 0.0, 0.0, t)
        controller.update(t)
        if t < 4.0:
            assert t < 3.0 or controller.command[0] == pytest.approx(1.0, abs=0.02)
        else:
            distance += controller.command[0] * dt
            if controller.command[0] < 1e-3:
                return distance
        t += dt
        assert t < 12.0, 'it never stops'


@given(st.lists(st.sampled_from([0.0, 1e-7]) | st.floats(0.001, 0.04), min_size=1, max_size=6))
@example([0.02])
@example([0.02, 0.02, 0.0])
@example([0.02, 0.04, 0.0])
@example([0.028, 0.012])
@example([0.039, 0.001])
@settings(max_examples=100)
def test_a_stop_is_as_long_whatever_the_cycles(cycles):
    """Two cycles at one time, or a long one after a short one, must not make it forget its deceleration."""
    assume(max(cycles) > 0.001)
    assert stopping_distance(cycles) == pytest.approx(1.03, abs=0.03)


def test_one_metre_a_second_said_once_moves_less_than_the_timeout_allows():
    robot = Ideal(config())
    robot.run(0.01, 1.0)
    assert 0.4 < robot.run(3.0).x < 0.8


def test_nothing_is_believed_of_commands_that_are_not_finite():
    robot = Ideal(config())
    for bad in ((math.nan, 0.0), (0.0, math.nan), (math.inf, 0.0), (math.nan, math.nan)):
        odometry = robot.run(0.2, *bad)
    assert (odometry.x, odometry.y, odometry.heading, odometry.linear, odometry.angular) == (0.0,) * 5


def test_odometry_outlives_positions_that_are_not_finite():
    robot = Ideal(config())
    robot.run(1.0, 0.2)
    before = robot.controller.state
    assert robot.controller.on_wheels(math.nan, math.nan, robot.t + 0.01) is None
    assert robot.controller.state == before
    odometry = robot.run(1.0, 0.2)
    assert odometry.x == pytest.approx(0.4, abs=0.005)


def test_two_publishers_stop_the_robot_where_only_one_is_allowed():
    alone, free = config(allow_multiple_cmd_vel_publishers=False), config()
    for configuration, publishers, moves in ((alone, 2, False), (alone, 1, True), (free, 2, True)):
        controller = driving(0.0, 0.0, config=configuration)
        controller.on_command(0.5, 0.2, 10.0, publishers)
        assert (controller.update(10.0) != (0.0, 0.0)) == moves
    assert controller.counters['several_publishers'] == 0


def test_stops_nobody_commanded_go_along_the_arc_at_the_deceleration_asked_for():
    robot = Ideal(config(stop_deceleration=1.5))
    robot.run(1.0, 0.6, 0.8)
    robot.run(2.0)
    trail = robot.commands[100:]
    rim = [abs(v) + 0.5 * abs(w) * 0.525 for v, w in trail]
    drops = [a - b for a, b in zip(rim, rim[1:])]
    assert max(drops) <= 1.5 * 0.01 + 1e-9 and rim[-1] == 0.0
    assert all(w == pytest.approx(v * 0.8 / 0.6) for v, w in trail)
    seconds = sum(drop > 1e-6 for drop in drops) * 0.01
    assert seconds == pytest.approx(0.81 / 1.5, abs=0.02)


def test_while_the_joystick_drives_commands_are_forgotten():
    controller = driving()
    assert controller.update(10.0, driving=False) == (0.0, 0.0)
    assert controller.update(10.02) == (0.0, 0.0), 'an old command came back with the control'
    controller.on_command(0.5, 0.0, 10.04)
    assert controller.update(10.04) != (0.0, 0.0)


@pytest.mark.parametrize('wheel', [0, 1])
def test_a_frozen_encoder_stops_the_robot_until_a_rest_and_a_fresh_command(wheel):
    robot = Ideal(config())
    robot.run(1.0, 0.4)
    frozen = robot.obey = tuple(float(side != wheel) for side in (0, 1))
    began = robot.t
    while robot.controller.stopped_by is None:
        robot.run(0.01, 0.4)
        assert robot.t - began < 0.3, 'not noticed'
    assert ('left', 'right')[wheel] in robot.controller.stopped_by
    assert robot.controller.counters['encoder_frozen'] == 1
    yaw_variance = robot.controller.state.pose_covariance[5]
    assert yaw_variance > (0.015 / 0.525) ** 2, 'the turn that only the odometry saw is not doubted'
    robot.run(1.0, 0.4)
    assert robot.controller.command == (0.0, 0.0), 'it moved on'
    robot.run(0.1, 0.0)
    robot.obey = (1.0, 1.0)
    robot.run(0.5, 0.4)
    assert robot.controller.stopped_by is None and robot.controller.command[0] == 0.4
    assert frozen != (1.0, 1.0)


def test_the_doubt_grows_with_all_that_a_frozen_encoder_hides_until_the_robot_stands():
    robot = Ideal(config(stop_deceleration=1.5))
    robot.run(1.0, 0.8)
    robot.obey = (1.0, 0.0)
    robot.run(1.5, 0.8)
    hidden = robot.controller.odometry.heading * 0.525  # the other wheel went on; the robot went straight
    assert robot.controller.command == (0.0, 0.0)
    assert math.sqrt(robot.controller.state.pose_covariance[5]) == pytest.approx(abs(hidden) / 0.525, rel=0.2)


def test_two_still_encoders_stop_it_too():
    robot = Ideal(config())
    robot.obey = (0.0, 0.0)
    robot.run(1.0, 0.3)
    assert 'left and the right' in robot.controller.stopped_by


@pytest.mark.parametrize('cycles', [(0.039, 0.001), (0.1, 0.001), (0.06, 0.06, 0.0005)])
def test_uneven_cycles_do_not_make_a_healthy_encoder_stand_still(cycles):
    robot = Ideal(config())
    for dt in cycles * 40:
        robot.run(dt, 0.8, dt=dt)
    assert robot.controller.stopped_by is None and robot.controller.command == (0.8, 0.0)


@given(st.lists(st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8)), min_size=1, max_size=8), st.floats(0.0, 0.2))
def test_wheels_that_obey_with_a_lag_are_never_called_frozen(commands, lag):
    controller = driving(0.0, 0.0)
    angles, speeds = [0.0, 0.0], [0.0, 0.0]
    t = 10.0
    for v, w in commands:
        for k in range(100):
            controller.on_command(v, w, t)
            wanted = controller.update(t)
            gain = 0.01 / (lag + 0.01)
            speeds = [speed + (command - speed) * gain for speed, command in zip(speeds, wanted)]
            angles = [angle + 0.01 * speed for angle, speed in zip(angles, speeds)]
            t += 0.01
            if k % 10 == 9:
                controller.on_wheels(*angles, t)
    assert not controller.counters['encoder_frozen'] and controller.stopped_by is None


def test_covariances_are_the_configured_ones_until_something_is_lost():
    controller = DiffDriveController(config(pose_covariance_diagonal=[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))
    for k in range(20):
        state = controller.on_wheels(0.1 * k, 0.12 * k, 0.1 * k, 0.1)
    assert state.pose_covariance == (1.0, 2.0, 3.0, 4.0, 5.0, 6.0) and state.twist_covariance == (1.0,) * 6
    bridged = controller.on_wheels(2.4, 2.8, 2.4, 0.5, 0.4)
    assert bridged.twist_covariance[0] > 1.0 and bridged.pose_covariance[1] > 2.0
    assert bridged.pose_covariance[5] == 6.0, 'the turn was measured'
    after = controller.on_wheels(2.5, 2.9, 2.5, 0.1)
    assert after.twist_covariance == (1.0,) * 6 and after.pose_covariance == bridged.pose_covariance
    lost = controller.on_wheels(2.6, 3.0, 2.9, 0.1, 0.0, 0.3)
    assert all(lost.pose_covariance[index] > bridged.pose_covariance[index] for index in (0, 5))
    more = controller.on_wheels(2.7, 3.1, 3.8, 0.1, 0.0, 0.8)
    first, second = (
        state.pose_covariance[5] - before.pose_covariance[5] for state, before in ((lost, after), (more, lost))
    )
    assert second > 4.0 * first, 'longer is worse'


def test_open_loop_is_the_sum_of_what_was_commanded_a_cycle_before():
    controller = DiffDriveController(config(open_loop=True))
    way, before = 0.0, 0.0
    for k, v in enumerate((0.5, 0.1, -0.3, 0.0, 0.7, 0.7)):
        controller.on_command(v, 0.0, 0.1 * k)
        controller.update(0.1 * k)
        way, before = way + 0.1 * before * (k > 0), v
        assert controller.odometry.x == pytest.approx(way)


def test_in_open_loop_a_robot_needs_no_encoders_but_if_it_has_them_they_must_go_on():
    controller = DiffDriveController(config(open_loop=True))
    controller.on_command(0.5, 0.0, 10.0)
    assert controller.update(10.0) != (0.0, 0.0)
    controller.on_wheels(0.0, 0.0, 10.0)
    controller.on_command(0.5, 0.0, 11.0)
    assert controller.update(11.0) == (0.0, 0.0)


def test_new_multipliers_hold_from_the_next_cycle():
    robot = Ideal(config())
    robot.controller.set_geometry(left_wheel_radius_multiplier=0.5, right_wheel_radius_multiplier=0.5)
    left, right = (robot.run(0.1, 0.1), robot.controller.update(robot.t))[1]
    assert left == pytest.approx(0.1 / 0.0775) == right
    with pytest.raises(ConfigError):
        robot.controller.set_geometry(wheel_separation_multiplier=0.0)
