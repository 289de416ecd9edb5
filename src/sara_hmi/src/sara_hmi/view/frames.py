"""Frames that show the robot. Numbers are rounded to what a screen can show."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from sara_nav.maps.edits import Edit

Pose = tuple[float, float, float]


@dataclass(frozen=True)
class Assist:
    """What shared control does. does: the Correction's name or "". command: the newest (v, w) that it drives, m/s and
    rad/s; None: none of late. left: s that an override still lasts. lasts: s that one lasts. profile: the one in use,
    of profiles; "" where that is not known.
    """

    does: str
    command: tuple[float, float] | None
    left: float
    lasts: float
    profile: str = ''
    profiles: tuple[str, ...] = ()


@dataclass
class View:
    """What is known of the robot; None: not known. Units: m, rad, s.

    gate: (State's name, Reason's name or "", the sentence). asked: the newest (v, w) of page or navigation.
    battery: (share 0 to 1 or None, V or None). connected: {topic: whether something came of late}. assist: None where
    shared control does not run. lost: whether the localization doubts the pose; None: it does not say. maps: whether a
    map is being made, and can be saved. gate_is_gone: the gate has spoken, and is not there any more, or hangs. obeys:
    whether somebody takes the page's commands.
    """

    pose: Pose | None = None
    v: float | None = None
    w: float | None = None
    gate: tuple[str, str, str] | None = None
    asked: tuple[float, float] | None = None
    battery: tuple[float | None, float | None] | None = None
    stopped: bool = False
    connected: Mapping[str, bool] = field(default_factory=dict)
    assist: Assist | None = None
    lost: bool | None = None
    maps: bool = False
    gate_is_gone: bool = False
    obeys: bool = True


@dataclass(frozen=True)
class Seen:
    """One range reading. pose: of the sensor on the robot. fov: rad."""

    pose: Pose
    range: float
    least: float
    most: float
    fov: float


def number(value: float | None, digits: int = 3) -> float | None:
    """Rounded; None where it is not finite."""
    return None if value is None or not math.isfinite(value) else round(value, digits)


def pose_field(pose: Pose | None) -> list[float] | None:
    """A pose as a list."""
    return None if pose is None else [round(value, 4) for value in pose]


def state_frame(t: float, view: View, driver: int | None, goal: Mapping | None) -> dict[str, Any]:
    """What the chair does, at t (s of the server's wall clock)."""
    gate = None
    if view.gate is not None:
        state, reason, sentence = view.gate
        gate = {'state': state, 'reasons': [reason] if reason else [], 'sentence': sentence}
    battery = view.battery and {'share': number(view.battery[0]), 'volts': number(view.battery[1], 2)}
    return {
        'op': 'state',
        't': round(1000.0 * t),
        'pose': pose_field(view.pose),
        'lost': view.lost,
        'maps': view.maps,
        'v': number(view.v),
        'w': number(view.w),
        'gate': gate,
        'driver': driver,
        'goal': goal,
        'asked': _motion_field(view.asked),
        'assist': view.assist and _assist_field(view.assist),
        'battery': battery,
        'stopped': view.stopped,
        'connected': dict(view.connected),
    }


def _motion_field(motion):
    return motion and {'v': number(motion[0]), 'w': number(motion[1])}


def _assist_field(assist):
    return {
        'does': assist.does,
        'command': _motion_field(assist.command),
        'left': number(assist.left, 0),
        'lasts': number(assist.lasts, 0),
        'profile': assist.profile,
        'profiles': list(assist.profiles),
    }


def goal_field(mission: Any, left: float | None) -> dict[str, Any] | None:
    """The mission's goal; left: m to go."""
    if mission.goal is None:
        return None
    place, pose = mission.goal
    return {'state': mission.state, 'place': place, 'pose': pose_field(pose), 'left': number(left, 2)}


def ranges_frame(seen: Mapping[str, Seen]) -> dict[str, Any]:
    """What the sensors see. A range that is infinite is None: nothing up to `max`; -Inf is 0: something touches."""
    return {
        'op': 'ranges',
        **{
            name: {
                'pose': pose_field(one.pose),
                'range': 0.0 if one.range == -math.inf else number(one.range),
                'min': number(one.least),
                'max': number(one.most),
                'fov': number(one.fov),
            }
            for name, one in seen.items()
        },
    }


def plan_frame(points: Sequence[tuple[float, float]], most: int = 200) -> dict[str, Any]:
    """A plan of `most` points or fewer, the first and the last among them."""
    step = max(1, math.ceil((len(points) - 1) / (most - 1)))
    chosen = [*points[:-1:step], *points[-1:]]
    return {'op': 'plan', 'points': [[round(x, 2), round(y, 2)] for x, y in chosen]}


def places_frame(places: Mapping[str, Pose]) -> dict[str, Any]:
    """All named places."""
    return {'op': 'places', 'places': {name: pose_field(pose) for name, pose in places.items()}}


def edits_frame(edits: Sequence[Edit] | None) -> dict[str, Any]:
    """What is drawn over the map; None: it cannot be drawn over."""
    if edits is None:
        return {'op': 'edits', 'edits': None}
    return {'op': 'edits', 'edits': [{'kind': edit.kind, 'points': [[*edit.a], [*edit.b]]} for edit in edits]}


def left_of(points: Sequence[tuple[float, float]], pose: Pose | None) -> float | None:
    """m along a plan from the point of it that is nearest to a pose."""
    if pose is None or not points:
        return None
    nearest = min(range(len(points)), key=lambda k: math.hypot(points[k][0] - pose[0], points[k][1] - pose[1]))
    return sum(math.dist(a, b) for a, b in zip(points[nearest:], points[nearest + 1 :]))


def finite_pairs(points: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """The points whose numbers are finite."""
    return [(x, y) for x, y in points if math.isfinite(x) and math.isfinite(y)]
