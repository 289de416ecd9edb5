"""From the filter's state to what is published: the estimate, its transform, the angular acceleration."""

from __future__ import annotations

import numpy as np

from sara_localization.config.filter_config import FilterConfig
from sara_localization.filters import motion_model, state_pose
from sara_localization.filters.estimator import Estimator
from sara_localization.filters.state import RATES, SIZE
from sara_localization.geometry.rigid import Transform
from sara_localization.geometry.stamps import later
from sara_localization.inputs.data import FilterOutput, StampedTransform, Turning

# Stamps are float seconds since 1970, which resolve 0.24 us.
CLOCK_RESOLUTION = 1e-6


class Output:
    """What a tick gives, and what must be remembered of the last one.

    missing_transform: the sentence that says which transform the output lacks, or None.
    turning: how the rates changed between the last two ticks, for sensors off the robot's centre.
    """

    def __init__(self, config: FilterConfig, transforms, report):
        motion_model.warm()
        self.config, self.transforms, self._report = config, transforms, report
        self.missing_transform: str | None = None
        self._period = 1.0 / config.frequency
        self.forget()

    def forget(self) -> None:
        """As if nothing had ever been published."""
        self._published_stamp = 0.0
        self._rates, self._rates_time = np.zeros(3), 0.0
        self.turning = Turning(np.zeros(SIZE), np.zeros((SIZE, SIZE)), self._rates, 0.0)

    def at_rest(self) -> None:
        """The robot was put somewhere, at rest."""
        self._rates = np.zeros(3)

    def of(self, kf: Estimator, now: float | None) -> FilterOutput:
        """The estimate of a filter at the time of its state. now: the tick (s), None where nothing was measured in
        it.
        """
        config, stamp, x, P = (
            self.config,
            float(kf.last_measurement_time),
            kf.x[:SIZE].copy(),
            kf.P[:SIZE, :SIZE].copy(),
        )
        if now is not None:
            self._turn(x, P, now)
        fresh = config.permit_corrected_publication or stamp > self._published_stamp
        transform = self._transform(stamp, x) if config.publish_tf and fresh else None
        self._published_stamp = stamp
        return FilterOutput(
            stamp, config.world_frame, config.base_link_frame_output, x, P, transform, fresh, self.turning
        )

    def _turn(self, x, P, now):
        dt, period = now - self._rates_time, self._period
        if abs(dt - period) < CLOCK_RESOLUTION:
            dt = period
        if dt > 0.0:
            self.turning = Turning(x, P, self._rates, dt)
        self._rates, self._rates_time = x[RATES], now

    def world_from_odom(self, output: FilterOutput) -> Transform | None:
        """Where the odometry's frame is by this output, given out or (publish_tf: false) not; None where the world is
        not the map, or not known.
        """
        config = self.config
        if not config.publishes_map_to_odom:
            return None
        if config.publish_tf:
            return output.map_to_odom.transform if output.map_to_odom else None
        stamped = self._transform(output.stamp, output.state) if output.published and not config.invert_tf else None
        return stamped.transform if stamped else None

    def _transform(self, stamp, x) -> StampedTransform | None:
        config, dated = self.config, later(stamp, self.config.transform_time_offset)
        if config.invert_tf:
            return StampedTransform(
                dated, config.base_link_frame_output, config.world_frame, state_pose.pose_of(x).inverse()
            )
        if not config.publishes_map_to_odom:
            return StampedTransform(dated, config.world_frame, config.base_link_frame_output, state_pose.pose_of(x))
        base_from_odom = self.transforms.lookup(config.base_link_frame, config.odom_frame, stamp)
        if base_from_odom is None:
            missing = (
                f'no transform {config.odom_frame} -> {config.base_link_frame}: {config.map_frame} -> '
                f'{config.odom_frame} cannot be published'
            )
            if self.missing_transform is None:
                self._report(missing)
            self.missing_transform = missing
            return None
        self.missing_transform = None
        if config.join_at_odometry_time:
            x = state_pose.earlier(x, self.transforms.age(config.base_link_frame, config.odom_frame, stamp))
        return StampedTransform(dated, config.map_frame, config.odom_frame, state_pose.pose_of(x) @ base_from_odom)
