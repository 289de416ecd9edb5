"""Goals, maps, sensor messages and cancels at random against move_base: a clear refusal each, no crash, no motion without a
valid goal.

A robot that obeys is driven through a small house (fuzz_world.py) and meanwhile given whatever comes; after each input the
machine makes a step, and what it commands is judged.
"""
import math
import random

from sara_nav import fuzz_world as world
from sara_nav.footprint import FootprintError, parse_footprint
from sara_nav.geometry import Pose2D
from sara_nav.goal_input import GoalError, global_pose
from sara_nav.move_base_config import ABORTED, ACTIVE, IDLE, PREEMPTED, SUCCEEDED

INPUTS_PER_MACHINE = 400
DT = 0.05
FASTEST, QUICKEST = 0.56, 1.01
"""m/s and rad/s that no planner here exceeds with its parameters."""
ZERO = (0.0, 0.0)


class FuzzFailure(AssertionError):
    """Which input made move_base do what it must not."""


def fuzz_move_base(count, seed, on_result=None):
    """Give ``count`` random inputs to machines; return {what came of them: how often}.

    on_result: called with each StepResult. Raises FuzzFailure, or whatever the machine raised. The same seed gives the same
    inputs and results.
    """
    chance = random.Random(seed)
    tally = {}
    trial = None
    for number in range(count):
        if number % INPUTS_PER_MACHINE == 0:
            trial = Trial(chance, tally)
        kind = trial.next_kind(chance)
        try:
            kind(trial, chance)
            result = trial.step()
        except FuzzFailure as failure:
            raise FuzzFailure('seed %d, input %d (%s): %s' % (seed, number, kind.__name__, failure)) from None
        trial.count(result.status)
        if result.command != ZERO:
            trial.count('moving while ' + result.phase)
        if on_result:
            on_result(result)
    return tally


class Trial:
    """One machine, the robot it drives, and what is expected of its next step."""

    def __init__(self, chance, tally):
        self.machine, self.offset = world.machine(chance)
        self.tally = tally
        self.calm = chance.choice((0.0, 0.0, 0.7, 0.97, 1.0))
        self.t = chance.choice((0.0, 1.7e9))
        self.pose = Pose2D(1.0, 1.0, 0.0)
        self.told = self.pose
        self.told_at = 0.0
        self.velocity = None
        self.command = ZERO
        self.goal = False
        self.expected = None
        self.strange = False
        first = world.house(chance)
        for layer in self.static():
            layer.set_map(first)

    def next_kind(self, chance):
        """Return the next input: a calm trial is mostly left to drive, so that the robot gets somewhere."""
        if chance.random() < self.calm:
            return nothing if self.machine.active else good_goal
        return chance.choices(*zip(*INPUTS))[0]

    def costmaps(self):
        """Return both costmaps."""
        return self.machine.global_costmap, self.machine.local_costmap

    def static(self):
        """Return the static layers."""
        return [costmap.layers['static'] for costmap in self.costmaps()]

    def count(self, what):
        """Note that something came of an input."""
        self.tally[what] = self.tally.get(what, 0) + 1

    def set_goal(self, pose):
        """Give a goal; a refusal must say why and end in the next step."""
        reason = self.machine.set_goal(pose, self.t)
        self.goal = not reason
        self.expected = ABORTED if reason else None
        self.count('refused' if reason else 'taken')
        if reason and not reason.startswith('Goal refused: '):
            raise FuzzFailure('the refusal of %s is %r' % (pose, reason))
        if not pose.is_finite() and not reason:
            raise FuzzFailure('%s was taken for a goal' % (pose,))

    def end(self, status):
        """The goal was given up; the next step must say so."""
        if self.goal:
            self.goal, self.expected = False, status

    def step(self):
        """Let the machine make a step and judge it; the robot obeys."""
        told, at = (self.told, self.told_at) if self.strange else (self.pose, self.t)
        local = None if self.offset is None or told is None else self.offset.compose(told) if told.is_finite() else told
        result = self.machine.step(self.t, told, self.velocity, at, local)
        fault = self.fault(result, told, at)
        if fault:
            raise FuzzFailure('%s; %s' % (fault, result))
        if result.status in (SUCCEEDED, PREEMPTED, ABORTED):
            self.goal = False
        self.expected, self.strange = None, False
        self.command = result.command
        self.pose = self.pose.advance(*self.command, DT)
        self.velocity = None
        self.t += DT
        return result

    def fault(self, result, told, at):
        """Return what is wrong with a result, '' when nothing is."""
        v, w = result.command
        if not (math.isfinite(v) and math.isfinite(w) and abs(v) <= FASTEST and abs(w) <= QUICKEST):
            return 'the command is out of all bounds'
        if self.expected is not None and result.status != self.expected:
            return 'this step should have said %s' % self.expected
        if not self.goal and self.expected is None and result.status != IDLE:
            return 'there is no goal, but the machine is not idle'
        if result.status in (SUCCEEDED, PREEMPTED, ABORTED) and not result.text:
            return 'the end is not explained'
        if result.command == ZERO:
            return ''
        if result.status != ACTIVE or not self.goal:
            return 'it moves without a valid goal'
        if told is None or not told.is_finite() or not abs(self.t - at) <= self.machine.config.transform_tolerance + 1e-9 and at < self.t:
            return 'it moves without knowing where it is'
        if self.machine.local_costmap.current(self.t):
            return 'it moves though %s' % self.machine.local_costmap.current(self.t)
        return ''


# -- inputs: each is given the trial and chance; the machine's step follows ------------------------------------------------

def nothing(trial, chance):
    """A cycle like others."""


