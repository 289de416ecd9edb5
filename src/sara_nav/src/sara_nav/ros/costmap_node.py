"""The ROS side of a costmap: what its layers listen to, what it publishes, what can be changed while it runs.

It has no thread of its own: move_base's loop takes in what came, updates the costmap and has the changes published. The
node ``costmap_2d_node`` does the same with nothing else around, to look at a costmap by itself.
"""

import dataclasses
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import rospy
import tf2_ros

from sara_common.config import ConfigError
from sara_common.diagnostics import OK, WARN
from sara_common.planar import Pose2D
from sara_common.ros.diagnostics import Diagnostics
from sara_common.ros.node import start_node
from sara_common.ros.reconfigure import Reconfigure
from sara_nav.config.parameters import Parameters
from sara_nav.costmaps.costmap_settings import CostmapSettings, read_costmap
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.grids.footprint import FootprintError, circle_footprint, pad_footprint, parse_footprint
from sara_nav.ros import conversions as conv
from sara_nav.ros.common import TransformListener, move_parameters
from sara_nav.ros.costmap_inputs import CostmapInputs, FootprintInput
from sara_nav.ros.costmap_publisher import CostmapPublisher

LIMITS = {
    'transform_tolerance': (0.0, 10.0),
    'update_frequency': (0.0, 100.0),
    'publish_frequency': (0.0, 100.0),
    'width': (0.0, 1e6),
    'height': (0.0, 1e6),
    'resolution': (0.0, 50.0),
    'robot_radius': (0.0, 10.0),
    'inflation_radius': (0.0, 50.0),
    'cost_scaling_factor': (0.0, 100.0),
    'max_obstacle_height': (0.0, 50.0),
    'inflate_cone': (0.0, 1.0),
    'no_readings_timeout': (0.0, 1e6),
    'clear_threshold': (0.0, 1.0),
    'mark_threshold': (0.0, 1.0),
    'lethal_override_cost': (0.0, 252.0),
}
WHOLE = ('width', 'height')
"""Whole numbers of metres to clients, as in the peer's cfg file; a YAML may say 7.5."""
DYNAMIC = (
    'transform_tolerance',
    'update_frequency',
    'publish_frequency',
    'width',
    'height',
    'resolution',
    'origin_x',
    'origin_y',
    'footprint',
    'robot_radius',
    'footprint_padding',
)
DYNAMIC_OF_LAYERS = (
    'enabled',
    'footprint_clearing_enabled',
    'max_obstacle_height',
    'combination_method',
    'inflation_radius',
    'cost_scaling_factor',
    'inflate_unknown',
    'phi',
    'inflate_cone',
    'no_readings_timeout',
    'clear_threshold',
    'mark_threshold',
    'clear_on_max_reading',
    'override_lethal_cost',
    'lethal_override_cost',
)
"""The fields of the peers' cfg files."""


@dataclass(frozen=True)
class Tunable(CostmapConfig):
    """What dynamic_reconfigure changes of a costmap: its configuration and the footprint's three parameters."""

    footprint: str = '[]'
    robot_radius: float = 0.46
    footprint_padding: float = 0.01

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = super().faults()
        try:
            self.corners()
        except FootprintError as error:
            result.append(str(error))
        return result

    def corners(self) -> np.ndarray:
        """Return the unpadded corners (k, 2); raises FootprintError."""
        if self.footprint not in ('', '[]'):
            return parse_footprint(self.footprint)
        return circle_footprint(self.robot_radius)


