"""fake_localization: a pose that is true by definition, in the place of one that is estimated.

The simulator's true pose, moved by an offset, is told as the pose in the map, and map -> odom is what makes the
odometry's frame agree with it. The offset begins at (-delta_x, -delta_y, -delta_yaw); a new pose given by the user
changes it so that the robot is there from then on. Interface: fake_localization of the ROS navigation stack.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sara_common.config import ConfigError
from sara_localization.config.parameters import ParameterReader
from sara_localization.geometry.rigid import Transform, normalised
from sara_localization.geometry.stamps import later
from sara_localization.inputs.data import PoseData, StampedTransform


@dataclass(frozen=True)
class FakeConfig:
    """Frames without a leading slash; delta_* (m, rad): the true pose's frame seen from the map; tolerance in s."""

    odom_frame_id: str = 'odom'
    base_frame_id: str = 'base_link'
    global_frame_id: str = 'map'
    delta_x: float = 0.0
    delta_y: float = 0.0
    delta_yaw: float = 0.0
    transform_tolerance: float = 0.1
    relay_set_pose: bool = False
    warnings: tuple[str, ...] = ()

    @classmethod
    def from_params(cls, params: dict[str, object]) -> FakeConfig:
        """From a dictionary of parameters; raises ConfigError with every fault that was found."""
        reader = ParameterReader(params)
        values = {
            name: reader.frame(name, getattr(cls, name))
            for name in ('odom_frame_id', 'base_frame_id', 'global_frame_id')
        }
        if len(set(values.values())) < 3:
            reader.faults.append(
                'odom_frame_id, base_frame_id and global_frame_id must differ; they are {}.'.format(
                    ', '.join(values.values())
                )
            )
        values.update({name: reader.number(name, 0.0) for name in ('delta_x', 'delta_y', 'delta_yaw')})
        values['transform_tolerance'] = reader.number('transform_tolerance', cls.transform_tolerance, low=0.0)
        values['relay_set_pose'] = reader.boolean('relay_set_pose', False)
        unknown = tuple(f'{name} is no parameter of fake_localization: ignored.' for name in sorted(reader.left))
        if reader.faults:
            raise ConfigError(reader.faults, unknown)
        return cls(warnings=unknown, **values)


@dataclass(frozen=True)
class FakeOutput:
    """pose: map_from_base at `stamp` (s); transform: map -> odom to be broadcast, dated ahead by the tolerance."""

    stamp: float
    pose: Transform
    transform: StampedTransform


class FakeLocalization:
    """The offset between the true pose's frame and the map, and what follows from it."""

    def __init__(self, config: FakeConfig):
        self.config = config
        self.offset = Transform.from_xyz_rpy(-config.delta_x, -config.delta_y, 0.0, 0.0, 0.0, -config.delta_yaw)
        self._newest: Transform | None = None

    def on_ground_truth(self, stamp: float, truth: Transform, odom_from_base: Transform) -> FakeOutput:
        """The true pose at a stamp (s), and where the odometry has the robot at that time."""
        map_from_base = self.offset @ truth
        self._newest = map_from_base
        config = self.config
        transform = StampedTransform(
            later(stamp, config.transform_tolerance),
            config.global_frame_id,
            config.odom_frame_id,
            map_from_base @ odom_from_base.inverse(),
        )
        return FakeOutput(stamp, map_from_base, transform)

    def on_initial_pose(self, data: PoseData) -> str | None:
        """The robot is to be at this pose of the map from now on; returns a sentence where that is refused."""
        frame = data.frame_id.lstrip('/')
        if frame != self.config.global_frame_id:
            return f'initialpose is in the frame "{frame}": ignored; it must be in {self.config.global_frame_id}.'
        if not all(math.isfinite(v) for v in (*data.position, *data.orientation)):
            return 'initialpose holds something that is not a number: ignored.'
        if self._newest is None:
            return 'initialpose is ignored: no true pose has come yet.'
        try:
            wanted = Transform(tuple(data.position), normalised(data.orientation))
        except ValueError as error:
            return f'initialpose is ignored: {error}.'
        delta = wanted @ self._newest.inverse()
        self.offset = delta @ self.offset
        self._newest = wanted
        return None


def true_pose(position: tuple[float, ...], orientation: tuple[float, ...]) -> Transform | None:
    """The Transform of a true pose, or None where it holds what is no number or no rotation."""
    if not all(math.isfinite(v) for v in position):
        return None
    try:
        return Transform(tuple(position), normalised(orientation))
    except ValueError:
        return None
