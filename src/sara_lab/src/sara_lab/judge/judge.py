"""The judge: how well a drive was driven, in figures; one module for lockstep and bag, tests, campaign and reports
alike.

A Track is what happened: poses over time, the goals that were given and how each ended. `judge` makes a Judgement of
it: time, length, gap to what stands about, weaving, turns, the ending, comfort, contacts, corner errors. Speeds,
accelerations and jerks are derivatives of the pose (motion.py), which no planner and no estimate has a say in.

Discomfort is that of Gulati and Kuipers (S. Gulati, "A framework for characterization and planning of safe,
comfortable, and customizable motion of assistive mobile robots", PhD thesis, Univ. of Texas at Austin, 2011;
arXiv:1305.5024): T + w_t int(tangential jerk^2) dt + w_n int(normal jerk^2) dt. They weigh the terms by a
characteristic motion; ours is a leg of the thesis's square, 4 m from rest to rest at 0.5 m/s within the rider's
standard profile (0.4 m/s2, 0.8 m/s3; sara_control's safety.yaml): it takes 9.75 s, its jerk squared amounts to 1.28
m2/s5, and w = 9.75 / 1.28 s6/m2 makes the two as bad as each other there.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from sara_common.planar import wrap
from sara_common.platforms import chosen
from sara_lab.judge import gaps
from sara_lab.judge.judgement import Corner, Goal, Judgement, Track, Turn
from sara_lab.judge.motion import Motion, reversals

if TYPE_CHECKING:
    from sara_sim.world.world import World

WEIGHTS = (1.0, 9.75 / 1.28, 9.75 / 1.28)  # of a second (-), of tangential and of normal jerk squared (s6/m2)
TURNING = 0.05  # rad/s: a rate from which on the heading goes to one side
STANDING = 0.05  # m/s: slower than this is no driving: standing, or turning in place
SMALLEST_TURN_DEG = 5.0  # what a turn in place amounts to at least
LAST_M = 1.0  # m before the end of a path: the last metre
GAP_STEP_S = 0.04  # between two looks at the gap


def judge(
    track: Track,
    world: 'World | None' = None,
    body: tuple[float, float] | None = None,
    weights: tuple[float, float, float] = WEIGHTS,
) -> Judgement:
    """The Judgement of a Track. `world`: for the gap: what is occupied, and the obstacles where they were at each time;
    None: no gap. `body`: length, width, m, the chosen robot's if None. `weights`: of time, tangential and normal jerk
    squared in the discomfort.
    """
    motion = Motion.of(track.t, track.pose)
    goals = track.goals or (Goal(tuple(track.pose[-1]), track.t[0], track.t[-1], True),)
    under_way = np.zeros(len(motion.t), bool)
    for goal in goals:
        under_way |= _during(motion, goal)
    driving = under_way & (np.abs(motion.v) > STANDING)
    length, seconds = motion.way(under_way), float(sum(goal.ended - goal.given for goal in goals))
    shortest, detour = _detour(motion, goals)
    ideal, time_ratio = _ideal(goals)
    gap_min, gap_p5 = _gaps(motion, under_way, world, body or chosen().size)
    across = np.concatenate([_across(motion, goal, driving) for goal in goals])
    changes = reversals(motion.w[under_way], TURNING)
    endings = [ending for goal in goals if goal.reached and (ending := _ending(motion, goal))]
    jerk_t, jerk_n = (_integral(part, motion, under_way) for part in (motion.jerk_tangential, motion.jerk_normal))
    return Judgement(
        source=track.source,
        seconds=seconds,
        length=length,
        shortest=shortest,
        detour=detour,
        gap_min=gap_min,
        gap_p5=gap_p5,
        cross_track_p95=_percentile(across, 95),
        cross_track_max=_percentile(across, 100),
        off_plan_p95=_percentile(_off_plan(track, motion, driving), 95),
        reversals=changes,
        reversals_per_m=changes / length if length > 0.0 else math.nan,
        commanded_reversals_per_m=_commanded_reversals(track, length),
        turns=tuple(turn for goal in goals for turn in _turns(motion, goal)),
        last_metre=tuple(ending[0] for ending in endings),
        last_way=tuple(ending[1] for ending in endings),
        **_comfort(motion, under_way & motion.moving),
        discomfort=weights[0] * seconds + weights[1] * jerk_t + weights[2] * jerk_n,
        contacts=track.contacts,
        corners=tuple(_corner(track, goal) for goal in track.goals),
        ideal=ideal,
        time_ratio=time_ratio,
        split=track.split,
        meetings=track.meetings,
    )


def _during(motion, goal):
    """(n,) bool: the times at which the goal was pursued."""
    return (motion.t >= goal.given) & (motion.t <= goal.ended)


def _detour(motion, goals):
    """(m, of the goals whose shortest path is known; length driven for those over it)."""
    known = [goal for goal in goals if goal.shortest is not None]
    shortest = float(sum(goal.shortest for goal in known)) if known else math.nan
    driven = sum(motion.way(_during(motion, goal)) for goal in known)
    return shortest, driven / shortest if shortest > 0.0 else math.nan


def _ideal(goals):
    """(s, of the goals whose ideal time is known; time taken for those over it)."""
    known = [goal for goal in goals if goal.ideal is not None]
    ideal = float(sum(goal.ideal for goal in known)) if known else math.nan
    return ideal, sum(goal.ended - goal.given for goal in known) / ideal if ideal > 0.0 else math.nan


def _gaps(motion, under_way, world, body):
    """(smallest, 5th percentile) of the gap between body and world, m."""
    if world is None or not under_way.any():
        return math.nan, math.nan
    gap = gaps.along(world, motion.t[under_way], motion.pose[under_way], body, GAP_STEP_S)
    return (float(gap.min()), float(np.percentile(gap, 5))) if len(gap) else (math.nan, math.nan)


def _commanded_reversals(track, length):
    """Reversals of the commanded turn rate, 1/m."""
    if track.commanded is None or length <= 0.0:
        return math.nan
    rates = track.commanded[:, 1]
    return reversals(rates[np.isfinite(rates)], TURNING) / length


def _integral(part, motion, under_way):
    """The integral over time of a jerk squared, m2/s5."""
    return float(np.sum(np.where(under_way, part**2, 0.0)) * motion.dt)


def _comfort(motion, moving):
    """R.m.s. of accelerations and jerks while the chair moves, by the names of Judgement."""
    return {
        'acceleration_rms': _rms(np.hypot(motion.acceleration_tangential, motion.acceleration_normal)[moving]),
        'acceleration_tangential_rms': _rms(motion.acceleration_tangential[moving]),
        'acceleration_normal_rms': _rms(motion.acceleration_normal[moving]),
        'jerk_tangential_rms': _rms(motion.jerk_tangential[moving]),
        'jerk_normal_rms': _rms(motion.jerk_normal[moving]),
    }


def cross_track(track: Track) -> np.ndarray:
    """(m,) distances (m) of all poses from the straight leg they belong to, while the chair drives; for percentiles
    over several drives.
    """
    motion = Motion.of(track.t, track.pose)
    return np.concatenate([np.empty(0)] + [_across(motion, goal, np.abs(motion.v) > STANDING) for goal in track.goals])


def _across(motion, goal, driving):
    """The same for one goal."""
    if goal.straight is None:
        return np.empty(0)
    on = driving & _during(motion, goal)
    x, y = goal.pose[0] - goal.straight[0], goal.pose[1] - goal.straight[1]
    off, length = motion.pose[on, :2] - goal.straight, math.hypot(x, y)
    return np.abs(x * off[:, 1] - y * off[:, 0]) / length if length > 0.0 else np.hypot(*off.T)


def _off_plan(track, motion, driving):
    """Distances (m) from the newest plan, while the chair drives."""
    found = [np.empty(0)]
    for k, (since, plan) in enumerate(track.plans):
        until = track.plans[k + 1][0] if k + 1 < len(track.plans) else math.inf
        on = driving & (motion.t >= since) & (motion.t < until)
        if on.any() and len(plan):
            found.append(gaps.from_line(motion.pose[on, :2], np.ascontiguousarray(plan[:, :2], float)))
    return np.concatenate(found)


def _turns(motion, goal):
    """The turns in place before a goal: what is turned between two stretches of driving."""
    inside = (motion.t >= goal.given) & (motion.t <= (goal.ended if goal.judged is None else goal.judged))
    standing = np.concatenate([[False], inside & (np.abs(motion.v) < STANDING), [False]])
    first, last = np.flatnonzero(~standing[:-1] & standing[1:]), np.flatnonzero(standing[:-1] & ~standing[1:]) - 1
    yaw = motion.yaw
    for a, b in zip(first, last):
        turned, net = math.degrees(np.abs(np.diff(yaw[a : b + 1])).sum()), math.degrees(abs(wrap(yaw[b] - yaw[a])))
        if turned >= SMALLEST_TURN_DEG:
            yield Turn(float(motion.t[a]), turned, net)


def _ending(motion, goal):
    """(s from LAST_M left to the goal's end, s from there to the last centimetre); None where the drive was shorter."""
    on = np.flatnonzero(_during(motion, goal))
    if len(on) < 2:
        return None
    left = motion.driven[on[-1]] - motion.driven[on]
    if left[0] < LAST_M:
        return None
    t = motion.t[on]
    begun, there = t[left <= LAST_M][0], t[left <= 0.01][0]
    return float(goal.ended - begun), float(there - begun)


def _corner(track, goal):
    row = min(
        int(np.searchsorted(track.t, (goal.ended if goal.judged is None else goal.judged) - 1e-9)), len(track.t) - 1
    )
    x, y, yaw = track.pose[row]
    return Corner(math.dist((x, y), goal.pose[:2]), math.degrees(wrap(yaw - goal.pose[2])), goal.reached, goal.text)


def _percentile(values, share):
    return float(np.percentile(values, share)) if len(values) else math.nan


def _rms(values):
    return float(np.sqrt(np.mean(values**2))) if len(values) else math.nan