def good_goal(trial, chance):
    """A goal in the house."""
    trial.set_goal(Pose2D(chance.uniform(0.5, 5.5), chance.uniform(0.5, 5.5), chance.uniform(-math.pi, math.pi)))


def goal_message(trial, chance):
    """A goal as a client sends it, in frames that there are or not, with quaternions that are none."""
    def find(frame):
        if frame != 'odom':
            raise LookupError('"%s" does not exist' % frame)
        return Pose2D(0.5, 0.0, 0.3)
    try:
        pose = global_pose(*world.message(chance), 'map', find)
    except GoalError as error:
        if len(str(error)) < 20:
            raise FuzzFailure('a goal is refused with %r' % str(error)) from None
        trial.count('unreadable')
        trial.machine.abort('%s.' % error)
        trial.end(ABORTED)
        return
    if not pose.is_finite():
        raise FuzzFailure('a message gave %s' % (pose,))
    trial.set_goal(pose)


def raw_goal(trial, chance):
    """A goal with numbers that are none."""
    trial.set_goal(world.pose(chance, 0.3))


def flood(trial, chance):
    """Many goals in one cycle."""
    for _ in range(20):
        trial.set_goal(world.pose(chance))


def cancel(trial, chance):
    """Given up."""
    trial.machine.cancel(trial.t)
    trial.end(PREEMPTED)


def abort(trial, chance):
    """Given up by whoever stops the robot."""
    trial.machine.abort('Enough.')
    trial.end(ABORTED)


def strange_pose(trial, chance):
    """No pose, an old one, one that is none, another place; speeds that are none."""
    trial.strange = True
    trial.told = chance.choice((None, trial.pose, world.pose(chance, 0.4)))
    trial.told_at = chance.choice((trial.t, trial.t - 0.3, trial.t - 2.0, trial.t + 1.0, math.nan, -math.inf, math.inf))
    trial.velocity = chance.choice((None, (world.number(chance), world.number(chance))))


def leap(trial, chance):
    """The clock leaps; back, it ends the goal."""
    by = chance.choice((0.3, 2.0, 30.0, -3.0, -100.0))
    trial.t += by
    if by < -DT - 1e-3:  # the machine saw the time one step ago
        trial.end(ABORTED)


def standing_clock(trial, chance):
    """Another cycle at the time of the last one."""
    trial.t -= DT


def map_message(trial, chance):
    """A map, or what is none."""
    try:
        grid_map = world.grid_map(chance)
        for layer in trial.static():
            layer.set_map(grid_map)
        trial.machine.replan()
        trial.count('maps')
    except ValueError as error:
        if not str(error):
            raise FuzzFailure('a map is refused without a word') from None
        trial.count('bad maps')


def map_update(trial, chance):
    """A part of a map, which may lie off it."""
    values = world.np.full((chance.choice((0, 1, 9)), chance.choice((0, 1, 9))), chance.choice((0, 100, -1)), world.np.int8)
    x, y = chance.choice((-1, 0, 5, 58, 10 ** 6)), chance.choice((-1, 0, 5, 58, 10 ** 6))
    for layer in trial.static():
        try:
            layer.update_map(x, y, values)
        except ValueError:
            trial.count('bad map updates')


def ranges(trial, chance):
    """What range sensors say."""
    for costmap in trial.costmaps():
        for source in ('front', 'rear'):
            costmap.layers['ultrasonic'].add_range(world.reading(chance, source, trial.pose, trial.t))


def scan(trial, chance):
    """What a scanner or a camera says."""
    for costmap in trial.costmaps():
        try:
            costmap.layers['obstacles'].add_observation(world.observation(chance, trial.pose, trial.t))
        except ValueError:
            trial.count('bad observations')


def clear(trial, chance):
    """The service clear_costmaps."""
    local = trial.pose if trial.offset is None else trial.offset.compose(trial.pose)
    trial.machine.costmaps.reset(trial.t, trial.pose, local)


def make_plan(trial, chance):
    """The service make_plan."""
    try:
        plan, text = trial.machine.make_plan(trial.t, world.pose(chance), world.pose(chance), world.number(chance, 0.0, 0.4))
    except ValueError as error:
        if len(str(error)) < 20:
            raise FuzzFailure('make_plan refuses with %r' % str(error)) from None
        trial.count('plans refused')
        return
    if plan is None and not text or plan is not None and not world.np.isfinite(plan).all():
        raise FuzzFailure('make_plan gives %r, %r' % (plan, text))
    trial.count('plans')


def reconfigure(trial, chance):
    """Another configuration, taken when it has no faults, as dynamic_reconfigure does."""
    config = world.configuration(chance, trial.machine.config)
    if config.faults():
        trial.count('bad configurations')
        return
    trial.machine.reconfigure(config)


def footprint(trial, chance):
    """Another footprint by topic."""
    corners = [[world.number(chance, -0.3, 0.3, 0.05), world.number(chance, -0.3, 0.3, 0.05)] for _ in range(chance.choice((0, 2, 3, 5)))]
    try:
        corners = world.pad_footprint(parse_footprint(corners), 0.01)
    except FootprintError:
        trial.count('bad footprints')
        return
    if abs(corners).max() < 1.0:
        for costmap in trial.costmaps():
            costmap.set_footprint(corners)


INPUTS = ((nothing, 40), (good_goal, 6), (goal_message, 4), (raw_goal, 2), (flood, 1), (cancel, 2), (abort, 1),
          (strange_pose, 6), (leap, 2), (standing_clock, 3), (map_message, 2), (map_update, 1), (ranges, 10), (scan, 8), (clear, 1), (make_plan, 2),
          (reconfigure, 2), (footprint, 1))
"""Inputs and how often they come."""
