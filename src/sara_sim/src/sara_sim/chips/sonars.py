"""What the sonars hear: the nearest echo in each one's cone, with its scatter and the echoes that get lost."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import cos, inf, radians, sin

import numpy as np

from sara_common.planar import Pose2D
from sara_sim.config import ChairConfig
from sara_sim.world.rays import Cone
from sara_sim.world.world import World

_BLOCK = 256


class Sonars:
    """Bursts of the sensors. `extra_sigma`: {name: m} added scatter (a fault)."""

    def __init__(
        self,
        world: World,
        config: ChairConfig,
        mounts: Mapping[str, Pose2D],
        random: np.random.Generator,
        pose: Callable[[], tuple[float, float, float]],
    ):
        """`mounts`: where each sits. `pose`: gives the true (x, y, yaw) of the chair now."""
        self._mounts = mounts
        self._world, self._config, self._random, self._pose = world, config, random, pose
        self._cone = Cone(
            radians(config.sonar_cone / 2), config.sonar_rays, cos(radians(config.sonar_steepest)), config.sonar_limit
        )
        self._errors: list = []
        self._luck: list = []
        self.extra: dict = {}

    def echo(self, name: str) -> float:
        """Distance (m) that the sensor `name` measures now, inf without an echo."""
        # Drawn whether there is an echo or not, so that a wall does not change the luck of what follows.
        if not self._luck:
            self._errors, self._luck = (
                self._random.normal(0.0, self._config.sonar_sigma, _BLOCK).tolist(),
                self._random.random(_BLOCK).tolist(),
            )
        error, luck = self._errors.pop(), self._luck.pop()
        config, mount = self._config, self._mounts[name]
        x, y, yaw = self._pose()
        c, s = cos(yaw), sin(yaw)
        distance = self._world.sonar(
            x + c * mount.x - s * mount.y,
            y + s * mount.x + c * mount.y,
            yaw + mount.yaw,
            self._cone,
        )
        if self.extra and name in self.extra:
            error += self.extra[name]()
        return inf if distance == inf or luck < config.sonar_lost else max(distance + error, 0.0)
