"""The state machine: every way a goal can end, and that the command is zero on each."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import LETHAL, InflationConfig
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.inflation import InflationLayer
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.layers.static import StaticLayer
from sara_nav.goals.move_base_config import MoveBaseConfig
from sara_nav.grids.footprint import parse_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.lattice.planner import LatticePlanner
from sara_nav.maps.map_io import GridMap
from sara_nav.move_base.robot_state import within_limits
from sara_nav.move_base.state_machine import MoveBase
from sara_nav.planners.grid_planner import GridPlanner
from sara_nav.planners.navfn import NavfnConfig, NavfnROS
from sara_nav.pursuit.rotate_then_pursue import RotateThenPursue
from sara_nav.sampled.trajectory_planner import TrajectoryPlannerConfig

FOOTPRINT = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
HOME = Pose2D(1.0, 1.0, 0.0)
GOAL = Pose2D(5.0, 1.0, 0.0)
ZERO = (0.0, 0.0)


def room(walled=False):
    data = np.zeros((160, 160), np.int8)
    data[[0, -1]] = data[:, [0, -1]] = 100
    if walled:
        data[:, 80] = 100
    return GridMap(data, GridGeometry(160, 160, 0.05, -1.0, -1.0))


def costmap(grid_map, **config):
    result = LayeredCostmap(
        CostmapConfig(**config),
        [StaticLayer('static'), InflationLayer('halo', InflationConfig(inflation_radius=0.6))],
        FOOTPRINT,
    )
    if grid_map is not None:
        result.layers['static'].set_map(grid_map)
    return result


def make(grid_map=room(), recoveries=(), planner=None, local=None, **config):
    return MoveBase(
        MoveBaseConfig(**config),
        costmap(grid_map),
        costmap(grid_map, **local or {}),
        planner or GridPlanner(),
        RotateThenPursue(),
        recoveries,
    )


class Perfect:
    """Drives move_base with a robot that does exactly what it is told."""

    def __init__(self, move_base, pose=HOME):
        self.move_base, self.pose, self.t, self.command = move_base, pose, 0.0, ZERO

    def go(self, steps, until=None):
        for _ in range(steps):
            result = self.move_base.step(self.t, self.pose, self.command, self.t)
            self.command = result.command
            self.pose = self.pose.advance(*self.command, 0.05)
            self.t += 0.05
            if result.status == until:
                break
        return result


def driving():
    robot = Perfect(make())
    assert robot.move_base.set_goal(GOAL, 0.0) == ''
    result = robot.go(40)
    assert result.status == 'active' and result.command[0] > 0.3
    return robot


def test_a_planner_of_the_footprint_is_told_it_and_told_again_when_it_changes():
    """Two rooms with a door of 0.80 m between them: the chair fits, the chair with a tray does not."""
    grid_map = room(walled=True)
    grid_map.data[52:68, 80] = 0
    start, goal = Pose2D(1.0, 1.5, 0.0), Pose2D(5.0, 2.5, 0.4)
    machine = make(grid_map, planner=LatticePlanner())
    plan, text = machine.make_plan(0.0, start, goal)
    assert text == '' and plan[-1].tolist() == [5.0, 2.5, 0.4]
    machine.global_costmap.set_footprint(FOOTPRINT * [1.0, 1.5])
    plan, text = machine.make_plan(1.0, start, goal)
    assert plan is None and 'no way leads the footprint' in text
    machine.global_costmap.set_footprint(FOOTPRINT)
    robot = Perfect(machine, start)
    assert machine.set_goal(goal, 0.0) == '' and robot.go(2000, 'succeeded').status == 'succeeded'
    assert robot.pose.distance(goal) < 0.06


def test_idle_commands_nothing():
    result = make().step(0.0, HOME)
    assert (result.status, result.command, result.plan) == ('idle', ZERO, None)


def test_a_goal_is_planned_at_once_and_reached():
    robot = Perfect(make())
    robot.move_base.set_goal(GOAL, 0.0)
    first = robot.move_base.step(0.0, HOME)
    assert first.status == 'active' and first.plan is not None and len(first.plan) > 50
    last = robot.go(600, until='succeeded')
    assert (last.status, last.text, last.command) == ('succeeded', 'Goal reached.', ZERO)
    assert robot.go(1).status == 'idle'
    assert robot.pose.distance(GOAL) < 0.05


def test_cancel_is_zero_in_the_next_step_in_every_phase():
    seen = set()
    for steps in range(0, 320, 4):
        robot = Perfect(make())
        robot.move_base.set_goal(Pose2D(2.0, 2.0, 3.0), 0.0)
        if steps and robot.go(steps).status != 'active':
            break
        seen.add(robot.move_base.local_planner.phase)
        robot.move_base.cancel(robot.t)
        result = robot.go(1)
        assert (result.status, result.command) == ('preempted', ZERO)
        assert robot.go(1).status == 'idle'
    assert {'turn to path', 'follow path', 'turn to goal'} <= seen


def test_cancel_without_a_goal_is_nothing():
    move_base = make()
    move_base.cancel(0.0)
    assert move_base.step(0.0, HOME).status == 'idle'


def test_a_new_goal_takes_over_without_a_stop():
    robot = driving()
    before = robot.command[0]
    robot.move_base.set_goal(Pose2D(4.5, 1.0, 0.0), robot.t)
    result = robot.go(1)
    assert result.status == 'active' and result.plan is not None and result.command[0] > before - 0.05
    assert robot.go(600, until='succeeded').status == 'succeeded'
    assert robot.move_base.counters.preempted == 1


@pytest.mark.parametrize(
    'goal, reason',
    [
        (Pose2D(math.nan, 1.0, 0.0), 'NaN'),
        (Pose2D(1.0, 1.0, math.inf), 'NaN'),
        (Pose2D(100.0, 1.0, 0.0), 'off the map'),
        (Pose2D(-1.0, 3.0, 0.0), 'overlap'),
        (Pose2D(-0.6, 3.0, 0.0), 'overlap'),
    ],
)
def test_bad_goals_are_refused_and_stop_the_robot(goal, reason):
    robot = driving()
    assert reason in robot.move_base.set_goal(goal, robot.t)
    result = robot.go(1)
    assert (result.status, result.command) == ('aborted', ZERO) and reason in result.text
    assert robot.go(1).status == 'idle'


def test_what_sensors_saw_at_a_goal_is_a_reason_only_near_the_robot():
    seen = ObstacleLayer('seen')
    layers = [StaticLayer('static'), seen, InflationLayer('halo', InflationConfig(inflation_radius=0.6))]
    both = [LayeredCostmap(CostmapConfig(), layers, FOOTPRINT), costmap(room())]
    layers[0].set_map(room())
    machine = MoveBase(MoveBaseConfig(), *both, GridPlanner(), RotateThenPursue())
    machine.step(0.0, HOME)
    for x in (2.0, 5.0):
        seen.costs[40, int((x + 1.0) / 0.05)] = LETHAL
    seen.parent.touch_all()
    machine.costmaps.refresh(both[0], 0.0, HOME)
    assert 'overlap' in machine.refusal(GOAL, 0.0)
    assert 'overlap' in machine.set_goal(Pose2D(2.0, 1.0, 0.0), 0.1)
    assert 'overlap' in machine.set_goal(Pose2D(-0.6, 4.0, 0.0), 0.1), 'what the map says stands'
    assert machine.set_goal(GOAL, 0.1) == ''
    assert 'overlap' in machine.refusal(Pose2D(2.0, 1.0, 0.0), 0.1), 'elsewhere nothing is forgotten'


def test_a_goal_beside_a_wall_is_judged_by_its_yaw():
    assert make().refusal(Pose2D(-0.55, 3.0, math.pi / 2), 0.0) == ''
    assert 'overlap' in make().refusal(Pose2D(-0.55, 3.0, 0.0), 0.0)


def test_without_a_map_goals_are_refused():
    move_base = make(None)
    assert 'no map' in move_base.set_goal(GOAL, 0.0)
    assert move_base.step(0.0, HOME).status == 'aborted'


def test_unreachable_goals_end_after_planner_patience():
    robot = Perfect(make(room(walled=True), planner_patience=2.0))
    robot.move_base.set_goal(GOAL, 0.0)
    result = robot.go(1)
    assert (result.status, result.phase, result.command) == ('active', 'planning', ZERO) and 'no way' in result.text
    result = robot.go(200, until='aborted')
    assert result.status == 'aborted' and 'planner_patience' in result.text and result.command == ZERO
    assert 2.0 <= robot.t <= 3.2


def test_a_map_that_opens_while_planning_is_used():
    robot = Perfect(make(room(walled=True)))
    robot.move_base.set_goal(GOAL, 0.0)
    robot.go(10)
    robot.move_base.global_costmap.layers['static'].set_map(room())
    robot.move_base.local_costmap.layers['static'].set_map(room())
    assert robot.go(25).status == 'active' and robot.move_base.counters.plans == 1


def test_a_new_map_is_planned_on_at_once():
    robot = driving()
    robot.move_base.global_costmap.layers['static'].set_map(room(walled=True))
    robot.move_base.replan()
    result = robot.go(1)
    assert (result.phase, result.command) == ('planning', ZERO) and 'no way' in result.text


LOST = [(None, 0.0), (HOME, 0.6), (Pose2D(math.nan, 0.0, 0.0), 0.0), (HOME, math.nan)]


@pytest.mark.parametrize('pose, age', LOST)
def test_lost_localization_stops_at_once_and_aborts_for_good(pose, age):
    robot = driving()
    last_pose = robot.t - 0.05
    result = robot.move_base.step(robot.t, pose, ZERO, robot.t - age)
    while result.status == 'active':
        assert result.command == ZERO and 'transform_tolerance' in result.text
        robot.t += 0.05
        result = robot.move_base.step(robot.t, pose, ZERO, robot.t - age)
    assert (result.status, result.command) == ('aborted', ZERO)
    assert robot.t - last_pose <= 0.55 + 1e-9
    after = robot.go(20)
    assert (after.status, after.command) == ('idle', ZERO)


@pytest.mark.parametrize('pose, age', LOST)
def test_a_goal_given_before_there_is_a_pose_waits_for_the_patience(pose, age):
    machine = make()
    machine.set_goal(GOAL, 0.0)
    for cycle in range(20):
        result = machine.step(0.05 * cycle, pose, ZERO, 0.05 * cycle - age)
        assert (result.status, result.command) == ('active', ZERO) and 'transform_tolerance' in result.text
    assert machine.step(1.0, pose, ZERO, 1.0 - age).status == 'aborted'


def test_a_short_gap_in_localization_is_a_stop_from_which_it_speeds_up_afresh():
    robot = driving()
    assert robot.move_base.step(robot.t, None).command == ZERO
    robot.t += 0.05
    assert 0.0 < robot.go(1).command[0] <= 0.4 * 0.05 + 1e-9


def test_time_that_goes_back_ends_the_goal():
    robot = driving()
    robot.t -= 1.0
    result = robot.go(1)
    assert (result.status, result.command) == ('aborted', ZERO) and 'back' in result.text


def test_replanning_goes_on_at_planner_frequency():
    robot = Perfect(make(planner_frequency=2.0))
    robot.move_base.set_goal(GOAL, 0.0)
    robot.go(100)
    assert 9 <= robot.move_base.counters.plans <= 11
    assert robot.go(600, until='succeeded').status == 'succeeded'


def test_pushed_off_its_path_it_plans_anew():
    robot = driving()
    plans = robot.move_base.counters.plans
    robot.pose = Pose2D(robot.pose.x, robot.pose.y + 1.0, robot.pose.yaw)
    robot.go(40)
    assert robot.move_base.counters.plans == plans + 1
    assert robot.go(900, until='succeeded').status == 'succeeded'


def test_the_same_run_twice_is_the_same():
    runs = []
    for _ in range(2):
        robot = Perfect(make())
        robot.move_base.set_goal(Pose2D(4.0, 4.0, 1.0), 0.0)
        robot.go(600, until='succeeded')
        runs.append((robot.t, robot.pose))
    assert runs[0] == runs[1]


def test_bad_settings_are_all_said():
    with pytest.raises(ValueError) as error:
        make(controller_frequency=0.0, planner_patience=-1.0, max_planning_retries=-2)
    for text in ('controller_frequency is 0', 'planner_patience is -1', 'max_planning_retries is -2'):
        assert text in str(error.value)


anything = st.one_of(st.floats(-3.0, 9.0), st.sampled_from([math.nan, math.inf, -math.inf, 1e300]))
any_pose = st.builds(Pose2D, anything, anything, anything)
moves = st.one_of(
    st.tuples(st.just('goal'), any_pose),
    st.tuples(st.just('cancel'), st.none()),
    st.tuples(st.just('step'), st.one_of(st.none(), any_pose)),
    st.tuples(st.just('velocity'), st.tuples(anything, anything)),
    st.tuples(st.just('jump'), st.sampled_from([-5.0, 0.0, 30.0])),
)


@settings(max_examples=150)
@given(st.lists(moves, max_size=25))
def test_whatever_comes_the_command_is_sound(script):
    """Random goals, cancels, poses, speeds and jumps of time: no exception, limits kept, zero unless active."""
    move_base, t, velocity, pose = make(), 0.0, ZERO, HOME
    for kind, value in script:
        if kind == 'goal':
            move_base.set_goal(value, t)
        elif kind == 'cancel':
            move_base.cancel(t)
        elif kind == 'velocity':
            velocity = value
        elif kind == 'jump':
            t += value
        else:
            pose = value
        result = move_base.step(t, pose, velocity, t)
        assert abs(result.command[0]) <= 0.5 + 1e-9 and abs(result.command[1]) <= 0.4 + 1e-9
        assert result.status == 'active' or result.command == ZERO
        t += 0.05


# -- what the machine makes of what it is told
# ---------------------------------------------------------------------------


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_commands_beyond_the_limits_are_slowed_on_their_arc(v, w):
    bounded = within_limits(v, w, TrajectoryPlannerConfig())
    assert abs(bounded[0]) <= 0.55 + 1e-12 and abs(bounded[1]) <= 1.0 + 1e-12
    assert bounded[0] * w == pytest.approx(bounded[1] * v)
    if abs(v) <= 0.55 and abs(w) <= 1.0:
        assert bounded == (v, w)


def test_poses_far_from_all_maps_and_speeds_of_no_robot_are_not_believed():
    robot = driving()
    result = robot.move_base.step(robot.t, Pose2D(1e300, 0.0, 0.0), ZERO, robot.t)
    assert result.command == ZERO and robot.move_base.counters.bad_poses == 1
    robot.move_base.step(robot.t + 0.05, robot.pose, (1e300, 0.0), robot.t)
    assert robot.move_base.counters.bad_velocities == 1


def test_a_clock_that_stands_is_no_fault():
    """A late cycle and the next may fall on the same time of a simulated clock; in every phase of a drive."""
    for steps in range(1, 320, 6):
        robot = Perfect(make())
        robot.move_base.set_goal(Pose2D(2.0, 2.0, 3.0), 0.0)
        if robot.go(steps).status != 'active':
            break
        robot.t -= 0.05
        for _ in range(3):
            result = robot.go(1)
            robot.t -= 0.05
            assert abs(result.command[0]) <= 0.5 + 1e-9


class Silent:
    """A layer that has nothing to say."""

    text = ''

    def stale(self, t):
        return self.text


def quiet(machine):
    """Have the machine's local costmap depend on a sensor; return it."""
    layer = machine.local_costmap.layers['static']
    sensor = Silent()
    stale = layer.stale
    layer.stale = lambda t: stale(t) or sensor.text
    return sensor


