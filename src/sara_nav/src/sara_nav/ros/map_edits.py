"""What people draw over a map, for the node that publishes it: read from its file, and again by the service
``reload_edits``; keep-out places go to the topic ``keepout_filter_mask``, slow ones to ``speed_filter_mask``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import rospy
from nav_msgs.msg import OccupancyGrid
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from sara_nav.maps import edits
from sara_nav.maps.edits import KEEP_OUT, SLOW, Edit, EditsError
from sara_nav.maps.map_io import GridMap
from sara_nav.ros.conversions import grid_to_msg

NO_FILE = 'the map has no file that its edits could be beside'


class MapEdits:
    """frame: the map's. draw: publishes the map anew; called once the service has read edits that change it."""

    def __init__(self, frame: str, draw: Callable[[], None]) -> None:
        self._frame, self._draw = frame, draw
        self._path: Path | None = None
        self._edits: tuple[Edit, ...] = ()
        self._grid: GridMap | None = None
        self._masks = {
            KEEP_OUT: Mask('keepout_filter_mask', edits.keep_out_mask),
            SLOW: Mask('speed_filter_mask', edits.speed_mask),
        }

    def serve(self) -> None:
        """Offer the service; only when there is a map."""
        self._service = rospy.Service('reload_edits', Trigger, self._reload)

    def read(self, path: Path | None) -> None:
        """Take the edits of another file, None: of no file. Raises EditsError, and then all stays as it was."""
        self._edits = edits.load(path) if path else ()
        self._path = path and path.absolute()

    def drawn(self, grid_map: GridMap, stamp: rospy.Time) -> GridMap:
        """Return a map with what is freed and walled, and publish its keep-out and slow places."""
        self._grid = grid_map
        self._publish(stamp)
        return edits.drawn(grid_map, self._edits)

    def _publish(self, stamp):
        for kind, mask in self._masks.items():
            mask.tell(self._grid, [edit for edit in self._edits if edit.kind == kind], self._frame, stamp)

    def _reload(self, _request: TriggerRequest) -> TriggerResponse:
        """The service: the answer names the file, or says why its edits are not used."""
        if self._path is None:
            return TriggerResponse(False, NO_FILE)
        before = self._shown()
        try:
            self.read(self._path)
        except EditsError as error:
            rospy.logerr('reload_edits: %s; the edits stay as they are', error)
            return TriggerResponse(False, str(error))
        if self._grid is not None:
            if self._shown() != before:
                self._draw()
            self._publish(rospy.Time.now())
        return TriggerResponse(True, str(self._path))

    def _shown(self):
        """The edits that change the map."""
        return [edit for edit in self._edits if edit.kind not in self._masks]


class Mask:
    """A topic with the places of one kind on the map's cells, latched. of: makes the mask of a map and its edits."""

    def __init__(self, topic: str, of: Callable[[GridMap, Sequence[Edit]], GridMap]) -> None:
        self._of, self._sent = of, None
        self._publisher = rospy.Publisher(topic, OccupancyGrid, queue_size=1, latch=True)

    def tell(self, grid: GridMap, places: Sequence[Edit], frame: str, stamp: rospy.Time) -> None:
        """Publish the places, where they or the cells are others than before; nothing where there never was one."""
        now = (places, grid.geometry, grid.origin_yaw)
        if now == self._sent or (not places and self._sent is None):
            return
        self._sent = now
        mask = self._of(grid, places)
        self._publisher.publish(grid_to_msg(mask.data, mask.geometry, mask.origin_yaw, frame, stamp))
