"""The bus as its DBC file describes it: names and physical units on one side, frames on the other.

The file is read with cantools, which also packs and unpacks what `codec` does not; identifiers and offsets are written
nowhere else. What is added here is one family of errors that name the signal, the value it held and what is allowed.
"""

from __future__ import annotations

import math
import numbers
import struct
from functools import cache
from pathlib import Path

import cantools
from cantools.database.can import Message
from cantools.database.errors import Error

from canserial.dbc.codec import Codec
from canserial.frame import Frame
from sara_common import platforms

ADDITIONS = {path.stem: path for path in Path(__file__).resolve().parent.glob('*.dbc')}
"""Frames of further devices, which a name may ask for besides: +compass."""
RANGE_FRAMES = ('RANGES_1', 'RANGES_2', 'RANGE_ACCEL')
"""The messages that hold ranges: their signals in metres, each named as its ultrasonic sensor."""


class BusError(ValueError):
    """Something that the bus description does not allow."""


class UnknownFrame(BusError):
    """An identifier or a name that the description does not hold."""


class BadLength(BusError):
    """A frame that has not as many bytes as the description says."""


class BadValue(BusError):
    """A signal that is missing, unknown, not finite or does not fit into its bits."""


class BusDescription:
    """Encodes and decodes the frames of a DBC file, and of further ones that add frames to it.

    `comment`: of the bus; `nodes`: comments by the name of the node. Raises BusError where a file cannot be read, or
    where two of them describe the same frame.
    """

    def __init__(self, path: str | Path, *additions: str | Path) -> None:
        self.path = '+'.join(map(str, (path, *additions)))
        databases = [_load(str(file)) for file in (path, *additions)]
        messages = [message for database in databases for message in database.messages]
        self.comment = next((bus.comment for database in databases for bus in database.buses if bus.comment), '')
        self.nodes = {node.name: node.comment for database in reversed(databases) for node in database.nodes}
        self._by_name = {message.name: message for message in messages}
        self._by_id = {(message.frame_id, message.is_extended_frame): message for message in messages}
        for message in messages:
            other = self._by_id[message.frame_id, message.is_extended_frame]
            if not other is message is self._by_name[message.name]:
                twice = f'0x{message.frame_id:X} is {message.name} and {other.name}'
                raise BusError(f'the files of {self.path} describe the same frame twice: {twice}')
        self._codecs = {message.name: Codec.of(message) for message in messages}

    @classmethod
    def default(cls) -> BusDescription:
        """That of the platform that this process runs on."""
        return cls.of(platforms.chosen())

    @classmethod
    def of(cls, platform: platforms.Platform) -> BusDescription:
        """That of a platform, as its reader of the bus is told. Raises BusError."""
        return cls.named(_name_of(platform), platform)

    @classmethod
    def named(cls, name: str | Path, platform: platforms.Platform | None = None) -> BusDescription:
        """The description NAME.dbc of a platform (the chosen one where none is given), or else of any platform, or the
        file `name`; with '+compass' behind it, or alone for the platform's own, the compass's frame too.

        Read once per process. Raises BusError.
        """
        platform = platform or platforms.chosen()
        known = {**packaged(), **{path.stem: path for path in platform.folder.glob('*.dbc')}}
        first, *additions = [str(name)] if Path(name).is_file() else str(name).split('+')
        first = first or (_name_of(platform) if additions else '')
        path = known.get(first, Path(first))
        if not path.is_file() or not set(additions) <= set(ADDITIONS):
            raise BusError(
                f'bus description is {str(name)!r}, allowed are {", ".join(known)} or the path of a DBC file, and '
                f'behind it {" or ".join(f"+{addition}" for addition in ADDITIONS)}'
            )
        return _read(str(path), *(str(ADDITIONS[addition]) for addition in additions))

    @property
    def messages(self) -> tuple[Message, ...]:
        """What the file says of each message, as cantools' Message objects, in the file's order."""
        return tuple(self._by_name.values())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all messages, in the file's order."""
        return tuple(self._by_name)

    @property
    def ranges(self) -> dict[str, tuple[str, ...]]:
        """{message of RANGE_FRAMES: names of the ultrasonic sensors whose ranges it holds}."""
        return {
            name: tuple(signal.name for signal in self._by_name[name].signals if signal.unit == 'm')
            for name in RANGE_FRAMES
            if name in self._by_name
        }

    def id_of(self, name: str) -> int:
        """The identifier of the message `name`; raises UnknownFrame."""
        return self._message(name).frame_id

    def signals(self, name: str) -> tuple[str, ...]:
        """The names of a message's signals; raises UnknownFrame."""
        return tuple(signal.name for signal in self._message(name).signals)

    def resolution(self, name: str, signal: str) -> float:
        """The step of a signal, in its physical unit; raises UnknownFrame."""
        for candidate in self._message(name).signals:
            if candidate.name == signal:
                return candidate.scale
        raise UnknownFrame(f'no signal {signal} in {name} of {self.path}')

    def declares(self, name: str, signal: str, value: int) -> bool:
        """Whether the file names this raw value of a signal (VAL_)."""
        message = self._by_name.get(name)
        return message is not None and any(
            known.name == signal and value in (known.choices or {}) for known in message.signals
        )

    def encode(self, name: str, time: float = 0.0, /, **signals: float) -> Frame:
        """A Frame of the message `name` from all its signals in physical units, each rounded to its resolution.

        Raises UnknownFrame, BadValue.
        """
        message, codec = self._message(name), self._codecs[name]
        if len(signals) != len(message.signals):
            raise self._other_signals(name, signals)
        try:
            data = codec.encode(signals) if codec else self._encode(name, signals)
        except KeyError:
            raise self._other_signals(name, signals) from None
        except (struct.error, ValueError, OverflowError, TypeError) as error:
            raise _bad_value(message, signals, error) from error
        return Frame(message.frame_id, data, time, message.is_extended_frame)

    def _other_signals(self, name: str, signals: dict) -> BadValue:
        """The error of a message that is to be encoded from others than its signals."""
        own = set(self.signals(name))
        return BadValue(
            f'{name} needs its signals and no others: missing {sorted(own - signals.keys())}, '
            f'unknown {sorted(signals.keys() - own)}'
        )

    def decode(self, frame: Frame) -> tuple[str, dict[str, float]]:
        """(name, {signal: value in physical units}) of a Frame. Raises UnknownFrame, BadLength."""
        message = self._by_id.get((frame.id, frame.extended))
        if message is None:
            raise UnknownFrame(f'no frame 0x{frame.id:X} in {self.path}')
        if len(frame.data) != message.length:
            raise BadLength(f'{message.name} has {len(frame.data)} bytes, {message.length} are right')
        codec = self._codecs[message.name]
        if codec:
            return message.name, codec.decode(frame.data)
        try:
            values = message.decode(frame.data, decode_choices=False)
        except Error as error:
            raise BadValue(f'{message.name}: {error}') from error
        if not all(map(math.isfinite, values.values())):
            raise BadValue(f'{message.name} is {values}, allowed are finite numbers')
        return message.name, values

    def _encode(self, name: str, signals: dict) -> bytes:
        """What has no Codec, by cantools. Raises KeyError where a signal is missing, ValueError among others."""
        missing = [signal for signal in self.signals(name) if signal not in signals]
        if missing:
            raise KeyError(missing[0])
        try:
            return bytes(self._by_name[name].encode(signals, strict=False))
        except Error as error:
            raise ValueError(str(error)) from error

    def _message(self, name: str) -> Message:
        try:
            return self._by_name[name]
        except KeyError:
            raise UnknownFrame(f'no message named {name} in {self.path}') from None


