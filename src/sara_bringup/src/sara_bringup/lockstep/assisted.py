"""Shared control in lockstep: between multiplexer and safety gate, as its node stands there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sara_control.assist.local_grid import LocalGrid
from sara_nav.costmaps.costmap import LETHAL

if TYPE_CHECKING:
    from sara_bringup.lockstep.lockstep import Lockstep
    from sara_control.assist.shared_control import Assisted as Command
    from sara_control.assist.shared_control import SharedControl
    from sara_control.mux.mux import SelectedCommand


class Assisted:
    """Puts a SharedControl into a Lockstep. Its grid is move_base's local costmap, the lethal cells, as often as that
    is updated; its pose that of `base_link` in the costmap's frame.

    `command`: the law's newest, None before the first.
    """

    def __init__(self, lockstep: Lockstep, law: SharedControl) -> None:
        self.law, self.command = law, None
        self._lockstep, self._given = lockstep, None
        lockstep.wheels.assist = self.on_command

    def on_command(self, selected: SelectedCommand, now: float) -> tuple[float, float]:
        """What is driven (m/s, rad/s) for what the multiplexer selected; other sources than those assisted pass."""
        if selected.source not in self.law.config.sources:
            self.law.let_go()
            return selected.v, selected.w
        self._give_grid()
        lockstep = self._lockstep
        command: Command = self.law.step(
            now, (selected.v, selected.w), lockstep.local_pose, lockstep.localization.velocity or (0.0, 0.0)
        )
        self.command = command
        return command.v, command.w

    def _give_grid(self):
        """Hand over the local costmap where it is another one than before."""
        costmap = self._lockstep.move_base.local_costmap
        stamp = costmap.updated_at
        if stamp is None or stamp == self._given:
            return
        self._given, geometry = stamp, costmap.geometry
        blocked = np.equal(costmap.costmap.costs, LETHAL)
        self.law.on_grid(LocalGrid(blocked, geometry.resolution, geometry.origin_x, geometry.origin_y), stamp)
