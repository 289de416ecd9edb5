"""What the server needs of a robot. sara_hmi.ros has one that speaks ROS; tests have one that writes down."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from sara_hmi.hub.actions import Order
from sara_hmi.view.frames import Seen, View


class Robot(Protocol):
    """Called from the server's thread; nothing may block."""

    def drive(self, v: float, w: float) -> None:
        """Publish the command of a motion of the robot, m/s and rad/s, at once."""

    def order(self, order: Order) -> None:
        """Begin to carry out an order; what comes of it is told to the Server (its `on_...` methods)."""

    def view(self) -> View:
        """The newest of everything."""

    def ranges(self) -> dict[str, Seen]:
        """The newest range readings, by sensor."""

    def plan(self) -> Sequence[tuple[float, float]]:
        """The newest plan in the map frame; the same object as long as it is the same plan."""
