"""The two costmaps that move_base drives with: one to plan on, one to steer and look for collisions on."""

from __future__ import annotations

import math

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.layered_costmap import LayeredCostmap
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.windows import Window, around

SAME = Pose2D(0.0, 0.0, 0.0)
AT_A_POINT = np.zeros((1, 2))
"""The footprint of the robot's centre."""


class CostmapPair:
    """The LayeredCostmaps ``world`` (to plan on) and ``local``, updated when they are due."""

    def __init__(self, world: LayeredCostmap, local: LayeredCostmap) -> None:
        self.world, self.local = world, local
        self._changed = {}
        self._to_plan_on = None
        self._at_once = False
        self.world_changes = 0  # how often the costmap that is planned on became another one

    def wake(self) -> None:
        """Have the next ``update`` build both, due or not."""
        self._at_once = True

    def ensure(self, t: float) -> None:
        """Build at t (s) what was never built: then the robot's pose does not matter yet."""
        for costmap in (self.world, self.local):
            if costmap.updated_at is None:
                self.refresh(costmap, t, None)

    def update(self, t: float, pose: Pose2D | None, local_pose: Pose2D | None) -> None:
        """Build what is due at t (s) around the robot's pose (Pose2D or None) in either costmap's frame."""
        for costmap, at in ((self.world, pose), (self.local, local_pose or pose)):
            if self._at_once or costmap.due(t):
                self.refresh(costmap, t, at)
        self._at_once = False

    def refresh(self, costmap: LayeredCostmap, t: float, pose: Pose2D | None) -> None:
        """Build one of the two at t (s), due or not, around the robot's pose (Pose2D or None) in its frame."""
        name = 'global' if costmap is self.world else 'local'
        old, new = self._changed.get(name), costmap.update(t, pose)
        self.world_changes += name == 'global' and new is not None
        if old is not None and new is not None:
            new = around(old, new)
        self._changed[name] = new if new is not None else old

    def let_pass(self, t: float) -> None:
        """Tell all layers that somebody who moves passes the robot at t (s)."""
        for costmap in (self.world, self.local):
            for layer in costmap.layers.values():
                layer.let_pass(t)

    def take_changed(self) -> dict[str, Window | None]:
        """Return the windows (x0, y0, xn, yn) of cells that changed since the last call, by 'global' and 'local'.

        A costmap that was not updated is not among them; one that was without changing has None.
        """
        changed, self._changed = self._changed, {}
        return changed

    def reset(self, t: float, pose: Pose2D | None, local_pose: Pose2D | None) -> None:
        """Forget what sensors have seen, and build both anew."""
        for costmap in (self.world, self.local):
            costmap.reset()
        self.wake()
        self.update(t, pose, local_pose)

    def missing(self) -> str:
        """Return '' or the sentence that says which map has not come yet."""
        for costmap in (self.world, self.local):
            for layer in costmap.map_layers.values():
                problem = layer.stale(0.0) if layer.enabled else ''
                if problem:
                    return problem
        return ''

    def refusal(self, pose: Pose2D, must_fit: bool, unknown_blocks: bool) -> str:
        """Return why a goal (Pose2D) cannot be taken, '' when it can. must_fit: the footprint may overlap nothing
        there.
        """
        if self.missing():
            return f'Goal refused: there is {self.missing()}.'
        if not pose.is_finite():
            return 'Goal refused: it holds a NaN or an infinity.'
        if self.world.geometry.to_cell(pose.x, pose.y) is None:
            return f'Goal refused: ({pose.x:.2f}, {pose.y:.2f}) is off the map.'
        footprint = self.world.footprint if must_fit else AT_A_POINT
        if any(layer.forbids(pose, footprint) for layer in self.world.keepout_layers.values()):
            return f'Goal refused: ({pose.x:.2f}, {pose.y:.2f}) is in a keep-out place, or too near to one.'
        if must_fit and LocalWorld(self.world.costmap, self.world.footprint, unknown_blocks).collides(pose):
            return (
                f'Goal refused: at ({pose.x:.2f}, {pose.y:.2f}, {math.degrees(pose.yaw):.0f} deg) the footprint '
                'would overlap an obstacle, unknown space '
                'or the edge of the map.'
            )
        return ''

    def forget_about(self, pose: Pose2D, t: float) -> None:
        """Forget, in the costmap that is planned on, what sensors saw where a robot at a pose (Pose2D) would stand, and
        build it anew at t (s).
        """
        world = self.world
        reach = world.circumscribed_radius + 2.0 * world.geometry.resolution
        corners = pose.x - reach, pose.y - reach, pose.x + reach, pose.y + reach
        sensors = [name.split('/')[-1] for name in world.layers if name not in world.map_layers]
        world.clear_area(*corners, True, sensors)
        self.refresh(world, t, None)

    def to_plan_on(self, unknown_blocks: bool) -> LocalWorld:
        """Return the LocalWorld of the global costmap, for poses of its frame."""
        world, kept = self.world, self._to_plan_on
        if (
            kept is None
            or kept.costmap is not world.costmap
            or kept.footprint is not world.footprint
            or kept.unknown_blocks != unknown_blocks
        ):
            kept = self._to_plan_on = LocalWorld(world.costmap, world.footprint, unknown_blocks)
        return kept

    def around(self, pose: Pose2D, local_pose: Pose2D | None, unknown_blocks: bool) -> LocalWorld:
        """Return the LocalWorld that poses of the global frame are tried in, on the local costmap."""
        offset = SAME if local_pose is None else local_pose.compose(pose.inverse())
        slow = tuple(layer for layer in self.local.speed_layers.values() if layer.limits)
        return LocalWorld(self.local.costmap, self.local.footprint, unknown_blocks, offset, slow)
