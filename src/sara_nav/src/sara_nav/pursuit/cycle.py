"""What a control cycle of RotateThenPursue begins with."""

from typing import NamedTuple

from sara_common.planar import Pose2D
from sara_nav.grids.collision import LocalWorld
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig


class Cycle(NamedTuple):
    """t, dt: s. pose: as measured; now: where the robot will be when this cycle's command takes effect. velocity:
    measured, last: commanded last (v m/s, w rad/s). turn_gain: turn rate driven over commanded. still: the robot has
    stood for settle_time. driven: speed (m/s) that the last command makes of the robot.
    """

    t: float
    dt: float
    pose: Pose2D
    now: Pose2D
    velocity: tuple[float, float]
    last: tuple[float, float]
    turn_gain: float
    still: bool
    driven: float
    world: LocalWorld

    def drives(self, config: RotateThenPursueConfig) -> bool:
        """True where the robot must come to rest before it turns in place."""
        return self.last[0] != 0.0 or abs(self.velocity[0]) > 2.0 * config.trans_stopped_vel
