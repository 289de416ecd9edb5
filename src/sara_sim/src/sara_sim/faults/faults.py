"""Everything that can be made to go wrong with the chair: one small dataclass for each fault, its arguments checked.

A fault says only what is wrong and for how long; `fault_engine.py` makes it so. `FAULTS` holds them by name; `build`
makes one from a name and arguments, `describe` lists the arguments.
"""

from __future__ import annotations

import math
from dataclasses import MISSING, dataclass, fields

from sara_sim.faults.arguments import FaultError, argument, between, one_of, seconds, whole

DIRECTIONS = ('to_pc', 'from_pc', 'both')
WHEELS = ('right', 'left', 'both')
NODES = ('sensor', 'motor', 'joystick')


@dataclass(frozen=True, kw_only=True)
class Fault:
    """`duration`: s."""

    duration: float = seconds()

    def __post_init__(self):
        faults = [
            f'{self.name}: {each.name} is {getattr(self, each.name)!r}, allowed is {each.metadata["allowed"]}'
            for each in fields(self)
            if not each.metadata['check'](getattr(self, each.name))
        ]
        if faults:
            raise FaultError('; '.join(faults))

    @property
    def name(self) -> str:
        """As it is called for."""
        return _NAMES[type(self)]


@dataclass(frozen=True, kw_only=True)
class FrameFault(Fault):
    """Something happens to frames between the chair and the PC: to each of `ids` (none: all) with `probability`."""

    probability: float = between(0, 1, 'share of the frames', 1.0)
    ids: tuple = argument(
        'a list of identifiers or names of frames (none: all)',
        lambda value: (
            isinstance(value, tuple)
            and all(
                isinstance(each, str)
                or isinstance(each, int)
                and not isinstance(each, bool)
                and 0 <= each <= 0x1FFFFFFF
                for each in value
            )
        ),
        (),
    )
    direction: str = one_of(DIRECTIONS, 'both')


@dataclass(frozen=True, kw_only=True)
class FramesDropped(FrameFault):
    """Frames that never arrive."""


@dataclass(frozen=True, kw_only=True)
class FramesDelayed(FrameFault):
    """Frames that arrive later, and so perhaps behind younger ones."""

    delay: float = between(0, 60, 's', 0.1)


@dataclass(frozen=True, kw_only=True)
class FramesDuplicated(FrameFault):
    """Frames that arrive twice."""


@dataclass(frozen=True, kw_only=True)
class FramesCorrupted(FrameFault):
    """Frames in which bits of the data are flipped."""

    bits: int = whole(1, 64, 'how many', 1)


@dataclass(frozen=True, kw_only=True)
class AdapterUnplugged(Fault):
    """The adapter is pulled out: nothing passes in either direction."""


@dataclass(frozen=True, kw_only=True)
class SonarFault(Fault):
    """`sensor`: which of the robot's, or all."""

    sensor: str = argument('the name of a sonar, or all', lambda value: isinstance(value, str) and value != '')


@dataclass(frozen=True, kw_only=True)
class SonarStuck(SonarFault):
    """It always measures the same."""

    range: float = between(0, 6, 'm; 0: never an echo')


@dataclass(frozen=True, kw_only=True)
class SonarNoisy(SonarFault):
    """Its measurements scatter."""

    sigma: float = between(0, 5, 'm', 0.3)


@dataclass(frozen=True, kw_only=True)
class SonarSilent(SonarFault):
    """It does not answer on the I2C bus."""


@dataclass(frozen=True, kw_only=True)
class ScanSilent(Fault):
    """The laser scanner sends nothing."""


@dataclass(frozen=True, kw_only=True)
class ScanFrozen(Fault):
    """The laser scanner sends the same ranges again and again, under new stamps."""


@dataclass(frozen=True, kw_only=True)
class CompassSilent(Fault):
    """The magnetometer does not answer on the I2C bus."""


@dataclass(frozen=True, kw_only=True)
class CompassStuck(Fault):
    """The magnetometer's data registers do not change any more."""


@dataclass(frozen=True, kw_only=True)
class CompassMagnet(Fault):
    """A magnet lies beside the magnetometer, and moves with the chair."""

    x: float = between(-500, 500, 'uT forward', 0.0)
    y: float = between(-500, 500, 'uT to the left', 20.0)


@dataclass(frozen=True, kw_only=True)
class ImuStuck(Fault):
    """The IMU's data registers do not change any more."""


@dataclass(frozen=True, kw_only=True)
class ImuNoisy(Fault):
    """The IMU's samples scatter."""

    accel_sigma: float = between(0, 20, 'm/s2', 1.0)
    gyro_sigma: float = between(0, 200, 'deg/s', 5.0)


@dataclass(frozen=True, kw_only=True)
class ImuSilent(Fault):
    """The IMU does not answer on the I2C bus."""


@dataclass(frozen=True, kw_only=True)
class EncoderFrozen(Fault):
    """A wheel's counter stands still, whatever the wheel does; afterwards it counts on from where it stood."""

    wheel: str = one_of(WHEELS)


