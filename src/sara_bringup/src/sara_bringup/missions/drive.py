"""One drive as it was recorded: the true, the fused and the odometry path, and what was asked at each corner.

Lockstep runs and drives over ROS fill the same object, so that one report serves both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sara_common.planar import between, compose, wrap


def pose_at(t: float, poses: Sequence[tuple[float, tuple[float, float, float]]]) -> tuple[float, float, float] | None:
    """Return the pose (x, y, yaw), m and rad, at ``t`` (s), interpolated between the two about it of ``poses``, each
    with its time (s), oldest first; before and after them all the nearest one; None where there is none.
    """
    after = None
    for time, pose in reversed(poses):
        if time < t:
            return between(pose, after[1], (t - time) / (after[0] - time)) if after else pose
        after = time, pose
    return after and after[1]


@dataclass(frozen=True)
class Corner:
    """What was asked and what came: poses (x, y, yaw) in the map frame, m and rad; `reached` is move_base's word.

    `given`, `ended`, `judged`: s, when the goal was given, when it ended, and when the poses were taken; NaN where
    nobody noted it.
    """

    asked: tuple
    true: tuple
    estimated: tuple
    odometry: tuple
    reached: bool
    text: str = ''
    given: float = math.nan
    ended: float = math.nan
    judged: float = math.nan

    def position_error(self) -> float:
        """Distance of the true from the asked position, m (NaN without the truth)."""
        return math.hypot(self.true[0] - self.asked[0], self.true[1] - self.asked[1])

    def yaw_error(self) -> float:
        """True minus asked yaw, wrapped, rad (NaN without the truth)."""
        return wrap(self.true[2] - self.asked[2])


@dataclass
class Drive:
    """A recorded drive; `odometry` is given as the odometry says it and shown from the mission's start."""

    name: str
    seed: int
    start: tuple
    ekf: str = 'default'
    corners: list = field(default_factory=list)
    samples: list = field(default_factory=list)  # (t, true, fused, odometry from the start)
    contacts: int = 0

    def add_sample(
        self,
        t: float,
        true: tuple[float, float, float],
        fused: tuple[float, float, float] | None,
        odometry: tuple[float, float, float] | None,
    ) -> None:
        """Keep the poses at time `t` (s); `true` may be None where nobody knows it."""
        self.samples.append((t, true or (math.nan,) * 3, fused, compose(self.start, odometry)))

    def add_corner(
        self,
        asked: tuple[float, float, float],
        reached: bool,
        text: str = '',
        given: float = math.nan,
        ended: float = math.nan,
    ) -> None:
        """Judge a corner by the newest sample; `given`, `ended`: s, of the goal."""
        t, true, fused, odometry = self.samples[-1]
        self.corners.append(Corner(asked, true, fused, odometry, reached, text, given, ended, t))

    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """t (n,), and true, fused, odometry paths (n, 3)."""
        t = np.array([sample[0] for sample in self.samples])
        return (t, *(np.array([sample[k] for sample in self.samples]).reshape(-1, 3) for k in (1, 2, 3)))

    def sim_time(self) -> float:
        """Length of the drive, s."""
        return self.samples[-1][0] - self.samples[0][0] if self.samples else 0.0

    def yaw_error_max(self) -> float:
        """Largest difference of fused and true yaw in the whole drive, rad."""
        _, true, fused, _ = self.arrays()
        return float(np.max(np.abs(wrap(fused[:, 2] - true[:, 2])), initial=0.0))

    def odometry_heading_error(self) -> float:
        """By how much the odometry's turned angle exceeds the true one, as a share of the true one."""
        _, true, _, odometry = self.arrays()
        turned = [np.sum(np.abs(wrap(np.diff(path[:, 2])))) for path in (true, odometry)]
        return float(turned[1] / turned[0] - 1.0) if turned[0] > 0 else math.nan

    def to_file_data(self) -> dict[str, Any]:
        """Everything, samples too, as plain data; `from_file_data` reads it back."""
        return {**vars(self), 'corners': [vars(corner) for corner in self.corners]}

    @classmethod
    def from_file_data(cls, data: dict[str, Any]) -> Drive:
        """The drive that `to_file_data` gave."""

        def corner(entry):
            return Corner(**{key: tuple(value) if isinstance(value, list) else value for key, value in entry.items()})

        return cls(**{**data, 'start': tuple(data['start']), 'corners': [corner(entry) for entry in data['corners']]})

    def to_json(self) -> dict[str, Any]:
        """The drive as plain data, yaw in degrees (`yaw_deg` third in each pose)."""

        def pose(p):
            return [round(p[0], 9), round(p[1], 9), round(math.degrees(p[2]), 9)]

        def plain(value):
            return None if math.isnan(value) else round(value, 9)

        corners = [
            {
                'asked': pose(c.asked),
                'true': pose(c.true),
                'estimated': pose(c.estimated),
                'odometry': pose(c.odometry),
                'reached': c.reached,
                'text': c.text,
            }
            for c in self.corners
        ]
        return {
            'experiment': self.name,
            'seed': self.seed,
            'ekf': self.ekf,
            'sim_time_s': round(self.sim_time(), 9),
            'contacts': self.contacts,
            'yaw_error_max_deg': plain(math.degrees(self.yaw_error_max())),
            'odometry_heading_error': plain(self.odometry_heading_error()),
            'corners': corners,
        }
