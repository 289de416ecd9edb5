"""A Course driven in lockstep with a SetUp; what came of it, as plain data. ros/course_over_ros.py drives the same over
ROS.
"""

import math

import numpy as np

from canserial.reader.readings import ImuReading
from sara_bringup.lockstep.localization import Estimate, Filter
from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_common.planar import Pose2D, compose
from sara_control.wheels.odometry import OdometryState
from sara_lab.experiments.courses import BOTH, TRUTH, WHEELS, Course, Pose, SetUp, multipliers, navigation
from sara_lab.experiments.drive_data import figures
from sara_lab.judge.judgement import Goal
from sara_lowlevel.config import SLOW_IMU
from sara_nav.goals.move_base_config import SUCCEEDED

# A person presses again when the chair is not shown where it stands; not always at the same phase of the odometry.
CLICKS, CLICK_TICKS, SHOWN_M = 20, 103, 0.3


class Wheels(Estimate):
    """The wheels' odometry taken for the pose: map -> odom is where the chair started, and stays."""

    def __init__(self, start: Pose) -> None:
        super().__init__()
        self._start = start

    def on_imu(self, _reading: ImuReading) -> None:
        """Wheels need no IMU."""

    def on_odometry(self, state: OdometryState) -> None:
        """The newest odometry."""
        self.pose, self.velocity, self.stamp = (
            compose(self._start, (state.x, state.y, state.heading)),
            (state.linear, state.angular),
            state.stamp,
        )
        self.map_from_odom = self._start

    def step(self, _now: float) -> bool:
        """Whether there is a pose."""
        return self.pose is not None


class Recorded(Lockstep):
    """A Lockstep that keeps what the thesis plotted: poses, and turn rates of IMU, wheels and command."""

    def __init__(self, course: Course, seed: int, setup: SetUp, gain: float | None) -> None:
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
            imu_period=SLOW_IMU,
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

    def pose_estimate(self) -> int:
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

    def record(self) -> None:
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


def course_driven(
    seed: int,
    course: Course,
    setup: SetUp,
    gain: float | None = None,
    trace: bool = False,
    kind: type[Recorded] = Recorded,
) -> dict:
    """Drive a Course; its figures as plain data, by the true pose and by what navigation took for it; `trace`: every
    fifth of a second's row too. `kind`: a Recorded.
    """
    lockstep = kind(course, seed, setup, gain)
    lockstep.start_up()
    clicks = lockstep.pose_estimate()
    goals, before = [], course.placed(course.start)
    for goal in course.goals:
        goals.append(_pursued(lockstep, course, before, course.placed(goal)))
        before = goals[-1].pose
    return {'clicks': clicks, **figures(np.array(lockstep.rows), lockstep.chair.contacts, course, tuple(goals), trace)}


def _pursued(lockstep, course, before, asked):
    """Send a Recorded from `before` to `asked` (poses on the map) and record until the pause after it has passed; the
    Goal.
    """
    given = lockstep.time
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
    return Goal(
        asked,
        given,
        ended,
        lockstep.result.status == SUCCEEDED,
        lockstep.result.text,
        lockstep.time,
        before[:2],
        math.dist(before[:2], asked[:2]),
    )
