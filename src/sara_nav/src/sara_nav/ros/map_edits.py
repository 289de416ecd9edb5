"""What people draw over a map, for the node that publishes it: read from its file, and again by the service
``reload_edits``; keep-out places go to the topic ``keepout_filter_mask``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import rospy
from nav_msgs.msg import OccupancyGrid
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from sara_nav.maps import edits
from sara_nav.maps.edits import KEEP_OUT, Edit, EditsError
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
        self._sent: tuple | None = None
        self._mask = rospy.Publisher('keepout_filter_mask', OccupancyGrid, queue_size=1, latch=True)

    def serve(self) -> None:
        """Offer the service; only when there is a map."""
        self._service = rospy.Service('reload_edits', Trigger, self._reload)

    def read(self, path: Path | None) -> None:
        """Take the edits of another file, None: of no file. Raises EditsError, and then all stays as it was."""
        self._edits = edits.load(path) if path else ()
        self._path = path and path.absolute()

    def drawn(self, grid_map: GridMap, stamp: rospy.Time) -> GridMap:
        """Return a map with what is freed and walled, and publish its keep-out places."""
        self._grid = grid_map
        self._publish(stamp)
        return edits.drawn(grid_map, self._edits)

    def _publish(self, stamp):
        """The keep-out places on the map's cells, where they or the cells are others than before; nothing as long as
        there never was one.
        """
        grid, (places, _) = self._grid, _sorted(self._edits)
        now = (places, grid.geometry, grid.origin_yaw)
        if now == self._sent or (not places and self._sent is None):
            return
        self._sent = now
        mask = edits.keep_out_mask(grid, places)
        self._mask.publish(grid_to_msg(mask.data, mask.geometry, mask.origin_yaw, self._frame, stamp))

    def _reload(self, _request: TriggerRequest) -> TriggerResponse:
        """The service: the answer names the file, or says why its edits are not used."""
        if self._path is None:
            return TriggerResponse(False, NO_FILE)
        _, before = _sorted(self._edits)
        try:
            self.read(self._path)
        except EditsError as error:
            rospy.logerr('reload_edits: %s; the edits stay as they are', error)
            return TriggerResponse(False, str(error))
        if self._grid is not None:
            if _sorted(self._edits)[1] != before:
                self._draw()
            self._publish(rospy.Time.now())
        return TriggerResponse(True, str(self._path))


def _sorted(held):
    """(the keep-out places, the edits that change the map)."""
    return [e for e in held if e.kind == KEEP_OUT], [e for e in held if e.kind != KEEP_OUT]
