"""A course driven in lockstep with one of the set-ups that the thesis compares, or with ours; what came of it, as plain
data. ros/course_over_ros.py drives the same over ROS.

A set-up is a planner (the thesis's with a shorter or a longer sim_time, or SARA's own), a localization (wheels alone,
one of the thesis's fusions, SARA's own, the truth) and what read.py gives. Everything else is the chair and the stack
as they are.
"""

import math
from dataclasses import dataclass

import numpy as np

from canserial.reader.readings import ImuReading
from sara_bringup.lockstep.localization import Estimate, Filter
from sara_bringup.lockstep.lockstep import Lockstep, merged
from sara_bringup.paths import parameters, share
from sara_common.planar import Pose2D, compose, wrap
from sara_lab.judge.judge import Goal, Track, judge
from sara_lab.judge.motion import Motion
from sara_nav.move_base import state_machine as move_base

SETTLE_S = 1.0
COLUMNS = 15  # of a row: t; true, fused, wheels' x, y, yaw; IMU's yaw and rate, wheels' rate; commanded v, w
DRIVING = 0.05  # m/s: slower is no driving
CLICKS, CLICK_TICKS, SHOWN_M = (
    20,
    103,
    0.3,
)  # a person presses again when the chair is not shown where it stands; not always at the same phase of the odometry
SHORT, MIDDLE, LONG, OURS = 'thesis, sim_time 1.0 s', 'thesis, sim_time 1.5 s', 'thesis, sim_time 2.5 s', 'ours'
SIM_TIMES = {SHORT: 1.0, MIDDLE: 1.5, LONG: 2.5}
WHEELS, TRUTH, DEFAULT = 'wheels alone', 'true pose', 'default'
VX, XY, XY_VX = 'vx', 'x, y', 'x, y, vx'
FILTER, BOTH = 'filter', 'filter and read.py'
RADII, GEOMETRY = 'radii', 'radii and separation'
FILES = {VX: 'thesis_vx', XY: 'thesis_xy', XY_VX: 'thesis', DEFAULT: 'default'}  # sara_localization's config/ekf_*.yaml


def navigation(planner, turn_rate=0.0):
    """What is laid over sara_nav.yaml; `turn_rate`: rad/s, the fastest turn in place, 0: the planner's own."""
    if planner == OURS:
        return {'RotateThenPursue': {'max_vel_theta': turn_rate}} if turn_rate else {}
    tree = parameters('sara_bringup', 'thesis_planner.yaml')
    own = {
        'sim_time': SIM_TIMES[planner],
        **({'max_vel_theta': turn_rate, 'min_vel_theta': -turn_rate} if turn_rate else {}),
    }
    return merged(tree, {'TrajectoryPlannerROS': own})


class Wheels(Estimate):
    """The wheels' odometry taken for the pose: map -> odom is where the chair started, and stays."""

    def __init__(self, start):
        super().__init__()
        self._start = start

    def on_imu(self, _reading):
        """Wheels need no IMU."""

    def on_odometry(self, state):
        """The newest odometry."""
        self.pose, self.velocity, self.stamp = (
            compose(self._start, (state.x, state.y, state.heading)),
            (state.linear, state.angular),
            state.stamp,
        )
        self.map_from_odom = self._start

    def step(self, _now):
        """Whether there is a pose."""
        return self.pose is not None


@dataclass(frozen=True)
class SetUp:
    """`planner`, `fusion`: as above. `own_gain`: the gyro's gain is the chair's own, as E6 finds it; else read.py's
    1.08. `raw_rate`: the rate that the filter fuses beside the yaw is the chip's, without offset and gain, as the
    thesis's listing has it. `steer_by_wheels`: the filter runs, but navigation drives by the wheels' odometry. `file`:
    another ekf_*.yaml than the fusion's.
    `posed`: "" where the chair knows from the start where it stands; else filter and IMU start at zero, and RViz's "2D
    Pose Estimate" tells the filter alone ("filter"), or read.py's yaw too ("filter and read.py"). `turn_rate`: rad/s,
    the fastest turn in place; 0: the planner's own. `calibrated`: what of the wheels' geometry the odometry has as this
    chair has it: "", RADII or GEOMETRY.
    """

    planner: str
    fusion: str
    own_gain: bool = False
    raw_rate: bool = False
    steer_by_wheels: bool = False
    file: str = ''
    posed: str = ''
    turn_rate: float = 0.0
    calibrated: str = ''

    @property
    def localization(self):
        """ekf's parameter file."""
        return self.file or FILES.get(self.fusion, 'default')


