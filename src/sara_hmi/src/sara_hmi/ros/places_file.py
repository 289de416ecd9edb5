"""The named places, for the screen: a file that is written here and by others, such as `go --here`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import rospy

from sara_hmi.view.frames import Pose
from sara_nav.maps import places

FAULT = 'error.places_file'


class PlacesFile:
    """path: "" where there is no such file. tell: called with the places whenever they are read."""

    def __init__(self, path: str, tell: Callable[[dict[str, Pose]], None]) -> None:
        self._path, self._tell = path, tell
        self._at: int | None = None

    def look(self) -> None:
        """Read the file where it was written since it was read."""
        if self._written_at() != self._at:
            self.read()

    def read(self) -> None:
        """Read the file, and tell of it."""
        self._at = self._written_at()
        if self._at is None:
            return
        try:
            found = places.load(self._path)
        except places.PlacesError as error:
            rospy.logwarn('%s', error)
            return
        self._tell({name: (p.x, p.y, p.yaw) for name, p in found.items()})

    def add(self, place: places.Place) -> str:
        """Write or move a place. As all that changes the file, returns '', or the key of why it stays as it was."""
        return self._change(lambda: places.write(self._path, place))

    def rename(self, name: str, to: str) -> str:
        """Give a place another name."""
        return self._change(lambda: places.rename(self._path, name, to))

    def remove(self, name: str) -> str:
        """Take a place out."""
        return self._change(lambda: places.remove(self._path, name))

    def _change(self, change):
        if not self._path:
            return FAULT
        try:
            change()
        except places.PlacesError as error:
            rospy.logwarn('%s', error)
            return FAULT
        finally:
            self.read()
        return ''

    def _written_at(self):
        """ns since 1970; None where there is no file."""
        try:
            return Path(self._path).stat().st_mtime_ns if self._path else None
        except OSError:
            return None
