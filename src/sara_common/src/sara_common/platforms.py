"""The robots that the stack runs on: a folder of numbers for each, and no number of theirs anywhere else.

sara_description's platforms/NAME/ holds `platform.yaml` (sizes, wheels, sensors, microcontrollers, simulated chairs,
and the parameters of every node that depend on the robot), `robot.urdf` and the DBC files of the bus. A Platform is
that folder, read and checked. Which one a process runs on says the environment variable SARA_PLATFORM; without it, it
is the one that the link platforms/default points to.
"""

from __future__ import annotations

import argparse
import copy
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from math import radians
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from sara_common.config import ConfigError, is_number, is_whole
from sara_common.files import merged, plain, share
from sara_common.planar import Pose2D

ENVIRONMENT = 'SARA_PLATFORM'
DEFAULT = 'default'
NODES = {
    'read.yaml': 'read',
    'diff_drive_controller.yaml': 'diff_drive_controller',
    'safety.yaml': 'safety_gate',
    'assist.yaml': 'shared_control',
    'sara_nav.yaml': 'move_base',
    'range_localization.yaml': 'range_localization',
    'slam_sonar.yaml': 'slam_sonar',
    'hmi.yaml': 'hmi',
}
"""{config file: the node that loads it}, of those nodes that have parameters in a platform's folder."""


class Body(NamedTuple):
    """The robot as a box on the floor, centred on `base_link`, m."""

    length: float
    width: float
    height: float


class Wheels(NamedTuple):
    """The drive wheels: radius and the distance between them, m; encoder edges of a turn."""

    radius: float
    separation: float
    steps_per_turn: int


@dataclass(frozen=True)
class Platform:
    """A robot's numbers. `sonars`: {name: where it sits in `base_link`, and the yaw of its axis}; `imu`, `scan`, `gps`
    (the antenna): where they sit. `sensor_node`, `motor_node`, `joystick_node`: what those microcontrollers are told;
    `simulated`: what simulated chairs are drawn from; `nodes`: {node: its parameters that depend on the robot}.
    """

    name: str
    folder: Path
    body: Body
    wheels: Wheels
    imu: Pose2D
    scan: Pose2D
    gps: Pose2D
    sonars: Mapping[str, Pose2D]
    sensor_node: Mapping[str, Any]
    motor_node: Mapping[str, Any]
    joystick_node: Mapping[str, Any]
    simulated: Mapping[str, Any]
    nodes: Mapping[str, dict]

    def parameters(self, node: str) -> dict:
        """A node's parameters that depend on the robot, a tree of its own; {} where there are none."""
        return copy.deepcopy(self.nodes.get(node, {}))

    @property
    def size(self) -> tuple[float, float]:
        """Length and width of the body, m."""
        return self.body.length, self.body.width

    @property
    def footprint(self) -> tuple[tuple[float, float], ...]:
        """The corners of the body (x, y), m about `base_link`, front left first, clockwise."""
        x, y = 0.5 * self.body.length, 0.5 * self.body.width
        return (x, y), (x, -y), (-x, -y), (-x, y)

    @property
    def urdf(self) -> str:
        """The text of its URDF. Raises OSError."""
        return (self.folder / 'robot.urdf').read_text()

    @classmethod
    def of(cls, folder: Path) -> Platform:
        """What a folder's platform.yaml says. Raises ConfigError with every fault, a sentence each."""
        path = folder / 'platform.yaml'
        try:
            tree = plain(path.read_text())
        except (OSError, yaml.YAMLError) as error:
            raise ConfigError(f'{path} cannot be read: {error}') from error
        facts = tree.pop('platform', None) if isinstance(tree, dict) else None
        if not isinstance(facts, dict):
            raise ConfigError(f'{path} has no section platform')
        faults: list[str] = []
        parts = {name: read(name, facts.pop(name, {}), faults) for name, read in _SECTIONS.items()}
        faults += [f'platform/{name} is {value!r}, but there is no such section' for name, value in facts.items()]
        faults += [f'{name} is {value!r}, allowed is a mapping' for name, value in tree.items() if not _is_tree(value)]
        if faults:
            raise ConfigError([f'{path}: {fault}' for fault in faults])
        return cls(folder.name, folder, **parts, nodes=tree)


def folders() -> dict[str, Path]:
    """{name: folder} of the platforms there are."""
    here = share('sara_description') / 'platforms'
    return {path.name: path for path in sorted(here.iterdir()) if path.is_dir() and not path.is_symlink()}