@dataclass(frozen=True)
class Course:
    """Poses as the thesis has them, m and deg; driven on `map` with its origin at `at` (m, deg there). `timeout_s` for
    one goal, `pause_s` after it.
    """

    start: tuple
    goals: tuple
    at: tuple = (0.0, 0.0, 0.0)
    map: str = 'hall'
    timeout_s: float = 60.0
    pause_s: float = SETTLE_S

    def placed(self, pose):
        """A pose of the course on the map: m, rad."""
        return compose((self.at[0], self.at[1], math.radians(self.at[2])), (pose[0], pose[1], math.radians(pose[2])))

    def back(self, poses):
        """(n, 3) poses on the map in the course's own frame."""
        angle = math.radians(self.at[2])
        c, s = math.cos(angle), math.sin(angle)
        x, y = poses[:, 0] - self.at[0], poses[:, 1] - self.at[1]
        return np.column_stack([c * x + s * y, c * y - s * x, poses[:, 2] - angle])


def multipliers(setup, chair):
    """Those of wheel_separation, the left and the right wheel's radius, that a `calibrated` SetUp gives the odometry of
    a SimulatedChair; of RADII alone the first is 1.
    """
    drawn, nominal = chair.chair, chair.config.wheel_radius
    return (
        1.0 / drawn.slip if setup.calibrated == GEOMETRY else 1.0,
        drawn.left_radius / nominal,
        drawn.right_radius / nominal,
    )


class Recorded(Lockstep):
    """A Lockstep that keeps what the thesis plotted: poses, and turn rates of IMU, wheels and command."""

    def __init__(self, course, seed, setup, gain):
        fusion = 'ekf' if setup.fusion not in (TRUTH, WHEELS) else 'fake'
        super().__init__(
            share() / 'maps' / f'{course.map}.yaml',
            course.placed(course.start),
            seed,
            setup.localization,
            gain if setup.own_gain else None,
            fusion,
            navigation(setup.planner, setup.turn_rate),
            ranges=False,
        )
        self._setup, self._start = setup, course.placed(course.start)
        if setup.fusion == WHEELS:
            self.localization = Wheels(self._start)
        self.rows = []
        if setup.calibrated:
            separation, left, right = multipliers(setup, self.chair)
            self.wheels.controller.set_geometry(
                wheel_separation_multiplier=separation,
                left_wheel_radius_multiplier=left,
                right_wheel_radius_multiplier=right,
            )
        if setup.posed:
            self.localization = Filter((0.0, 0.0, 0.0), 'ekf', setup.localization, self.reader.config.variances)
            self.reader.set_yaw(0.0, 0.0)
        self._imu = (math.nan, math.nan)

    def _on_reading(self, reading):
        if isinstance(reading, ImuReading):
            self._imu = (reading.yaw, reading.angular_velocity[2])
            if self._setup.raw_rate:
                x, y, z = reading.angular_velocity
                reading = reading._replace(
                    angular_velocity=(x, y, z / self.reader.gain + math.radians(self.reader.offset[2]))
                )
        super()._on_reading(reading)

    def _map_pose(self):
        if self._setup.steer_by_wheels and self._odometry_stamp is not None:
            return compose(self._start, self.odometry)
        return super()._map_pose()

    def pose_estimate(self):
        """RViz's "2D Pose Estimate" where the chair stands, as far as the set-up has it, again until the filter shows
        it. Returns how often it took.
        """
        clicks = 0
        while self._setup.posed and clicks < CLICKS:
            clicks += 1
            self.localization.set_pose(self._start, self.time)
            if self._setup.posed == BOTH:
                self.reader.set_yaw(self._start[2], self.time)
            for _ in range(CLICK_TICKS):
                self.step()
            if math.dist(self.fused[:2], self._start[:2]) < SHOWN_M:
                break
        return clicks

    def record(self):
        """Keep a row: t; true, fused, wheels' pose; yaw and rate of the IMU, rate of the wheels; command."""
        state, command = self.wheels.controller.state, self.wheels.decision
        self.rows.append(
            (
                self.time,
                *self.chair.pose,
                *(self.fused or (math.nan,) * 3),
                *compose(self._start, self.odometry),
                *self._imu,
                state.angular,
                command.v,
                command.w,
            )
        )


