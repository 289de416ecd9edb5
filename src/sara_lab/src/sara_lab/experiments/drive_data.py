"""The figures of a driven Course as plain data, from the rows that were recorded in lockstep or over ROS."""

import math

import numpy as np

from sara_common.planar import wrap
from sara_lab.experiments.courses import Course
from sara_lab.judge.judge import judge
from sara_lab.judge.judgement import Goal, Track
from sara_lab.judge.motion import Motion

COLUMNS = 15  # of a row: t; true, fused, wheels' x, y, yaw; IMU's yaw and rate, wheels' rate; commanded v, w
DRIVING = 0.05  # m/s: slower is no driving


def figures(rows: np.ndarray, contacts: int, course: Course, goals: tuple[Goal, ...], trace: bool = False) -> dict:
    """A drive's figures as plain data: of `rows` (n, COLUMNS) as Recorded keeps them, in lockstep or over ROS, the
    contacts, and the Goals in the map (judge.Goal); `trace` as course_driven.
    """
    t, poses = rows[:, 0], {'true': rows[:, 1:4], 'fused': rows[:, 4:7], 'wheels': rows[:, 7:10]}
    yaws = {name: np.unwrap(poses[name][:, 2]) for name in ('true', 'wheels')}
    at = [min(int(np.searchsorted(t, goal.judged)), len(t) - 1) for goal in goals]
    motion = Motion.of(t, poses['true'])
    driving = np.abs(motion.v) > DRIVING
    result = {
        'contacts': contacts,
        'seconds': float(t[-1] - t[0]),
        'texts': [goal.text for goal in goals if not goal.reached],
        **_judged(t, poses, goals),
        'turned': _turned(rows, yaws, at),
        'turn_acceleration': float(np.abs(np.gradient(motion.w, motion.dt)).max()),
        'pace': float(np.abs(motion.v[driving]).mean()) if driving.any() else math.nan,
        'legs': [_leg(t, yaws['true'], goal) for goal in goals],
        'fused_yaw_error': float(np.degrees(np.abs(wrap(poses['fused'][:, 2] - poses['true'][:, 2])).max())),
        'fused_end_error': [math.dist(poses['fused'][row, :2], poses['true'][row, :2]) for row in at],
    }
    return {**result, 'trace': _trace(rows, poses, course, goals)} if trace else result


def _judged(t, poses, goals):
    """{'true', 'fused', 'wheels': figures of the Judgement by that pose}; without a pose that is not known
    throughout.
    """
    found = {}
    for name, path in poses.items():
        if not np.isfinite(path).all():
            continue
        judged = judge(Track(t, path, 'true' if name == 'true' else 'fused', goals))
        found[name] = {
            'reached': sum(corner.reached for corner in judged.corners),
            'position': [corner.position for corner in judged.corners],
            'yaw': [corner.yaw for corner in judged.corners],
            'cross_track_p95': judged.cross_track_p95,
            'reversals_per_m': judged.reversals_per_m,
            'beyond': judged.beyond_shortest,
            'length': judged.length,
            'detour': judged.detour,
        }
    return found


def _turned(rows, yaws, at):
    """{'true', 'wheels', 'imu': deg turned from the start to the end of each goal, whose rows are `at`}."""
    found = {name: [math.degrees(yaw[row] - yaw[0]) for row in at] for name, yaw in yaws.items()}
    known = np.isfinite(rows[:, 10]).all()
    imu = [math.degrees(value) for value in (np.unwrap(rows[:, 10])[at] - rows[0, 10])] if known else None
    return {**found, 'imu': imu}


def _leg(t, yaw, goal):
    """What was turned before a goal was reached, deg: `net`, from its beginning to its end; `all`, both ways added;
    `least`, the short way.
    """
    a, b = np.searchsorted(t, (goal.given, goal.judged))
    part = np.degrees(yaw[a : b + 1])
    return {
        'net': float(part[-1] - part[0]),
        'all': float(np.abs(np.diff(part)).sum()),
        'least': abs(math.degrees(wrap(goal.pose[2] - yaw[a]))),
    }


def _trace(rows, poses, course, goals):
    """What the figures draw, five times a second; poses in the course's own frame."""
    t, thin = rows[:, 0], slice(None, None, 10)
    return {
        't': (t - t[0])[thin],
        **{name: course.back(path)[thin] for name, path in poses.items()},
        'imu_yaw': (np.unwrap(rows[:, 10]) - math.radians(course.at[2]))[thin],
        'imu_rate': rows[thin, 11],
        'wheel_rate': rows[thin, 12],
        'v': rows[thin, 13],
        'w': rows[thin, 14],
        'ends': np.array([goal.ended - t[0] for goal in goals]),
    }