def load(name: str = DEFAULT) -> Platform:
    """The platform of that name, or that in the folder with this path. Read once per process. Raises ConfigError."""
    folder = share('sara_description') / 'platforms' / name
    if not folder.is_dir():
        folder = Path(name)
    if not folder.is_dir():
        raise ConfigError(f'platform is {name!r}, allowed are {", ".join(folders())} or the path of a folder')
    return _read(folder.resolve())


def chosen() -> Platform:
    """The one that this process runs on. Raises ConfigError."""
    return load(os.environ.get(ENVIRONMENT) or DEFAULT)


def choose(name: str) -> Platform:
    """From now on this process and those that it starts run on another platform. Raises ConfigError."""
    platform = load(name)
    known = folders().get(platform.name)
    os.environ[ENVIRONMENT] = platform.name if known and known.samefile(platform.folder) else str(platform.folder)
    return platform


def parameters(package: str, name: str, platform: Platform | None = None) -> dict:
    """The parameters in config/NAME of a package with those of the robot (the chosen one where none is given) over
    them, as its node has them in sara.launch.
    """
    tree = plain((share(package) / 'config' / name).read_text())
    return merged(tree, (platform or chosen()).parameters(NODES[name])) if name in NODES else tree


def add_option(parser: argparse.ArgumentParser) -> None:
    """The option --platform: from when it is parsed on, this process and those that it starts run on that platform."""

    def chosen_by(name):
        try:
            return choose(name)
        except ConfigError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    parser.add_argument(
        '--platform',
        type=chosen_by,
        metavar='NAME',
        help=f'which robot: {", ".join(folders())} or the path of a folder (that of ${ENVIRONMENT}, or {load().name})',
    )


class OfPlatform:
    """For dataclasses some of whose fields a platform knows: `known_of` says which, and what they are."""

    @classmethod
    def known_of(cls, platform: Platform) -> dict[str, Any]:
        """{field: value} that the platform knows."""
        raise NotImplementedError

    @classmethod
    def of(cls, platform: Platform | None = None, **others: Any) -> Any:
        """Of a platform, the chosen one where none is given; `others`: further fields, or other values."""
        return cls(**{**cls.known_of(platform or chosen()), **others})


@cache
def _read(folder):
    return Platform.of(folder)


def _is_tree(value):
    return isinstance(value, dict)


def _numbers(name, values, keys, faults):
    """Those numbers of a mapping, in that order; what is wrong is added to `faults`."""
    values = values if isinstance(values, dict) else {}
    faults += [
        f'{name}/{key} is {values.get(key)!r}, allowed are numbers' for key in keys if not is_number(values.get(key))
    ]
    faults += [f'{name}/{key} is {values[key]!r}, but there is no such line' for key in values if key not in keys]
    return [float(values[key]) if is_number(values.get(key)) else 0.0 for key in keys]


def _mount(name, values, faults):
    values = {key: value for key, value in values.items() if key != 'z'} if isinstance(values, dict) else values
    x, y, yaw = _numbers(f'platform/{name}', values, ('x', 'y', 'yaw_deg'), faults)
    return Pose2D(x, y, radians(yaw))


def _body(name, values, faults):
    return Body(*_numbers(f'platform/{name}', values, Body._fields, faults))


def _wheels(name, values, faults):
    found = Wheels(*_numbers(f'platform/{name}', values, Wheels._fields, faults))
    if not is_whole(values.get('steps_per_turn') if isinstance(values, dict) else None, 1):
        faults.append(
            f'platform/{name}/steps_per_turn is {found.steps_per_turn:g}, allowed are whole numbers of 1 or more'
        )
    return found._replace(steps_per_turn=int(found.steps_per_turn))


def _sonars(name, values, faults):
    if not _is_tree(values):
        faults.append(f'platform/{name} is {values!r}, allowed is a mapping from names to places')
        return {}
    return {sonar: _mount(f'{name}/{sonar}', place, faults) for sonar, place in values.items()}


def _tree(name, values, faults):
    if not _is_tree(values) or not values:
        faults.append(f'platform/{name} is {values!r}, allowed is a mapping of its numbers')
        return {}
    return values


_SECTIONS = {
    'body': _body,
    'wheels': _wheels,
    'imu': _mount,
    'scan': _mount,
    'gps': _mount,
    'sonars': _sonars,
    'sensor_node': _tree,
    'motor_node': _tree,
    'joystick_node': _tree,
    'simulated': _tree,
}