def test_a_silent_sensor_stops_the_robot_with_the_sentence_why_and_lets_it_go_on():
    robot = driving()
    sensor = quiet(robot.move_base)
    sensor.text = 'range sensor on /SDI_range silent for 1.2 s'
    result = robot.go(1)
    assert (result.status, result.command) == ('active', ZERO)
    assert 'Sensor data is out of date' in result.text and '/SDI_range' in result.text and result.stale == sensor.text
    assert robot.move_base.counters.stale_sensors == 1
    sensor.text = ''
    assert robot.go(600, until='succeeded').status == 'succeeded'


def test_a_sensor_that_stays_silent_ends_the_goal_after_controller_patience():
    robot = Perfect(make(controller_patience=2.0))
    robot.move_base.set_goal(GOAL, 0.0)
    robot.go(20)
    quiet(robot.move_base).text = 'silent'
    begin = robot.t
    result = robot.go(100, until='aborted')
    assert result.status == 'aborted' and result.command == ZERO and 'controller_patience' in result.text
    assert 2.0 <= robot.t - begin <= 2.2


def test_costmaps_stand_still_without_a_goal_when_asked_to_and_wake_with_one():
    machine = make(shutdown_costmaps=True)
    for cycle in range(20):
        machine.step(0.05 * cycle, HOME)
    assert machine.global_costmap.updated_at is None and machine.local_costmap.updated_at is None
    robot = Perfect(machine)
    robot.t = 1.0
    assert machine.set_goal(GOAL, 1.0) == ''
    assert robot.go(600, until='succeeded').status == 'succeeded'
    updated = machine.local_costmap.updated_at
    robot.go(20)
    assert machine.local_costmap.updated_at == updated


