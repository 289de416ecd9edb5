"""Lockstep with the timing of nodes, for drives that are compared with those over ROS.

Lockstep calls everybody at the same instant with what was heard up to it: the shortest way there is from a sensor to
the wheels. Over ROS timers run at phases that nobody sets, and what is sent in a step of the simulated clock (10 ms),
the others have in the next: a filter that runs when the IMU speaks has not heard it yet. For a turn that ends this
counts, since the IMU tells five times a second how fast it still is: the way to rest takes one to four control cycles
more or fewer. Whoever points out where the chair stands, or sends it somewhere, does so at any moment, too: it is the
moment that decides whether the next odometry pulls that pose back. So all this is drawn as the chair is, by its seed;
what comes of it is part of the spread over the chairs.
"""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

from sara_bringup.lockstep.lockstep import COMMAND_STEPS, FILTER_STEPS
from sara_lab.experiments.drives import Recorded

if TYPE_CHECKING:
    from sara_lab.experiments.courses import Course, SetUp

IDLE_STEPS = 20  # 0.2 s, the period of the slowest sensor


class AsNodes(Recorded):
    """A Recorded whose nodes work at phases of their own, drawn by `seed`, with what was sent until the step before."""

    def __init__(self, course: Course, seed: int, setup: SetUp, gain: float | None) -> None:
        super().__init__(course, seed, setup, gain)
        drawn = random.Random(f'timers of chair {seed}')
        self._idle_steps = drawn.randrange(IDLE_STEPS)
        self._navigation_phase, self._filter_phase, self._command_phase = (
            drawn.randrange(steps) for steps in (self._control_steps, FILTER_STEPS, COMMAND_STEPS)
        )

    def start_up(self) -> None:
        """As Lockstep's; what is asked for next comes a moment later."""
        super().start_up()
        for _ in range(self._idle_steps):
            self.step()

    def step(self) -> None:
        """Advance everything by 10 ms: the nodes in another order than Lockstep's, and what they hear last."""
        self.tick += 1
        frames, now = self.chair.step(), self.chair.time
        if (self.tick + self._navigation_phase) % self._control_steps == 0 and self.navigation_runs:
            self._navigate(now)
        if (self.tick + self._filter_phase) % FILTER_STEPS == 0 and self.localization_runs:
            self._localize(now)
        if (self.tick + self._command_phase) % COMMAND_STEPS == 0:
            self._command(now)
        self._hear(frames)
