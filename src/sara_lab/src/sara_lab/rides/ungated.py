"""A chair without a safety gate, to compare with: the rider's profile alone stands between command and wheels."""

from __future__ import annotations

from sara_control.gate.guard import Guard
from sara_control.gate.reasons import Reason, State
from sara_control.gate.safety import LONGEST_STEP, Decision


class Ungated(Guard):
    """A Guard that minds no range, no contact and no fault: it is as fast as commanded, within the profile's limits of
    speed, acceleration and jerk, and stands where commands have ceased or the chair obeys somebody else.
    """

    _last = None  # s, of the step before

    def step(self, t: float) -> Decision:
        """See Guard."""
        command, comfort = self._command, self.comfort
        fresh = command is not None and t - command.stamp <= self.config.gate.command_timeout
        dt = 0.0 if self._last is None else min(max(t - self._last, 0.0), LONGEST_STEP)
        self._last = t
        if self._pc_drives is not True:
            comfort.rest()
            return Decision(0.0, 0.0, State.MANUAL, Reason.UNKNOWN_DRIVER, False)
        comfort.step(*((command.v, command.w) if fresh else (0.0, 0.0)), dt)
        return Decision(comfort.v, comfort.w, State.DRIVING if comfort.moving else State.IDLE, None, False)
