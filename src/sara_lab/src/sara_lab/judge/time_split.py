"""Where the time of a drive went: each step of it belongs to exactly one of KINDS.

`recovering`: move_base's recovery behaviours are at work. `held`: the safety gate passes zero while the planner asks to
move. `gate`: the gate slows what the planner asks for, turns in place too. `standing`: at rest, and not because of the
gate. `turning`: turning in place. `driving`: as fast as the profile's limits allow on that curve, or speeding up or
braking nearly as hard as they allow. `planner`: the rest, slower than the limits because the planner asks for no more.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sara_control.gate.comfort import Profile
from sara_control.gate.reasons import State
from sara_nav.goals.move_base_config import ACTIVE, CLEARING

SPLIT_NAMES = {
    'driving': 'driving at the limits',
    'turning': 'turning in place',
    'planner': 'slowed by the planner',
    'gate': 'slowed by the gate',
    'held': 'held by the gate',
    'standing': 'standing',
    'recovering': 'recovering',
}
KINDS = tuple(SPLIT_NAMES)
STANDING, TURNING = 0.05, 0.05  # m/s, rad/s: slower than both is standing; slower than the first, turning in place
NEARLY = 0.9  # share of a limit that counts as reaching it
SLOWING = (State.SLOWED, State.BLOCKED, State.BRAKING, State.HELD, State.WAITING, State.FADING)
WINDOW_S = 0.2  # over which acceleration is measured


class Steps(NamedTuple):
    """A drive at even steps of `dt` s. `moved`: (n, 2) true m/s, rad/s. `asked`: (n, 2) of the planner, 0 where it does
    not ask. `passed`: (n, 2) of the gate. `slowed`: (n,) bool, the gate makes it slower or stops it. `recovering`: (n,)
    bool.
    """

    dt: float
    moved: np.ndarray
    asked: np.ndarray
    passed: np.ndarray
    slowed: np.ndarray
    recovering: np.ndarray


def kinds_of(steps: Steps, profile: Profile) -> np.ndarray:
    """(n,) int: to which of KINDS each step belongs."""
    v, w = np.abs(steps.moved).T
    asks = (steps.asked != 0.0).any(axis=1)
    stopped = ~(steps.passed != 0.0).any(axis=1)
    rules = (
        ('recovering', steps.recovering),
        ('held', steps.slowed & asks & stopped),
        ('gate', steps.slowed & asks),
        ('standing', (v < STANDING) & (w < TURNING)),
        ('turning', v < STANDING),
        ('driving', _at_the_limits(steps, profile)),
    )
    return np.select([rule for _, rule in rules], [KINDS.index(name) for name, _ in rules], KINDS.index('planner'))


def _at_the_limits(steps, profile):
    """(n,) bool: as fast as the limits allow on the curve driven, or changing speed nearly as hard as they allow."""
    v, w = steps.moved.T
    top = np.where(v >= 0.0, profile.max_forward, profile.max_reverse)
    with np.errstate(divide='ignore'):
        bend = np.abs(w) / np.maximum(np.abs(v), 1e-9)
        top = np.minimum(top, np.minimum(profile.max_turn / bend, np.sqrt(profile.max_lateral / bend)))
    reach = max(1, round(0.5 * WINDOW_S / steps.dt))
    ends = np.pad(np.abs(steps.passed[:, 0]), reach, 'edge')
    change = (ends[2 * reach :] - ends[: -2 * reach]) / (2 * reach * steps.dt)
    pulling = (change > NEARLY * profile.acceleration) | (change < -NEARLY * profile.braking)
    return (np.abs(v) > NEARLY * top) | pulling


def split(steps: Steps, profile: Profile) -> dict[str, float]:
    """{kind: s}, together the drive's time."""
    counts = np.bincount(kinds_of(steps, profile), minlength=len(KINDS))
    return {name: float(count * steps.dt) for name, count in zip(KINDS, counts)}


class StepRecorder:
    """Keeps of a Lockstep (sara_bringup), step by step, what Steps need."""

    def __init__(self) -> None:
        self._rows = []

    def add(self, lockstep: object) -> None:
        """To be called after each step."""
        newest, decision = lockstep.newest, lockstep.wheels.decision
        asked = newest.command if newest is not None and newest.status == ACTIVE else (0.0, 0.0)
        self._rows.append(
            (
                *lockstep.chair.velocity,
                *asked,
                decision.v,
                decision.w,
                decision.state in SLOWING,
                newest is not None and newest.phase == CLEARING,
            )
        )

    def steps(self, dt: float) -> Steps:
        """The Steps of what was kept; dt: s between them."""
        rows = np.array(self._rows, float).reshape(-1, 8)
        return Steps(dt, rows[:, :2], rows[:, 2:4], rows[:, 4:6], rows[:, 6] > 0.0, rows[:, 7] > 0.0)
