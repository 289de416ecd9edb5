"""Goals, places, poses, profiles and speech: what a page asks for besides driving."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sara_hmi.config.config import RobotConfig
from sara_hmi.hub.actions import Action, Everyone, Order, error
from sara_hmi.hub.mission import Mission, Pose, Send
from sara_hmi.protocol.frames import Frame
from sara_nav.maps.edits import MOST, Edit

LIMITS = ('max_forward', 'max_reverse', 'max_turn')


class Tasks:
    """Knows what it is told of the robot: `places`, `profiles` with the one in use, `pose`, where the chair is,
    `assisted`, whether shared control runs, and `helps`, its profiles; `maps`, whether a map is being made; `edits`,
    what is drawn over the map, None where it cannot be drawn over.
    """

    def __init__(self, config: RobotConfig) -> None:
        self.mission = Mission()
        self.places: dict[str, Pose] = {}
        self.pose: Pose | None = None
        self.assisted, self.helps, self.maps = False, (), False
        self.edits: tuple[Edit, ...] | None = None
        self.profiles: Mapping[str, Mapping[str, float]] = config.profiles
        self.profile = config.profile

    def profile_names(self) -> list[str]:
        """In the order of their file."""
        return list(self.profiles)

    def profile_fields(self) -> dict[str, Any]:
        """The profile in use, and its limits, for a frame."""
        limits = self.profiles[self.profile]
        return {'profile': self.profile, 'limits': {name: limits[name] for name in LIMITS}}

    def use_profiles(self, profiles: Mapping[str, Mapping[str, float]], profile: str) -> list[Action]:
        """The safety gate's own profiles, and the one in use."""
        if (profiles, profile) == (self.profiles, self.profile):
            return []
        self.profiles, self.profile = profiles, profile
        return [Everyone({'op': 'profile', **self.profile_fields(), 'profiles': self.profile_names()})]

    def speed(self, v: float, w: float) -> tuple[float, float]:
        """(m/s, rad/s) of shares of the profile's limits."""
        limits = self.profiles[self.profile]
        return v * limits['max_forward' if v > 0.0 else 'max_reverse'], w * limits['max_turn']

    def heed(self, client: int, frame: Frame, stopped: bool, other_drives: bool) -> list[Action]:
        """A frame of a client that may send it. other_drives: somebody else moves the chair by hand just now, or,
        for what shared control is to do, has the controls.
        """
        if other_drives and frame.op in ('go', 'resume', 'pose', 'override', 'help'):
            return [error(client, 'error.other_drives', frame.op)]
        if stopped and frame.op in ('go', 'resume'):
            return [error(client, 'error.stopped', frame.op)]
        handle = getattr(self, f'_on_{frame.op}')
        return handle(client, frame)

    def _on_go(self, client, frame):
        pose, fault = self._where(client, frame)
        return fault or _orders(client, self.mission.go(frame.get('place', ''), pose))

    def _where(self, client, frame):
        """(the pose of a frame that names a place or holds one, what is refused where there is no such place)."""
        place = frame.get('place')
        if place is None:
            return tuple(map(float, frame.get('pose'))), []
        if place not in self.places:
            return None, [error(client, 'error.no_place', frame.op, {'place': place})]
        return self.places[place], []

    def _on_pause(self, client, _frame):
        return _done(client, 'pause', *self.mission.pause())

    def _on_resume(self, client, _frame):
        return _done(client, 'resume', *self.mission.resume())

    def _on_cancel(self, client, _frame):
        return _done(client, 'cancel', *self.mission.cancel())

    def _on_pose(self, client, frame):
        pose, fault = self._where(client, frame)
        return fault or [Order(client, 'pose', (pose, 'place' in frame.fields))]

    def _on_profile(self, client, frame):
        name = frame.get('name')
        if name not in self.profiles:
            return [error(client, 'error.no_profile', 'profile', {'profile': name})]
        self.profile = name
        return [Order(client, 'profile', (name,)), Everyone({'op': 'profile', **self.profile_fields()})]

    def _on_override(self, client, frame):
        if not self.assisted:
            return [error(client, 'error.no_assist', 'override')]
        return [Order(client, 'override', (frame.get('on'),))]

    def _on_help(self, client, frame):
        if not self.assisted:
            return [error(client, 'error.no_assist', 'help')]
        name = frame.get('name')
        if name not in self.helps:
            return [error(client, 'error.no_help', 'help', {'profile': name})]
        return [Order(client, 'help', (name,))]

    def _on_place(self, client, frame):
        pose = frame.get('pose', self.pose)
        if pose is None:
            return [error(client, 'error.no_pose', 'place')]
        return [Order(client, 'place', (frame.get('name'), tuple(map(float, pose))))]

    def _on_rename(self, client, frame):
        name, to = frame.get('name'), frame.get('to')
        if name not in self.places:
            return [error(client, 'error.no_place', 'rename', {'place': name})]
        if to in self.places:
            return [error(client, 'error.place_known', 'rename', {'place': to})]
        return [Order(client, 'rename', (name, to))]

    def _on_delete(self, client, frame):
        if frame.get('name') not in self.places:
            return [error(client, 'error.no_place', 'delete', {'place': frame.get('name')})]
        return [Order(client, 'delete', (frame.get('name'),))]

    def _on_edit(self, client, frame):
        edit = Edit.of(frame.get('kind'), frame.get('points'))
        if self.edits is None:
            return [error(client, 'error.no_edits', 'edit')]
        if edit.fault():
            return [error(client, 'error.edit_small', 'edit')]
        if len(self.edits) >= MOST:
            return [error(client, 'error.edits_full', 'edit', {'most': MOST})]
        return [Order(client, 'edit', (edit,))]

    def _on_unedit(self, client, frame):
        edit = Edit.of(frame.get('kind'), frame.get('points'))
        if edit not in (self.edits or ()):
            return [error(client, 'error.no_edit', 'unedit')]
        return [Order(client, 'unedit', (edit,))]

    def _on_save_map(self, client, _frame):
        return [Order(client, 'save_map') if self.maps else error(client, 'error.no_map', 'save_map')]

    def _on_say(self, client, frame):
        said = frame.get('key'), frame.get('values', {}), frame.get('language', ''), frame.get('asked', False)
        return [Order(client, 'say', said)]


def _orders(client, done):
    """What the mission wants, as orders."""
    return [
        Order(client, 'go', (step.number, step.pose))
        if isinstance(step, Send)
        else Order(client, 'cancel', (step.number,))
        for step in done
    ]


def _done(client, of, done, why):
    return [error(client, why, of)] if why else _orders(client, done)