def test_costmaps_are_updated_at_their_own_rates():
    machine = make()
    updates = {'global': 0, 'local': 0}
    for cycle in range(100):
        machine.step(0.05 * cycle, HOME)
        for name in machine.costmaps.take_changed():
            updates[name] += 1
    assert 25 <= updates['global'] <= 26 and updates['local'] == updates['global']


def test_a_goal_in_an_obstacle_is_moved_within_default_tolerance_and_that_is_said():
    blocked = room()
    blocked.data[50:54, 118:122] = 100  # about (4.95, 1.6)
    goal = Pose2D(5.0, 1.6, 0.0)
    assert 'overlap' in make(blocked, planner=NavfnROS()).set_goal(goal, 0.0)
    machine = make(blocked, planner=NavfnROS(NavfnConfig(default_tolerance=1.0)))
    robot = Perfect(machine)
    assert machine.set_goal(goal, 0.0) == ''
    first = robot.go(1)
    assert first.goal_used is not None and 0.2 < first.goal_used.distance(goal) <= 1.0
    assert f'cannot be reached: driving to ({first.goal_used.x:.2f}, {first.goal_used.y:.2f})' in first.text
    assert machine.goal == goal


def test_the_end_says_so_when_it_is_another_place():
    open_room = room()
    goal = Pose2D(5.0, 1.0, 0.0)

    class Elsewhere(NavfnROS):
        def plan(self, costmap_, start, wanted):
            plan = super().plan(costmap_, start, Pose2D(4.5, 1.0, 0.0))
            return plan

    robot = Perfect(make(open_room, planner=Elsewhere()))
    robot.move_base.set_goal(goal, 0.0)
    last = robot.go(600, until='succeeded')
    assert (last.status, last.text) == ('succeeded', 'Goal reached: (4.50, 1.00), 0.50 m from the one asked for.')


