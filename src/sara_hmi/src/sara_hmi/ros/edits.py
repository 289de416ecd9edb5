"""What is drawn over the map, for the screen: the file is written here; whoever publishes the map says where it is, and
reads it again, by the service reload_edits (map_server, slam_gmapping and slam_sonar have it).
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import rospy
from std_srvs.srv import Trigger

from sara_nav.maps import edits
from sara_nav.maps.edits import Edit, EditsError

SERVICE = 'reload_edits'
Edits = tuple[Edit, ...]


def is_offered(service: str) -> bool:
    """Whether the master knows who offers a service."""
    return rospy.get_master().lookupService(rospy.resolve_name(service))[0] == 1


class EditsFile:
    """tell: called with the edits whenever they are read; with None where the map cannot be drawn over."""

    def __init__(self, tell: Callable[[Edits | None], None]) -> None:
        self._tell, self._there = tell, False

    def look(self) -> None:
        """Read the file where the service has come since the last look, or has gone."""
        there = is_offered(SERVICE)
        if there != self._there:
            self._there = there
            self.read()

    def read(self) -> None:
        """Read the file, and tell of it."""
        path, held = self._reload()[0], None
        if path is not None:
            try:
                held = edits.load(path)
            except EditsError as error:
                rospy.logwarn('%s', error)
        self._tell(held)

    def change(self, change: Callable[[Edits], Edits]) -> str:
        """Write what `change` makes of the edits. Returns '', or the key of why they stay as they were."""
        path, why = self._reload()
        if path is None:
            rospy.logwarn('the map cannot be drawn over: %s', why)
            return 'error.no_edits'
        try:
            before = edits.load(path)
            edits.write(path, change(before))
            taken, why = self._reload()
            if taken is None:
                edits.write(path, before)
                raise EditsError(f'{path} is as it was: {why}')
        except EditsError as error:
            rospy.logwarn('%s', error)
            return 'error.edits_file'
        finally:
            self.read()
        return ''

    def _reload(self) -> tuple[Path | None, str]:
        """(the file, which was read again; None where that cannot be, why)."""
        if not self._there:
            return None, f'nobody offers {rospy.resolve_name(SERVICE)}'
        try:
            answer = rospy.ServiceProxy(SERVICE, Trigger)()
        except rospy.ServiceException as error:
            return None, str(error)
        return (Path(answer.message), '') if answer.success else (None, answer.message)


def without(held: Edits, edit: Edit) -> Edits:
    """The edits but for the last one that equals this one."""
    last = max((k for k, one in enumerate(held) if one == edit), default=None)
    return tuple(one for k, one in enumerate(held) if k != last)
