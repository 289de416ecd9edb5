"""Whether a robot gets on to its goal."""

from __future__ import annotations

from sara_common.planar import Pose2D, is_apart

MOVED, TURNED = 0.4, 0.8
"""m and rad from everywhere it has been on its way that are progress: a robot that goes to and fro makes none."""


class Progress:
    """Of a robot that sets out at a time (s) from a pose."""

    def __init__(self, now: float, pose: Pose2D) -> None:
        self._since, self._been = now, [pose]

    def none_for(self, now: float, pose: Pose2D) -> float:
        """s for which it has been nowhere new, at a pose now (s)."""
        if all(is_apart(there, pose, MOVED, TURNED) for there in self._been):
            self._since = now
            self._been.append(pose)
        return now - self._since