def test_a_local_costmap_in_another_frame_drives_the_same_way():
    """odom is turned and shifted against map; the robot's way in map must not change."""
    odom = Pose2D(2.0, -1.0, 0.7)  # the map's origin in odom
    ways = []
    for offset in (None, odom):
        rolling = dict(global_frame='odom', rolling_window=True, width=4.0, height=4.0)
        robot = Perfect(make(local=offset and rolling))
        if offset is not None:
            robot.move_base.local_costmap.layers['static'].set_frame(offset.inverse())
        robot.move_base.set_goal(Pose2D(4.0, 3.0, 1.0), 0.0)
        for _ in range(600):
            local = offset and offset.compose(robot.pose)
            result = robot.move_base.step(robot.t, robot.pose, robot.command, robot.t, local)
            robot.command = result.command
            robot.pose = robot.pose.advance(*robot.command, 0.05)
            robot.t += 0.05
            if result.status == 'succeeded':
                break
        assert result.status == 'succeeded'
        ways.append((robot.t, robot.pose.x, robot.pose.y, robot.pose.yaw))
    assert ways[1][1:] == pytest.approx(ways[0][1:], abs=0.02)


def test_make_plan_is_refused_while_a_goal_is_driven_to_and_without_a_map():
    machine = make()
    plan, text = machine.make_plan(0.0, HOME, GOAL)
    assert text == '' and plan[-1].tolist() == [5.0, 1.0, 0.0]
    machine.set_goal(GOAL, 0.0)
    with pytest.raises(ValueError, match='must be in an inactive state'):
        machine.make_plan(0.0, HOME, GOAL)
    with pytest.raises(ValueError, match='no map'):
        make(None).make_plan(0.0, HOME, GOAL)
    with pytest.raises(ValueError, match='NaN'):
        make().make_plan(0.0, Pose2D(math.nan, 0.0, 0.0), GOAL)


def test_make_plan_takes_the_place_about_the_robot_for_free_and_leaves_the_costmap_alone():
    boxed = room()
    boxed.data[30:50, 34:46] = 100  # the robot's own place is marked
    assert make(boxed, clearing_radius=1.2, make_plan_clear_costmap=False).make_plan(0.0, HOME, GOAL)[0] is None
    machine = make(boxed, clearing_radius=1.2)
    machine.step(0.0, HOME)
    before = machine.global_costmap.costmap.costs.copy()
    assert machine.make_plan(0.0, HOME, GOAL)[0] is not None
    assert (machine.global_costmap.costmap.costs == before).all()


def test_another_planner_takes_over_while_driving():
    robot = driving()
    robot.move_base.reconfigure(MoveBaseConfig(base_global_planner='navfn/NavfnROS'), global_planner=NavfnROS())
    result = robot.go(1)
    assert result.plan is not None and robot.move_base.global_planner.plugin_name == 'navfn/NavfnROS'
    assert robot.go(600, until='succeeded').status == 'succeeded'
