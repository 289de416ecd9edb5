"""Where the time of a recorded drive went: Steps of time_split.py from what a bag holds.

The safety gate's sentences say when it slows the chair; they come a second apart at least, so that a shorter slowing is
missed or counted as longer. When a recovery ends is not recorded: none of the time counts as recovering.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sara_control.gate.reasons import sentence
from sara_lab.judge.judgement import Track
from sara_lab.judge.motion import Motion
from sara_lab.judge.time_split import SLOWING, Steps

STEP_S = 0.02
HELD_S = 0.3  # a command is good for so long
_BEGINNINGS = tuple(sentence(state, None).split('because')[0] for state in SLOWING)


def recorded_steps(
    track: Track,
    asked: Sequence[tuple[float, float, float]],
    passed: Sequence[tuple[float, float, float]],
    said: Sequence[tuple[float, str]],
) -> Steps:
    """The Steps of a Track while it has goals. asked, passed: (s, m/s, rad/s) commands before and after the gate; said:
    (s, sentence) of the gate.
    """
    motion = Motion.of(track.t, track.pose)
    t = np.concatenate(
        [goal.given + STEP_S * np.arange(round((goal.ended - goal.given) / STEP_S)) for goal in track.goals]
        or [np.empty(0)]
    )
    moved = np.column_stack([np.interp(t, motion.t, motion.v), np.interp(t, motion.t, motion.w)])
    slows = np.array([text.startswith(_BEGINNINGS) for _, text in said] + [False])
    newest = np.searchsorted([when for when, _ in said], t, 'right') - 1
    return Steps(STEP_S, moved, _held(asked, t), _held(passed, t), slows[newest], np.zeros(len(t), bool))


def _held(commands, t):
    """(n, 2) the command in force at each time, 0 where there is none."""
    rows = np.array([(-math.inf, 0.0, 0.0), *commands], float)
    newest = rows[np.searchsorted(rows[:, 0], t, 'right') - 1]
    return np.where((t - newest[:, 0] <= HELD_S)[:, None], newest[:, 1:], 0.0)
