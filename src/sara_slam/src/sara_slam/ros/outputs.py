"""What slam_gmapping and slam_sonar publish: map, map_metadata, keepout_filter_mask, speed_filter_mask, ~entropy,
map -> odom; and how they keep maps. What people draw over the map is shown on it, and kept beside `map_file`, not on
the map that is saved.
"""

from __future__ import annotations

from collections.abc import Callable

import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from std_msgs.msg import Float64
from std_srvs.srv import TriggerResponse
from tf2_msgs.msg import TFMessage

from sara_localization.geometry.rigid import Transform
from sara_localization.geometry.stamps import later
from sara_localization.inputs.data import StampedTransform
from sara_localization.ros import conversions
from sara_localization.ros.shell import publish
from sara_nav.maps import edits
from sara_nav.maps.map_io import GridMap
from sara_nav.maps.map_saver import SaverConfig, save_map
from sara_nav.ros.conversions import grid_to_msg
from sara_nav.ros.map_edits import MapEdits
from sara_slam.mapping.journal import Journal
from sara_slam.mapping.map_output import MapOutput
from sara_slam.mapping.slam import Pose


class Outputs:
    """The publishers. `message`: the OccupancyGrid that was published last, None before the first. Raises EditsError
    where the edits beside `map_file` cannot be read.
    """

    def __init__(self, config: MapOutput):
        self._config, self.message, self._drawn = config, None, None
        self._sent = None
        self._transform = rospy.Publisher('/tf', TFMessage, queue_size=100, tcp_nodelay=True)
        self._map = rospy.Publisher('map', OccupancyGrid, queue_size=1, latch=True)
        self._metadata = rospy.Publisher('map_metadata', MapMetaData, queue_size=1, latch=True)
        self._entropy = rospy.Publisher('~entropy', Float64, queue_size=1, latch=True)
        self._edits = MapEdits(config.map_frame, lambda: self.map(*self._drawn))
        self._edits.read(edits.beside(f'{config.map_file}.yaml') if config.map_file else None)
        self._edits.serve()

    def transform(self, now: float, map_from_odom: Pose | None) -> None:
        """Broadcast map -> odom (x, y, yaw), dated ahead of a time (s) by tf_delay; nothing twice for one time, and
        nothing while it is not known.
        """
        c = self._config
        if now == self._sent or map_from_odom is None:
            return
        self._sent = now
        x, y, yaw = map_from_odom
        placed = Transform.from_xyz_rpy(x, y, 0.0, 0.0, 0.0, yaw)
        stamped = StampedTransform(later(now, c.delay), c.map_frame, c.odom_frame, placed)
        publish(self._transform, TFMessage([conversions.transform_message(stamped)]))

    def map(self, stamp: rospy.Time, grid_map: GridMap) -> None:
        """Publish a map, made at a time."""
        frame, self._drawn = self._config.map_frame, (stamp, grid_map)
        grid_map = self._edits.drawn(grid_map, stamp)
        self.message = grid_to_msg(grid_map.data, grid_map.geometry, grid_map.origin_yaw, frame, stamp)
        publish(self._metadata, self.message.info)
        publish(self._map, self.message)

    def entropy(self, value: float) -> None:
        """Publish the entropy of the pose, nat."""
        publish(self._entropy, Float64(value))


def save_answer(map_file: str, draw: Callable[[], GridMap | None], without: str) -> TriggerResponse:
    """The answer of the service ~save: the map that draw gives, written to map_file, or why not. without: the sentence
    where draw gives none.
    """
    if not map_file:
        return TriggerResponse(False, 'the parameter map_file does not say where')
    grid = draw()
    if grid is None:
        return TriggerResponse(False, without)
    try:
        image, description = save_map(grid, SaverConfig(name=map_file))
    except (OSError, ValueError) as error:
        return TriggerResponse(False, str(error))
    rospy.loginfo('the map is saved: %s, %s', description, image)
    return TriggerResponse(True, description)


def journal_of(state_file: str) -> Journal | None:
    """The journal in `state_file`; None without one. Raises JournalError."""
    if not state_file:
        return None
    journal = Journal(state_file)
    if journal.cut:
        rospy.logwarn('%s: the last %d bytes were damaged and are cut off', state_file, journal.cut)
    if journal.records:
        rospy.loginfo('the map of %s is gone on with', state_file)
    return journal