class CostmapShell:
    """Around one LayeredCostmap. settings: CostmapSettings; tf: TransformListener; lock: held by whoever changes or
    reads the costmap in another thread than the loop's (a reentrant one); on_tolerance: called with another
    transform_tolerance (s), returns '' or why it is refused.
    """

    def __init__(
        self,
        settings: CostmapSettings,
        costmap: LayeredCostmap,
        tf: TransformListener,
        lock: Any = None,
        on_tolerance: Callable[[float], str] = lambda _: '',
    ):
        self.costmap, self._on_tolerance = costmap, on_tolerance
        self.name = settings.prefix.rstrip('/')
        self.lock = lock or threading.RLock()
        self.pose_problem = ''
        self._unpadded, self._padding = settings.unpadded, settings.footprint_padding
        self._tf = tf
        self.inputs = CostmapInputs(self.name, costmap, tf)
        self._footprints = FootprintInput(f'~{self.name}/{settings.footprint_topic}')
        self._publisher = CostmapPublisher(self.name, costmap, settings.published_footprint_topic, self.lock)
        self._tuned = Tunable(
            **dataclasses.asdict(costmap.config),
            footprint_padding=float(self._padding),
            footprint='[]' if settings.robot_radius is not None else str(self._unpadded.tolist()),
            robot_radius=0.46 if settings.robot_radius is None else settings.robot_radius,
        )
        self._servers = [
            Reconfigure(self.name, self._tuned, LIMITS, self._on_costmap, DYNAMIC, WHOLE, settings.elsewhere)
        ] + [self._tune_layer(layer) for layer in costmap.layers.values()]

    # -- what the loop calls -----------------------------------------------------------------------------------

    def take_in(self, now: rospy.Time) -> None:
        """Hand to the layers what came by ``now`` (rospy.Time)."""
        with self.lock:
            corners = self._footprints.take()
            if corners is not None:
                self._take_footprint(corners)
            self.inputs.take_in(now.to_sec())

    def publish(self, window: tuple | None, pose: Pose2D | None, now: rospy.Time) -> None:
        """Publish after an update at ``now`` (rospy.Time) that changed ``window`` (or None) around the robot's pose."""
        self._publisher.updated(window, pose, now)

    def update(self, now: rospy.Time) -> bool:
        """Take in, update the costmap if that is due, and publish; returns True when it was updated."""
        self.take_in(now)
        if not self.costmap.due(now.to_sec()):
            return False
        pose, _ = self.robot_pose(now)
        if pose is None and self.costmap.config.rolling_window:
            return False
        with self.lock:
            window = self.costmap.update(now.to_sec(), pose)
        self.publish(window, pose, now)
        return True

    def robot_pose(self, now: rospy.Time) -> tuple[Pose2D | None, float | None]:
        """Return (Pose2D, stamp s or None) of the robot in the costmap's frame; (None, None) when there is none
        fresh.
        """
        config = self.costmap.config
        try:
            msg = self._tf.latest(config.global_frame, config.robot_base_frame)
            pose = conv.pose_from_transform(msg.transform)
        except (ValueError, tf2_ros.TransformException) as error:
            self.pose_problem = str(error)
            return None, None
        stamp = None if msg.header.stamp.is_zero() else msg.header.stamp.to_sec()
        if stamp is not None and now.to_sec() - stamp > config.transform_tolerance:
            self.pose_problem = (
                f'the transform {config.global_frame} -> {config.robot_base_frame} is '
                f'{now.to_sec() - stamp:.2f} s old, transform_tolerance is '
                f'{config.transform_tolerance:.2f} s'
            )
            return None, None
        self.pose_problem = ''
        return pose, stamp

    def time_went_back(self) -> None:
        """The clock was set back: messages that wait for a transform are forgotten."""
        self.inputs.time_went_back()

    def current(self, t: float) -> str:
        """Return '' or what the costmap waits for or misses at ``t`` (s)."""
        text = self.costmap.current(t)
        return f'{self.name}: {text}' if text else ''

    def values(self) -> dict[str, int]:
        """Return counts for /diagnostics."""
        return dict(
            self.inputs.values(),
            **{
                self.name + '/bad_poses': self.costmap.bad_poses,
                self.name + '/cells_computed': self.costmap.cells_computed,
            },
        )

    # -- changes while running ---------------------------------------------------------------------------------

    def _take_footprint(self, corners):
        try:
            self._set_footprint(parse_footprint(corners), self._padding)
        except FootprintError as error:
            self.inputs.counts['bad_footprints'] += 1
            rospy.logwarn('%s: a footprint was dropped: %s', self.name, error)

    def _set_footprint(self, unpadded, padding):
        self._unpadded, self._padding = unpadded, padding
        self.costmap.set_footprint(pad_footprint(unpadded, padding))

    def _on_costmap(self, new):
        try:
            with self.lock:
                other = new.transform_tolerance != self._tuned.transform_tolerance
                refused = self._on_tolerance(new.transform_tolerance) if other else ''
                if refused:
                    return refused
                old, self._tuned = self._tuned, new
                if (new.footprint, new.robot_radius) != (old.footprint, old.robot_radius):
                    self._set_footprint(new.corners(), new.footprint_padding)
                elif new.footprint_padding != self._padding:
                    self._set_footprint(self._unpadded, new.footprint_padding)
                self.costmap.reconfigure(
                    CostmapConfig(
                        **{field.name: getattr(new, field.name) for field in dataclasses.fields(CostmapConfig)}
                    )
                )
        except ValueError as error:
            return str(error)
        return ''

    def _tune_layer(self, layer):
        def change(new):
            try:
                with self.lock:
                    layer.reconfigure(new)
            except ValueError as error:
                return str(error)
            return ''

        return Reconfigure(f'{self.name}/{layer.name}', layer.config, LIMITS, change, DYNAMIC_OF_LAYERS)


def main() -> None:
    """Run one costmap, named ``costmap``, until ROS shuts down; exit status 1 when its parameters cannot be used."""
    start_node('costmap_2d_node')
    tree = rospy.get_param('~', {})
    parameters = Parameters(tree if isinstance(tree, dict) else {})
    settings = read_costmap(parameters, 'costmap/')
    try:
        parameters.check()
    except ConfigError as error:
        rospy.logfatal('costmap_2d_node cannot start: %s', error)
        sys.exit(1)
    for warning in parameters.warnings + parameters.left_over():
        rospy.logwarn('%s', warning)
    move_parameters(parameters)
    tf = TransformListener()
    shell = CostmapShell(settings, settings.make(), tf)
    diagnostics, told_at = Diagnostics('costmap'), None
    rate = rospy.Rate(max(10.0, settings.config.update_frequency))
    while not rospy.is_shutdown():
        now = rospy.Time.now()
        shell.update(now)
        if told_at is None or not 0.0 <= (now - told_at).to_sec() < 1.0:
            told_at = now
            text = shell.current(now.to_sec()) or shell.pose_problem
            if text:
                rospy.loginfo_throttle(5.0, 'waiting: %s', text)
            diagnostics.publish(WARN if text else OK, text or 'up to date', shell.values())
        try:
            rate.sleep()
        except rospy.ROSTimeMovedBackwardsException:
            tf.buffer.clear()  # else what comes now is older than what it holds, and dropped
            shell.time_went_back()
            rate = rospy.Rate(max(10.0, settings.config.update_frequency))
        except rospy.ROSInterruptException:
            break
