"""The laser scanner in lockstep: its sweeps to the safety gate, and to the obstacle layers of move_base's costmaps as
their ROS shell places them with tf, which is known where odometry has come.
"""

from __future__ import annotations

from collections import deque
from itertools import pairwise
from typing import TYPE_CHECKING

from sara_common.planar import between, compose, quaternion_from_yaw
from sara_common.scans import shares_of, swept
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.observations import Observation, scan_rays
from sara_sim.chips.scanner import Optics, Scan, sweep_of

if TYPE_CHECKING:
    from sara_control.gate.guard import Guard
    from sara_nav.move_base.state_machine import MoveBase

TRANSPORT_STEPS = 2  # from the sweep's end to those who listen, of 10 ms
KEPT = 50  # odometry poses


class ScanFeeds:
    """Gives sweeps to the Guard, and to what listens to `/scan` in both costmaps of a MoveBase. `optics`: the
    scanner's; `mount`: its (x, y, yaw) in `base_link`, m, rad.
    """

    def __init__(self, move_base: MoveBase, guard: Guard, optics: Optics, mount: tuple[float, float, float]) -> None:
        self._guard, self._optics, self._mount = guard, optics, mount
        self._under_way, self._waiting, self._poses = deque(), deque(), deque(maxlen=KEPT)
        self._listeners = []  # (layer, its source, whether its costmap is in odom)
        for costmap in (move_base.global_costmap, move_base.local_costmap):
            for layer in costmap.layers.values():
                if isinstance(layer, ObstacleLayer):
                    frame = costmap.config.global_frame == 'odom'
                    self._listeners += [(layer, source, frame) for source in layer.config.sources]

    def on_odometry(self, stamp: float, odometry: tuple, map_from_odom: tuple | None) -> None:
        """odom -> base_link (x, y, yaw) at stamp (s), and map -> odom, None before it is known."""
        self._poses.append((stamp, odometry, map_from_odom))

    def step(self, now: float, scan: Scan | None) -> None:
        """A sweep that has just ended, or None; what is due is handed on."""
        if scan is not None:
            self._under_way.append((now + TRANSPORT_STEPS * 0.01 - 1e-9, sweep_of(scan, self._optics)))
        while self._under_way and self._under_way[0][0] <= now:
            sweep = self._under_way.popleft()[1]
            self._guard.on_scan(now, sweep)
            self._waiting.append(sweep)
        while (
            self._waiting and self._poses and self._poses[-1][0] >= self._waiting[0].stamp + self._waiting[0].duration
        ):
            self._observe(self._waiting.popleft())

    def _observe(self, sweep):
        """Give a sweep to the costmaps' layers."""
        for layer, source, in_odom in self._listeners:
            ends = [self._scanner_at(sweep.stamp + after, in_odom) for after in (0.0, sweep.duration)]
            if None in ends:
                continue
            angles, limits = (sweep.angle_min, sweep.angle_increment), (sweep.range_min, sweep.range_max)
            points, rays = scan_rays(sweep.ranges, angles, limits, source.inf_is_valid)
            points = swept(points, shares_of(rays, len(sweep.ranges)), *ends)
            layer.add_observation(Observation(source.name, sweep.stamp, ends[0][0], points))

    def _scanner_at(self, t, in_odom):
        """(translation, quaternion) of the scanner at t (s) in odom or map, None where odometry does not reach."""
        for (before, a, _), (then, b, map_from_odom) in pairwise(self._poses):
            if before <= t <= then:
                pose = between(a, b, (t - before) / max(then - before, 1e-9))
                if not in_odom:
                    if map_from_odom is None:
                        return None
                    pose = compose(map_from_odom, pose)
                x, y, yaw = compose(pose, self._mount)
                return (x, y, 0.0), quaternion_from_yaw(yaw)
        return None
