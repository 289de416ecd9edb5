"""Whether the robot is lost, by the probability that its localization publishes; a goal waits meanwhile.

The verdict has hysteresis: lost from ``lost_limit`` on, found again at ``found_limit``. A localization that was to say
and is silent counts as lost, for nobody vouches for the pose then.
"""

from __future__ import annotations

from sara_nav.goals.move_base_config import MoveBaseConfig

SILENCE = 3.0
"""Seconds after which a probability is too old; it is to come once a second."""
HELP = 'I may be lost. Please tell me where I am, or drive me a little.'


class LostWatch:
    """Keeps the newest probability. ``probability``: 0 to 1, None: none came; ``lost``: the verdict."""

    def __init__(self) -> None:
        self.probability: float | None = None
        self.lost = False
        self._heard_at = 0.0

    def hear(self, probability: float, t: float, lost_limit: float, found_limit: float) -> str:
        """A probability came at t (s). Returns '' or why it is dropped."""
        if not 0.0 <= probability <= 1.0:
            return f'a probability of being lost of {probability!r} is dropped: allowed is 0 to 1'
        self.probability, self._heard_at = probability, t
        self.lost = probability > found_limit if self.lost else probability >= lost_limit
        return ''

    def forget(self) -> None:
        """Time went back: what was heard before means nothing."""
        self.probability, self.lost = None, False

    def silent(self, t: float) -> bool:
        """Whether nothing came within SILENCE before t (s)."""
        return self.probability is None or t - self._heard_at > SILENCE

    def doubt(self, t: float, config: MoveBaseConfig) -> str:
        """Why the pose is not to be driven on at t (s), '' where it is, or where ``lost_topic`` is ''."""
        if not config.lost_topic:
            return ''
        if self.silent(t):
            return f'nobody says whether the robot is lost: {config.lost_topic} has been silent for {SILENCE:.0f} s'
        if self.lost:
            return f'the robot is probably lost ({self.probability:.2f} on {config.lost_topic})'
        return ''

    def help(self, t: float) -> str:
        """What a person is asked for while there is a doubt at t (s)."""
        return HELP if self.lost and not self.silent(t) else ''
