"""What a robot supplies to diff_drive_controller: wheel positions in, wheel speed commands out.

The parameter `~base` names the class: `can` is SARA's chair, `MODULE:CLASS` any other. The class is made with the
controller's configuration and its private parameters, so that a robot has its own settings beside the controller's.
"""

import abc
import importlib
from collections import Counter
from typing import NamedTuple

from sara_control.wheels.config import ControllerConfig

KNOWN = {'can': 'sara_control.ros.can_chair:CanChair'}


class WheelPositions(NamedTuple):
    """Where the wheels stand.

    left, right: rad, forward positive, counted from anywhere; a sequence where a side has several joints.
    stamp: s, when that was so. interval: s since the positions before by the wheels' own clock; None where there is
    none, then the stamps tell. missed: s of the interval that readings were missing in, the way being known.
    unmeasured: s before this reading of which the way is unknown.
    """

    left: float
    right: float
    stamp: float
    interval: float = None
    missed: float = 0.0
    unmeasured: float = 0.0


class WheelBase(abc.ABC):
    """config: ControllerConfig. params: the node's private parameters, nested dictionaries.

    Nothing here may block: `read` and `write` are called in each cycle, never two at a time. A robot that gets its
    positions by itself may call `news` at any time, from any thread, to be read at once. What they raise is counted and
    shown in /diagnostics; the wheels then stop as soon as their positions are too old.
    """

    joints = (
        None  # names of the robot's wheel joints, if it has names for them: others in the configuration are refused
    )

    def __init__(self, config: ControllerConfig, params: dict) -> None:
        self.config = config
        self.counters = Counter()
        self.news = lambda: None

    @abc.abstractmethod
    def read(self, t: float) -> list[WheelPositions]:
        """WheelPositions that were not read before, oldest first (a list, empty if there are none). t: now, s."""

    @abc.abstractmethod
    def write(self, left: float, right: float, t: float) -> None:
        """Command these wheel speeds, rad/s, for the whole side."""

    def stop(self, t: float) -> None:
        """The last command before the node ends. t: now, s."""
        self.write(0.0, 0.0, t)

    @property
    def may_drive(self) -> bool:
        """Whether the wheels obey this node now (and not a joystick of their own)."""
        return True

    @property
    def state(self) -> str:
        """Who drives, in words."""
        return 'the PC drives'


class BaseError(ValueError):
    """One sentence on a base that cannot be had."""


def load_base(name: str, config: ControllerConfig, params: dict) -> WheelBase:
    """The WheelBase called `name`. Raises BaseError."""
    allowed = f'allowed are {", ".join(KNOWN)} and MODULE:CLASS'
    if not isinstance(name, str) or KNOWN.get(name, name).count(':') != 1:
        raise BaseError(f'base is {name!r}, {allowed}')
    module_name, class_name = KNOWN.get(name, name).split(':')
    try:
        kind = getattr(importlib.import_module(module_name), class_name)
    except (ImportError, AttributeError, ValueError) as error:
        raise BaseError(f'base is {name!r}, but that cannot be loaded ({error}); {allowed}') from error
    if not (isinstance(kind, type) and issubclass(kind, WheelBase)):
        raise BaseError(f'base is {name!r}, but that is no sara_control.wheels.base.WheelBase')
    try:
        base = kind(config, params)
    except Exception as error:  # a robot's own code: whatever it raises, the node cannot start
        raise BaseError(f'base {name!r} did not start: {error}') from error
    if base.joints is not None:
        unknown = [joint for joint in config.left_joints + config.right_joints if joint not in base.joints]
        if unknown:
            raise BaseError(
                f'left_wheel and right_wheel name {", ".join(unknown)}, but the joints of {name!r} are '
                f'{", ".join(base.joints)}'
            )
    return base
