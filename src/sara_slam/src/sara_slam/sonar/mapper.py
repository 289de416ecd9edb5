"""A SonarSlam for a robot in service: its odometry may begin anew, and the map goes on after the program has ended."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

import numpy as np

from sara_common.planar import compose, inverse, wrap
from sara_slam.mapping.journal import Journal
from sara_slam.sonar.doorways import NO_DOORWAYS, Doorways
from sara_slam.sonar.drawing import Pose, Snapshot
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.sonar_slam import WAITING, SonarSlam
from sara_slam.sonar.wall_graph import Solved

FASTEST = 2.0, 3.0
"""m/s and rad/s from which on the odometry has not been driven."""
SLACK = 0.2, 0.2
"""m and rad besides."""
SILENT_S = 15.0
"""s without odometry, from which on it may have begun anew."""
BACK_S = 1.0
"""s by which a clock that goes back has begun anew; less is a pose that comes late."""
KEEP_S = 1.0
"""s of a drive that are written down together."""
NOWHERE: Pose = (0.0, 0.0, 0.0)


class MapperError(ValueError):
    """A journal is not of this program; the message is a sentence."""


class SonarMapper:
    """`slam`: the SonarSlam; `counts`: its, with `joined`: how often the odometry began anew. say: called with one
    sentence per kind of trouble. journal: where everything heard is written down; with what it holds from before, the
    map is gone on with. Where the odometry begins anew, the robot is taken to stand where it stopped.
    """

    def __init__(
        self, config: SonarConfig, say: Callable[[str], None] = lambda sentence: None, journal: Journal | None = None
    ):
        """Raises MapperError."""
        self.slam, self._say, self._journal = SonarSlam(config), say, journal
        self.counts = self.slam.counts
        self._into, self._shift = NOWHERE, 0.0  # of the odometry: its frame, its clock
        self._last: tuple[float, Pose] | None = None  # of that which the SonarSlam heard
        self._resumed = False  # and no odometry has come since
        self._poses: list[tuple[float, ...]] = []
        self._ranges: deque[tuple[float, ...]] = deque(maxlen=WAITING)
        self._names: dict[str, int] = {}
        if journal is not None:
            self._resume(journal.records)

    def _resume(self, records):
        for record in records:
            if record.kind != 'heard':
                raise MapperError('it holds a map that was not made by ultrasonic sensors')
            held = record.arrays
            names = held['names'].tolist()
            for stamp, number, distance, *mount in held['ranges'].tolist():
                self.slam.on_range(stamp, names[int(number)], tuple(mount), distance)
            for stamp, *pose in held['poses'].tolist():
                self.slam.on_pose(stamp, tuple(pose))
                self._last = stamp, tuple(pose)
            *into, self._shift = held['into'].tolist()
            self._into = tuple(into)
        self._resumed = bool(records)
        records.clear()

    @property
    def map_from_odom(self) -> Pose | None:
        """(x, y, yaw) of the odometry's frame in the map. None where a map is gone on with, until the first odometry
        has told whether it began anew.
        """
        return None if self._resumed else compose(self.slam.map_from_odom, self._into)

    @property
    def entropy(self) -> float:
        """Differential entropy of the pose's distribution, nat; -inf before the robot has moved."""
        sign, logarithm = np.linalg.slogdet(self.slam.filter.P[:3, :3])
        return 0.5 * (3.0 * math.log(2.0 * math.pi * math.e) + float(logarithm)) if sign > 0.0 else -math.inf

    def on_pose(self, stamp: float, pose: Pose) -> None:
        """The odometry has the robot at (x, y, yaw) in its frame, at a time (s)."""
        if not (math.isfinite(stamp) and all(map(math.isfinite, pose))):
            self.counts['bad_pose'] += 1
            return
        if self._begins_anew(stamp, pose):
            self._join(stamp, pose)
        self._resumed = False
        stamp, pose = stamp + self._shift, compose(self._into, pose)
        if self._last is not None and stamp <= self._last[0]:
            return
        self._last = stamp, pose
        self.slam.on_pose(stamp, pose)
        self._poses.append((stamp, *pose))
        if stamp - self._poses[0][0] >= KEEP_S:
            self._keep()

    def _begins_anew(self, stamp, pose):
        if self._last is None:
            return False
        past = stamp + self._shift - self._last[0]
        if past < -BACK_S or past > SILENT_S:
            return True
        x, y, yaw = compose(inverse(self._last[1]), compose(self._into, pose))
        way, turn = (SLACK[0] + FASTEST[0] * abs(past), SLACK[1] + FASTEST[1] * abs(past))
        return math.hypot(x, y) > way or abs(wrap(yaw)) > turn

    def _join(self, stamp, pose):
        """The pose is where the last one was."""
        last_stamp, last = self._last
        self._into = compose(last, inverse(pose))
        if stamp + self._shift <= last_stamp:
            self._shift = last_stamp + KEEP_S - stamp
        self.counts['joined'] += 1
        self._say('the odometry begins anew: the robot is taken to stand where it stopped')

    def on_range(self, stamp: float, name: str, mount: Pose, distance: float) -> None:
        """A sensor at a mount (x, y, yaw) in the robot said a range (m, REP-117) at a time (s)."""
        stamp += self._shift
        self.slam.on_range(stamp, name, mount, distance)
        if math.isfinite(stamp) and not math.isnan(distance):
            self._ranges.append((stamp, self._names.setdefault(name, len(self._names)), distance, *mount))

    def _keep(self):
        ranges = np.array(self._ranges).reshape(-1, 6)
        arrays = {'poses': np.array(self._poses), 'ranges': ranges, 'names': np.array(list(self._names), str)}
        self._poses = []
        self._ranges.clear()
        if self._journal is None:
            return
        try:
            self._journal.append('heard', {**arrays, 'into': np.array((*self._into, self._shift))})
        except OSError as error:
            self._journal = None
            self.counts['not_kept'] += 1
            self._say(f'{error}: after a restart the map ends here')

    def snapshot(self) -> Snapshot:
        """What was heard so far, to draw the map of while more is heard."""
        return self.slam.snapshot()

    def settle(self, solved: Solved, doorways: Doorways = NO_DOORWAYS) -> None:
        """Go on with the poses that an earlier snapshot was solved to; doorways: on the map drawn of it."""
        self.slam.settle(solved, doorways)
