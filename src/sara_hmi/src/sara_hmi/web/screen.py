"""What everybody is shown, the newest of each kind: for who is there, and for who comes later."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from typing import Any

from sara_hmi.config.config import RobotConfig
from sara_hmi.hub.hub import Hub
from sara_hmi.view import frames
from sara_hmi.view.history import History
from sara_hmi.web.robot import Robot
from sara_nav.maps.edits import Edit

GATE_IS_GONE = ('SILENT', '', '')  # what it said last is not so any more


def dumps(frame: Mapping[str, Any]) -> str:
    """A frame as text."""
    return json.dumps(frame, separators=(',', ':'), allow_nan=False)


class Screen:
    """send(kind, frame): to every client that may look."""

    def __init__(self, config: RobotConfig, hub: Hub, send: Callable[[str, Any], None]) -> None:
        self._hub, self._send = hub, send
        self._history = History(config.history)
        self.newest: dict[str, Any] = {}
        self._plan: Any = None
        self._gate: tuple[str, str, str] | None = None

    def show(self, frame: dict[str, Any], image: bytes | None = None) -> None:
        """A frame, for the map with its image."""
        text = dumps(frame)
        self.newest[frame['op']] = text if image is None else (text, image)
        self._send(frame['op'], self.newest[frame['op']])

    def on_places(self, places: dict[str, frames.Pose]) -> None:
        """The named places are these."""
        self._hub.tasks.places = places
        self.show(frames.places_frame(places))

    def on_edits(self, edits: tuple[Edit, ...] | None) -> None:
        """This is drawn over the map; None: it cannot be drawn over."""
        if edits != self._hub.tasks.edits:
            self._hub.tasks.edits = edits
            self.show(frames.edits_frame(edits))

    def on_gate(self, gate: tuple[str, str, str]) -> None:
        """The safety gate says (State's name, Reason's name, its sentence)."""
        self._gate = gate
        if gate[0] and self._history.on_gate(time.time(), *gate[:2]):
            self.show(self._history.frame())

    def note(self, key: str, values: dict[str, Any]) -> None:
        """Something for the history."""
        self._history.add(time.time(), key, values)
        self.show(self._history.frame())

    def show_state(self, robot: Robot) -> None:
        """What the robot does."""
        view, hub = robot.view(), self._hub
        view.gate, view.stopped = GATE_IS_GONE if view.gate_is_gone else self._gate, hub.driving.stopped
        hub.driving.obeyed = view.obeys
        hub.tasks.pose, hub.tasks.assisted = view.pose, view.assist is not None
        hub.tasks.helps = view.assist.profiles if view.assist else ()
        hub.tasks.maps = view.maps
        mission = hub.tasks.mission
        left = frames.left_of(robot.plan(), view.pose) if mission.state == 'going' else None
        goal = frames.goal_field(mission, left)
        self.show(frames.state_frame(time.time(), view, hub.driving.driver, goal))

    def show_ranges(self, robot: Robot) -> None:
        """What its sensors see."""
        self.show(frames.ranges_frame(robot.ranges()))

    def show_plan(self, robot: Robot) -> None:
        """Its plan, where that is another one."""
        plan = robot.plan()
        if plan is not self._plan:
            self._plan = plan
            self.show(frames.plan_frame(plan))
