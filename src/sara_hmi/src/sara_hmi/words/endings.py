"""How a goal ended, as a key: move_base's status and words."""

from __future__ import annotations

import re

from sara_hmi.words.keys import gate

# actionlib_msgs/GoalStatus
ENDINGS = {
    0: 'goal.pending',
    1: 'goal.going',
    2: 'goal.preempted',
    3: 'goal.succeeded',
    4: 'goal.aborted',
    5: 'goal.rejected',
    6: 'goal.preempted',
    7: 'goal.cancelled',
    8: 'goal.cancelled',
    9: 'goal.lost',
}
# What move_base, sara_nav's and the C++ one, says; the first that is found counts.
_WHYS = (
    (r'out of date', 'why.old_data'),
    (r'no pose of the robot', 'why.no_pose'),
    (r'lost_patience', 'why.unsure'),
    (r'time went back|time jumped back', 'why.clock'),
    (r'NaN|infinity|quaternion|commanded', 'why.not_finite'),
    (r'transform|frame_id', 'why.transform'),
    (r'off the map', 'why.off_map'),
    (r'keep-out', 'why.keep_out'),
    (r'would overlap', 'why.occupied'),
    (r'Robot is held|has stood for', 'why.blocked'),
    (r'oscillat', 'why.oscillation'),
    (r'valid plan|no plan', 'why.no_plan'),
    (r'valid control|No safe command|all of the .*patience', 'why.no_command'),
    (r'there is no map', 'why.no_map'),
)
_WHYS = tuple((re.compile(pattern, re.IGNORECASE), key) for pattern, key in _WHYS)


def ending(status: int) -> str:
    """The key of a GoalStatus."""
    return ENDINGS.get(status, 'goal.lost')


def why(text: str) -> str:
    """The key of the reason in move_base's words: reason.NAME where the safety gate gave the goal up, else why.NAME."""
    state, reason = gate(text.removeprefix('Goal aborted: '))
    if reason:
        return f'reason.{reason}'
    if state:
        return 'why.gate'
    return next((key for pattern, key in _WHYS if pattern.search(text)), 'why.unknown')


def reset(text: str) -> str:
    """The key of why the gate does not release the emergency stop."""
    if 'still pressed' in text:
        return 'error.reset_pressed'
    return 'error.reset_command' if 'no command' in text else 'error.reset_moving'