def course_driven(seed, course, setup, gain=None, trace=False, kind=Recorded):
    """Drive a Course; its figures as plain data, by the true pose and by what navigation took for it; `trace`: every
    fifth of a second's row too. `kind`: a Recorded.
    """
    lockstep = kind(course, seed, setup, gain)
    lockstep.start_up()
    clicks = lockstep.pose_estimate()
    goals, before = [], course.placed(course.start)
    for goal in course.goals:
        asked, given = course.placed(goal), lockstep.time
        lockstep.result = None
        lockstep.move_base.set_goal(Pose2D(*asked), given)
        settled = None
        while settled is None or lockstep.time < settled:
            if settled is None and lockstep.result is not None:
                ended, settled = lockstep.time, lockstep.time + course.pause_s
            if settled is None and lockstep.time > given + course.timeout_s:
                lockstep.move_base.cancel(lockstep.time, f'not there after {course.timeout_s:.0f} s')
            lockstep.step()
            if lockstep.tick % 2 == 0:
                lockstep.record()
        result = lockstep.result
        goals.append(
            Goal(
                asked,
                given,
                ended,
                result.status == move_base.SUCCEEDED,
                result.text,
                lockstep.time,
                before[:2],
                math.dist(before[:2], asked[:2]),
            )
        )
        before = asked
    return {'clicks': clicks, **figures(np.array(lockstep.rows), lockstep.chair.contacts, course, tuple(goals), trace)}


def _leg(t, yaw, goal):
    """What was turned on the way to a goal, deg: `net`, from its beginning to its end; `all`, both ways added; `least`,
    the short way.
    """
    a, b = np.searchsorted(t, (goal.given, goal.judged))
    part = np.degrees(yaw[a : b + 1])
    return {
        'net': float(part[-1] - part[0]),
        'all': float(np.abs(np.diff(part)).sum()),
        'least': abs(math.degrees(wrap(goal.pose[2] - yaw[a]))),
    }


def figures(rows, contacts, course, goals, trace=False):
    """A drive's figures as plain data: of `rows` (n, COLUMNS) as Recorded keeps them, in lockstep or over ROS, the
    contacts, and the Goals in the map (judge.Goal); `trace` as course_driven.
    """
    t, poses = rows[:, 0], {'true': rows[:, 1:4], 'fused': rows[:, 4:7], 'wheels': rows[:, 7:10]}
    result = {
        'contacts': contacts,
        'seconds': float(t[-1] - t[0]),
        'texts': [goal.text for goal in goals if not goal.reached],
    }
    for name, path in poses.items():
        judged = (
            judge(Track(t, path, 'true' if name == 'true' else 'fused', goals)) if np.isfinite(path).all() else None
        )
        if judged is not None:
            result[name] = {
                'reached': sum(corner.reached for corner in judged.corners),
                'position': [corner.position for corner in judged.corners],
                'yaw': [corner.yaw for corner in judged.corners],
                'cross_track_p95': judged.cross_track_p95,
                'reversals_per_m': judged.reversals_per_m,
                'beyond': judged.beyond_shortest,
                'length': judged.length,
                'detour': judged.detour,
            }
    yaws = [np.unwrap(poses[name][:, 2]) for name in ('true', 'wheels')]
    at = [min(int(np.searchsorted(t, goal.judged)), len(t) - 1) for goal in goals]
    result['turned'] = {
        name: [math.degrees(yaw[row] - yaw[0]) for row in at] for name, yaw in zip(('true', 'wheels'), yaws)
    }
    result['turned']['imu'] = (
        [math.degrees(value) for value in (np.unwrap(rows[:, 10])[at] - rows[0, 10])]
        if np.isfinite(rows[:, 10]).all()
        else None
    )
    motion = Motion.of(t, poses['true'])
    result['turn_acceleration'] = float(np.abs(np.gradient(motion.w, motion.dt)).max())
    driving = np.abs(motion.v) > DRIVING
    result['pace'] = float(np.abs(motion.v[driving]).mean()) if driving.any() else math.nan
    result['legs'] = [_leg(t, yaws[0], goal) for goal in goals]
    result['fused_yaw_error'] = float(np.degrees(np.abs(wrap(poses['fused'][:, 2] - poses['true'][:, 2])).max()))
    result['fused_end_error'] = [math.dist(poses['fused'][row, :2], poses['true'][row, :2]) for row in at]
    if trace:
        thin = slice(None, None, 10)
        result['trace'] = {
            't': (t - t[0])[thin],
            **{name: course.back(path)[thin] for name, path in poses.items()},
            'imu_yaw': (np.unwrap(rows[:, 10]) - math.radians(course.at[2]))[thin],
            'imu_rate': rows[thin, 11],
            'wheel_rate': rows[thin, 12],
            'v': rows[thin, 13],
            'w': rows[thin, 14],
            'ends': np.array([goal.ended - t[0] for goal in goals]),
        }
    return result
