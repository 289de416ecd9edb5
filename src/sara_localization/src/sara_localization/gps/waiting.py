"""Fixes that wait until it is known where the robot was, and where on it the antenna is, at their time."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from sara_localization.geometry.rigid import Transform, Vector
from sara_localization.geometry.transforms import Transforms
from sara_localization.gps.fixes import FixData
from sara_localization.gps.track import BRIDGED, Track
from sara_localization.inputs.raw_measurement import Problem

PATIENCE = 1.0
"""s for which a fix waits for what is missing."""
MOST = 1000
_ORIGIN = (0.0, 0.0, 0.0)
LONGEST_ARM = 1e3
"""m from a robot's origin to an antenna."""


class PlacedFix(NamedTuple):
    """A fix, the robot's pose in the world frame at its time, and the antenna's place on the robot (m)."""

    fix: FixData
    pose: Transform
    arm: Vector
    arrived: float

    @property
    def antenna(self) -> Vector:
        """Where in the world frame the antenna was by the robot's pose."""
        return self.pose.apply(self.arm)


class WaitingFixes:
    """First come, first served. `problems`: what was wrong since they were last taken."""

    def __init__(self, transforms: Transforms, track: Track):
        self._transforms, self._track = transforms, track
        self._queue: deque[tuple[FixData, float]] = deque()
        self._without: set[str] = set()  # frames of antennas that were waited for in vain
        self.problems: list[Problem] = []

    def __len__(self) -> int:
        return len(self._queue)

    def clear(self) -> None:
        self._queue.clear()

    def add(self, fix: FixData, now: float) -> None:
        """A fix that came at the time `now` (s)."""
        if len(self._queue) >= MOST:
            self._queue.popleft()
            self._problem('overflow', f'more than {MOST} fixes wait: the oldest are dropped')
        self._queue.append((fix, now))

    def take_problems(self) -> list[Problem]:
        """What was wrong since the last call."""
        found, self.problems = self.problems, []
        return found

    def ready(self, base_frame: str, now: float) -> list[PlacedFix]:
        """The fixes that need not wait any longer at a time (s), but for those that nobody can place."""
        found = []
        while self._queue:
            fix, arrived = self._queue[0]
            patient = 0.0 <= now - arrived <= PATIENCE
            if patient and self._track.ahead(fix.stamp) > 0.0:
                break
            pose = self._track.at(fix.stamp)
            if pose is None:
                self._unplaced(fix)
            else:
                arm = self._arm(fix, base_frame, patient)
                if arm is None:
                    break
                found.append(PlacedFix(fix, pose, arm, arrived))
            self._queue.popleft()
        return found

    def _unplaced(self, fix):
        ahead = self._track.ahead(fix.stamp)
        if self._track.newest is None:
            self._problem('no_odometry', 'fixes are dropped as long as there is no odometry')
        elif ahead > 0.0:
            self._problem(
                'ahead',
                f'a fix is {ahead:.2f} s newer than all odometry: dropped. Does odometry still come, and are clocks '
                'of receiver and odometry the same?',
            )
        else:
            self._problem(
                'too_old',
                f'a fix is more than {BRIDGED:g} s older than the oldest odometry that is known: dropped. Is the '
                "receiver's clock set?",
            )

    def _arm(self, fix, base_frame, patient):
        """The antenna on the robot; None while that is waited for."""
        frame = fix.frame_id.lstrip('/')
        if not frame:
            self._problem(
                'no_frame', f'fixes have no frame_id: the antenna is taken to be at the origin of {base_frame}'
            )
            return _ORIGIN
        found = self._transforms.lookup(base_frame, frame, fix.stamp)
        if found is not None and not all(abs(v) <= LONGEST_ARM for v in found.translation):
            at = ', '.join(f'{v:g}' for v in found.translation)
            self._problem(
                'bad_antenna', f'{frame} is at {at} m of {base_frame}: the antenna is taken to be at its origin'
            )
            return _ORIGIN
        if found is not None:
            self._without.discard(frame)
            return found.translation
        if patient and frame not in self._without:
            return None
        self._without.add(frame)
        self._problem(
            'no_antenna',
            f'no transform {base_frame} -> {frame}: the antenna is taken to be at the origin of {base_frame}',
        )
        return _ORIGIN

    def _problem(self, kind, sentence):
        self.problems.append(Problem(kind, sentence))