@dataclass(frozen=True, kw_only=True)
class EncoderNoisy(Fault):
    """A wheel's counter scatters about what it should say."""

    wheel: str = one_of(WHEELS)
    sigma: float = between(0, 100000, 'steps', 500.0)


@dataclass(frozen=True, kw_only=True)
class NodeSilent(Fault):
    """One of the microcontrollers is off: it sends nothing; a motor node that is off drives nothing."""

    node: str = one_of(NODES)


@dataclass(frozen=True, kw_only=True)
class WheelSlip(Fault):
    """A wheel's rolling moves the body by `factor` of what it should, everywhere or on a round patch of the floor."""

    wheel: str = one_of(WHEELS, 'both')
    factor: float = between(0, 1, 'share of the rolling that moves the body', 0.3)
    x: float = between(-1e5, 1e5, 'm, centre of the patch in the map', 0.0)
    y: float = between(-1e5, 1e5, 'm', 0.0)
    radius: float = argument(
        'm, more than 0 (none: everywhere)',
        lambda value: isinstance(value, (int, float)) and not isinstance(value, bool) and value > 0,
        math.inf,
    )

    def __post_init__(self):
        super().__post_init__()
        if self.radius == math.inf and (self.x or self.y):
            raise FaultError(
                'wheel_slip: radius is missing; without it x and y mean nothing, for the wheel slips everywhere.'
            )


@dataclass(frozen=True, kw_only=True)
class Push(Fault):
    """Somebody pushes the body, its wheels skidding: a half sine of these peak velocities for `duration`."""

    forward: float = between(-3, 3, 'm/s', 0.0)
    left: float = between(-3, 3, 'm/s', 0.0)
    turn: float = between(-6, 6, 'rad/s', 0.0)
    duration: float = between(0.01, 60, 's', 0.3)


@dataclass(frozen=True, kw_only=True)
class BatteryLow(Fault):
    """The battery falls to `voltage` in `ramp` seconds."""

    voltage: float = between(0, 40, 'V', 20.5)
    ramp: float = between(0, 1e5, 's', 0.0)


@dataclass(frozen=True, kw_only=True)
class JoystickGrabbed(Fault):
    """The rider holds the joystick off its centre."""

    x: int = whole(0, 1023, '512 is the centre, more is right', 512)
    y: int = whole(0, 1023, '512 is the centre, more is forward', 512)


FAULTS = {
    'frames_dropped': FramesDropped,
    'frames_delayed': FramesDelayed,
    'frames_duplicated': FramesDuplicated,
    'frames_corrupted': FramesCorrupted,
    'adapter_unplugged': AdapterUnplugged,
    'sonar_stuck': SonarStuck,
    'sonar_noisy': SonarNoisy,
    'sonar_silent': SonarSilent,
    'scan_silent': ScanSilent,
    'scan_frozen': ScanFrozen,
    'compass_silent': CompassSilent,
    'compass_stuck': CompassStuck,
    'compass_magnet': CompassMagnet,
    'imu_stuck': ImuStuck,
    'imu_noisy': ImuNoisy,
    'imu_silent': ImuSilent,
    'encoder_frozen': EncoderFrozen,
    'encoder_noisy': EncoderNoisy,
    'node_silent': NodeSilent,
    'wheel_slip': WheelSlip,
    'push': Push,
    'battery_low': BatteryLow,
    'joystick_grabbed': JoystickGrabbed,
}
COMPASS = CompassSilent, CompassStuck, CompassMagnet
_NAMES = {kind: name for name, kind in FAULTS.items()}


def build(name: str, arguments: dict) -> Fault:
    """The fault `name` with these arguments. Raises FaultError that names everything that is wrong."""
    kind = FAULTS.get(name) if isinstance(name, str) else None
    if kind is None:
        raise FaultError(f'there is no fault {name!r}; there are {", ".join(FAULTS)}.')
    known = {each.name: each for each in fields(kind)}
    faults = [
        f'{name}: {each} is no argument of it; it takes {", ".join(known)}' for each in arguments if each not in known
    ]
    faults += [
        f'{name}: {each} is missing, allowed is {known[each].metadata["allowed"]}'
        for each in known
        if known[each].default is MISSING and each not in arguments
    ]
    values = {each: value for each, value in arguments.items() if each in known}
    for each, value in values.items():
        if isinstance(value, list):
            values[each] = tuple(value)
        elif each == 'ids' and isinstance(value, (int, str)) and not isinstance(value, bool):
            values[each] = (value,)
    if faults:
        raise FaultError('; '.join(faults))
    return kind(**values)


def describe() -> str:
    """Every fault with its arguments, for people."""
    lines = []
    for name, kind in FAULTS.items():
        lines.append(f'{name}: {kind.__doc__.splitlines()[0]}')
        for each in fields(kind):
            default = (
                'required'
                if each.default is MISSING
                else f'default {"none" if each.default in (math.inf, ()) else each.default}'
            )
            lines.append(f'    {each.name}: {each.metadata["allowed"]}; {default}')
    return '\n'.join(lines)