def _bad_value(message: Message, signals: dict, error: Exception) -> BadValue:
    """Which signal cantools could not pack: it does not always say."""
    for signal in message.signals:
        value = signals[signal.name]
        if not isinstance(value, numbers.Real):
            return BadValue(f'{message.name}.{signal.name} is {value!r}, allowed are finite numbers')
        if not math.isfinite(value):
            return BadValue(f'{message.name}.{signal.name} is {value}, allowed are finite numbers')
        half = 1 << (signal.length - 1)
        low, high = (-half, half - 1) if signal.is_signed else (0, 2 * half - 1)
        if not low <= round((value - signal.offset) / signal.scale) <= high:
            low, high = low * signal.scale + signal.offset, high * signal.scale + signal.offset
            return BadValue(f'{message.name}.{signal.name} is {value}, allowed are numbers from {low:g} to {high:g}')
    return BadValue(f'{message.name}: {error}')


def packaged() -> dict[str, Path]:
    """{name: file} of the descriptions that come with the platforms."""
    return {path.stem: path for folder in platforms.folders().values() for path in sorted(folder.glob('*.dbc'))}


def _name_of(platform):
    """The name of a platform's own bus."""
    return platform.parameters('read').get('dbc', platform.name)


@cache
def _read(*paths: str) -> BusDescription:
    return BusDescription(*paths)


def _load(path):
    """What cantools makes of a file."""
    try:
        return cantools.database.load_file(path)
    except Exception as error:  # cantools raises a family of its own besides OSError
        raise BusError(f'cannot read the bus description {path}: {error}') from error
