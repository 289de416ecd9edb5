"""What the planners did, on the topics of the C++ planners: plans, clouds of costs, potentials. Built only for
listeners.
"""

from typing import Any

import numpy as np
import rospy
from nav_msgs.msg import OccupancyGrid, Path
from sensor_msgs.msg import PointCloud2

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.ros import conversions as conv

COSTS = ('x', 'y', 'z', 'path_cost', 'goal_cost', 'occ_cost', 'total_cost')
TRAJECTORIES = ('x', 'y', 'z', 'theta', 'cost')
UNREACHED = 1e9
"""Potentials from here on mean that the wave did not come."""


def short_name(planner: Any) -> str:
    """Return the name that a planner's parameters and topics are under: the last part of what it is asked for by."""
    return planner.plugin_name.split('/')[-1]


class PlannerTopics:
    """The topics of one pair of planners. frame: the global frame, that of plans and potentials; local_frame: the local
    costmap's, that of clouds."""

    def __init__(self, global_planner: Any, local_planner: Any, frame: str, local_frame: str):
        self._global, self._local = global_planner, local_planner
        self._frame, self._local_frame = frame, local_frame
        here, there = f'~{short_name(global_planner)}/', f'~{short_name(local_planner)}/'
        self._plan = rospy.Publisher(here + 'plan', Path, queue_size=1, latch=True)
        self._global_plan = rospy.Publisher(there + 'global_plan', Path, queue_size=1)
        self._local_plan = self._clouds = self._potential = None
        self._shown = None
        if hasattr(local_planner, 'local_plan'):
            self._local_plan = rospy.Publisher(there + 'local_plan', Path, queue_size=1)
        self._clouds = [
            (rospy.Publisher(there + name, PointCloud2, queue_size=1), name, columns)
            for name, columns, asked in (
                ('cost_cloud', COSTS, 'publish_cost_grid_pc'),
                ('trajectory_cloud', TRAJECTORIES, 'publish_traj_pc'),
            )
            if hasattr(type(local_planner), name) and getattr(local_planner.config, asked, True)
        ]
        config = global_planner.config
        if getattr(config, 'visualize_potential', False):
            self._potential = rospy.Publisher(here + 'potential', PointCloud2, queue_size=1)
        elif hasattr(config, 'publish_potential'):
            self._potential = rospy.Publisher(here + 'potential', OccupancyGrid, queue_size=1)

    def close(self) -> None:
        """Take the topics down."""
        for publisher in [self._plan, self._global_plan, self._local_plan, self._potential] + [
            c[0] for c in self._clouds
        ]:
            if publisher is not None:
                publisher.unregister()

    def publish_plan(self, plan: np.ndarray, costmap: Costmap, stamp: rospy.Time) -> None:
        """Publish a new plan (n, 3), and the potential it came from where the planner keeps it."""
        self._shown = plan
        self._plan.publish(conv.path_to_msg(plan, self._frame, stamp))
        if _heard(self._potential) and getattr(self._global, 'potential', None) is not None:
            self._publish_potential(self._global.potential, costmap.geometry, stamp)

    def publish_cycle(self, pose: Pose2D, reach: float, stamp: rospy.Time) -> None:
        """Publish what the local planner works with: the plan ahead of the pose within ``reach`` (m), its own plan, its
        costs.
        """
        if _heard(self._global_plan) and self._shown is not None:
            off = np.hypot(self._shown[:, 0] - pose.x, self._shown[:, 1] - pose.y)
            ahead = np.arange(len(off)) >= off.argmin()
            self._global_plan.publish(conv.path_to_msg(self._shown[ahead & (off <= reach)], self._frame, stamp))
        if _heard(self._local_plan) and self._local.local_plan is not None:
            self._local_plan.publish(conv.path_to_msg(self._local.local_plan, self._frame, stamp))
        for publisher, name, columns in self._clouds:
            points = getattr(self._local, name) if _heard(publisher) else None
            if points is not None:
                publisher.publish(conv.cloud_to_msg(points, columns[: points.shape[1]], self._local_frame, stamp))

    def _publish_potential(self, potential, geometry, stamp):
        reached = potential < UNREACHED
        highest = float(potential[reached].max(initial=0.0))
        if not getattr(self._global.config, 'visualize_potential', False):
            if not self._global.config.publish_potential:
                return
            scaled = np.full(potential.shape, -1, np.int8)
            if highest > 0.0:
                scaled[reached] = (potential[reached] * (self._global.config.publish_scale / highest)).astype(np.int8)
            self._potential.publish(conv.grid_to_msg(scaled, geometry, 0.0, self._frame, stamp))
            return
        rows, columns = np.nonzero(reached)
        values = potential[rows, columns]
        height = values * (20.0 / highest) if highest > 0.0 else values
        self._potential.publish(
            conv.cloud_to_msg(
                np.column_stack(
                    [
                        geometry.origin_x + columns * geometry.resolution,
                        geometry.origin_y + rows * geometry.resolution,
                        height,
                        values,
                    ]
                ),
                ('x', 'y', 'z', 'pot'),
                self._frame,
                stamp,
            )
        )


def _heard(publisher):
    return publisher is not None and publisher.get_num_connections() > 0
