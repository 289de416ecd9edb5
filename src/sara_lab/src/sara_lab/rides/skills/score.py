"""How a driven skill is scored, from the true pose alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sara_common.planar import wrap
from sara_common.platforms import chosen
from sara_common.repeatable import cos_sin
from sara_control.gate.comfort import Profile
from sara_lab.judge import gaps
from sara_lab.judge.contact_watch import Contact
from sara_lab.judge.motion import MOVING_V, Motion
from sara_lab.rides.skills.skill import LOOSE, PATIENT, Criteria, Pose, Push

OVER = 0.15  # m/s, rad/s beyond the profile's limits: faster is unsafe; a slope of 5 deg adds 0.09 m/s
TILT_DEG = 8.0  # of the body, at most: steeper than any ramp here
DRIVING = 0.05  # m/s: slower than this, turning is turning in place
STILL = 0.02  # m/s, rad/s


class Score(NamedTuple):
    """points: 0, 1 or 2. why: sentences, what is missing of 2. unsafe: those of what must never be."""

    points: int
    why: tuple[str, ...]
    unsafe: tuple[str, ...]


def unsafe(motion: Motion, profile: Profile, contacts: Sequence[Contact], tilt: float) -> list[str]:
    """What must never be: contacts the chair is to blame for, speeds over the rider's profile, a tilt (rad) beyond
    TILT_DEG.
    """
    found = [f'contact: {contact}' for contact in contacts if not contact.blameless]
    for what, value, limit in (
        ('m/s ahead', motion.v.max(), profile.max_forward),
        ('m/s astern', -motion.v.min(), profile.max_reverse),
        ('rad/s', np.abs(motion.w).max(), profile.max_turn),
    ):
        if value > limit + OVER:
            found.append(f'{value:.2f} {what}, allowed is {limit:g}')
    if math.degrees(tilt) > TILT_DEG:
        found.append(f'tilted by {math.degrees(tilt):.1f} deg')
    return found


def of_goals(motion: Motion, goals: Sequence[Pose], seconds: float, criteria: Criteria) -> Score:
    """The Score of a drive past goals, safe so far; the last is where it ends. seconds: how long it took."""
    offs, failed = _offs(motion.pose, goals, criteria)
    if failed:
        return Score(0, (failed,), ())
    why = []
    for position, heading in offs:
        if position > criteria.position or heading > criteria.heading:
            why.append(f'{position:.2f} m and {heading:.0f} deg off a goal')
    if seconds > PATIENT * criteria.seconds:
        return Score(0, (f'{seconds:.0f} s',), ())
    if seconds > criteria.seconds:
        why.append(f'{seconds:.0f} s')
    if criteria.box is not None and (beyond := _beyond(motion.pose, criteria.box)) > 0.0:
        why.append(f'{beyond:.2f} m beyond its place')
    if (share := _astern(motion)) < criteria.astern:
        why.append(f'{share:.0%} of the way astern')
    if (share := _turned_driving(motion)) < criteria.turning:
        why.append(f'{share:.0%} of the turning while driving')
    return Score(1 if why else 2, tuple(why), ())


def of_push(motion: Motion, push: Push) -> Score:
    """The Score of one that was to stop before something, safe so far."""
    x0, y0, x1, y1 = push.thing
    shape = 0.5 * (x0 + x1), 0.5 * (y0 + y1), 1.0, 0.0, 0.5 * (x1 - x0), 0.5 * (y1 - y0)
    gap = min(gaps.to_shape(pose, chosen().size, shape) for pose in motion.pose[::5])
    if abs(motion.v[-1]) > STILL or abs(motion.w[-1]) > STILL:
        return Score(0, ('it does not stand',), ())
    return Score(2, (), ()) if gap <= push.near else Score(1, (f'it stands {gap:.2f} m off',), ())


def _offs(poses, goals, criteria):
    """([(m, deg) off each goal], None), or the sentence that says which was not come to. Goals but the last are passed
    in order, each where it is nearest.
    """
    offs, first = [], 0
    for number, goal in enumerate(goals, 1):
        away = np.hypot(*(poses[first:, :2] - goal[:2]).T)
        turned = np.abs([math.degrees(wrap(yaw - goal[2])) for yaw in poses[first:, 2].tolist()])
        worst = np.maximum(away / criteria.position, turned / criteria.heading)
        there = len(worst) - 1 if number == len(goals) else int(worst.argmin())
        if worst[there] > LOOSE:
            return [], f'goal {number} was not come to: {away[there]:.2f} m and {turned[there]:.0f} deg off'
        offs.append((float(away[there]), float(turned[there])))
        first += there
    return offs, None


def _beyond(poses, box):
    """m by which the body's corners leave a box at most."""
    half = 0.5 * np.array(chosen().size)
    corners = half * [(1, 1), (1, -1), (-1, -1), (-1, 1)]
    c, s = cos_sin(poses[:, 2, None])
    x = poses[:, 0, None] + c * corners[:, 0] - s * corners[:, 1]
    y = poses[:, 1, None] + s * corners[:, 0] + c * corners[:, 1]
    return float(max(box[0] - x.min(), box[1] - y.min(), x.max() - box[2], y.max() - box[3]))


def _astern(motion):
    """Share of the way that is driven backwards."""
    way = np.abs(motion.v[np.abs(motion.v) > MOVING_V]).sum()
    return float(np.abs(motion.v[motion.v < -MOVING_V]).sum() / way) if way else 0.0


def _turned_driving(motion):
    """Share of the turning that is done while driving."""
    rate = np.abs(motion.w)
    return float(rate[np.abs(motion.v) > DRIVING].sum() / rate.sum()) if rate.any() else 0.0
