"""The chair's chips with nobody to drive the chair: what `i2c_bus.demo` hands out."""

from __future__ import annotations

import numpy as np

from sara_sim.chips.sensor_box import SensorBox
from sara_sim.config import ChairConfig, DrawnChair
from sara_sim.world.world import World

STEP_S = 0.01
LONGEST_CATCH_UP_S = 5.0  # a program that looked away for longer has missed it
ROOM_CELLS = 80


class RestingChips:
    """A `SensorBox` at rest in the middle of a room of 4 x 4 m."""

    def __init__(self, seed: int, now: float):
        """`now`: s, the clock's reading at power-up."""
        walls = np.zeros((ROOM_CELLS, ROOM_CELLS), bool)
        walls[[0, -1], :] = walls[:, [0, -1]] = True
        world, config = World(walls), ChairConfig()
        drawn, imu, sonar, _ = (np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(4))
        middle = 0.5 * ROOM_CELLS * world.resolution
        self.box = SensorBox(
            world, config, DrawnChair.draw(config, drawn), imu, sonar, lambda: (middle, middle, 0.0), STEP_S
        )
        self._start, self._steps = now, 0

    def advance(self, now: float) -> None:
        """Bring the chips up to `now` (s)."""
        due = int((now - self._start) / STEP_S)
        if due - self._steps > LONGEST_CATCH_UP_S / STEP_S:
            self._steps = due - int(LONGEST_CATCH_UP_S / STEP_S)
        while self._steps < due:
            self._steps += 1
            self.box.rest(self._steps * STEP_S)
