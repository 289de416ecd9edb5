"""The bus as its DBC file describes it: names and physical units on one side, frames on the other.

The file is read with cantools, which also packs and unpacks what `codec` does not; identifiers and offsets are written
nowhere else. Of the files that come with this package `layout` keeps what was read, and cantools is imported where
there is more to ask than that. What is added here is one family of errors that name the signal, the value it held and
what is allowed.
"""

import math
import numbers
import struct
from functools import cache, cached_property
from pathlib import Path

from canserial.dbc import layout
from canserial.dbc.codec import Codec
from canserial.frame import Frame

DBC_FOLDER = Path(__file__).resolve().parent
DEFAULT_DBC = DBC_FOLDER / 'sara.dbc'
PACKAGED = ('sara', 'sara_tenths')


class BusError(ValueError):
    """Something that the bus description does not allow."""


class UnknownFrame(BusError):
    """An identifier or a name that the description does not hold."""


class BadLength(BusError):
    """A frame that has not as many bytes as the description says."""


class BadValue(BusError):
    """A signal that is missing, unknown, not finite or does not fit into its bits."""


class BusDescription:
    """Encodes and decodes the frames of one DBC file.

    `comment`: of the bus; `nodes`: comments by the name of the node. Raises BusError where the file cannot be read.
    """

    def __init__(self, path=DEFAULT_DBC):
        self.path = str(path)
        try:
            content = Path(path).read_bytes()
        except OSError as error:
            raise BusError(f'cannot read the bus description {self.path}: {error}') from error
        packaged = Path(path).resolve().parent == DBC_FOLDER
        known = layout.kept(path, content) if packaged else None
        if known is None:
            known = layout.Layout.of(self._database)
            if packaged:
                layout.keep(path, content, known)
        self.comment, self.nodes = known.comment, known.nodes
        self._by_name = {message.name: message for message in known.messages}
        codecs = {message.name: Codec.of(message) for message in known.messages}
        self._packed = {
            message.name: (
                len(message.signals),
                codecs[message.name] and codecs[message.name].encode,
                message.frame_id,
                message.is_extended_frame,
            )
            for message in known.messages
        }
        self._by_id = {
            (message.frame_id, message.is_extended_frame): (
                message.name,
                message.length,
                codecs[message.name] and codecs[message.name].decode,
            )
            for message in known.messages
        }

    @cached_property
    def _database(self):
        """The file as cantools reads it. Raises BusError."""
        import cantools

        try:
            return cantools.database.load_file(self.path)
        except Exception as error:  # cantools raises a family of its own besides OSError
            raise BusError(f'cannot read the bus description {self.path}: {error}') from error

    @classmethod
    def default(cls):
        """The description of SARA's bus, 'sara'."""
        return cls.named('sara')

    @classmethod
    def named(cls, name):
        """A description that comes with this package ('sara'; 'sara_tenths': rates in tenths of deg/s), or that of the
        file `name`.

        Read once per process. Raises BusError.
        """
        path = DBC_FOLDER / f'{name}.dbc'
        if name not in PACKAGED:
            path = Path(name)
            if not path.is_file():
                raise BusError(
                    f'bus description is {str(name)!r}, allowed are {", ".join(PACKAGED)} or the path of a DBC file'
                )
        return _read(str(path))

    @property
    def messages(self):
        """What the file says of each message, as cantools' Message objects, in the file's order."""
        return tuple(self._database.messages)

    @property
    def names(self):
        """Names of all messages, in the file's order."""
        return tuple(self._by_name)

    def id_of(self, name):
        """The identifier of the message `name`; raises UnknownFrame."""
        return self._message(name).frame_id

    def signals(self, name):
        """The names of a message's signals; raises UnknownFrame."""
        return tuple(signal.name for signal in self._message(name).signals)

    def resolution(self, name, signal):
        """The step of a signal, in its physical unit; raises UnknownFrame."""
        for candidate in self._message(name).signals:
            if candidate.name == signal:
                return candidate.scale
        raise UnknownFrame(f'no signal {signal} in {name} of {self.path}')

    def encode(self, name, time=0.0, /, **signals):
        """A Frame of the message `name` from all its signals in physical units, each rounded to its resolution.

        Raises UnknownFrame, BadValue.
        """
        known = self._packed.get(name)
        if known is None:
            raise self._unknown(name)
        count, encode, identifier, extended = known
        if len(signals) != count:
            raise self._other_signals(name, signals)
        try:
            data = encode(signals) if encode else self._encode(name, signals)
        except KeyError:
            raise self._other_signals(name, signals) from None
        except (struct.error, ValueError, OverflowError, TypeError) as error:
            raise _bad_value(self._by_name[name], signals, error) from error
        return Frame(identifier, data, time, extended)

    def _other_signals(self, name, signals):
        """The error of a message that is to be encoded from others than its signals."""
        own = set(self.signals(name))
        return BadValue(
            f'{name} needs its signals and no others: missing {sorted(own - signals.keys())}, unknown {sorted(signals.keys() - own)}'
        )

    def decode(self, frame):
        """(name, {signal: value in physical units}) of a Frame. Raises UnknownFrame, BadLength."""
        known = self._by_id.get((frame.id, frame.extended))
        if known is None:
            raise UnknownFrame(f'no frame 0x{frame.id:X} in {self.path}')
        name, length, decode = known
        if len(frame.data) != length:
            raise BadLength(f'{name} has {len(frame.data)} bytes, {length} are right')
        return name, decode(frame.data) if decode else self._database.get_message_by_name(name).decode(
            frame.data, decode_choices=False
        )

    def _encode(self, name, signals):
        """What has no Codec, by cantools. Raises KeyError where a signal is missing, ValueError among others."""
        missing = [signal for signal in self.signals(name) if signal not in signals]
        if missing:
            raise KeyError(missing[0])
        from cantools.database.errors import Error

        try:
            return bytes(self._database.get_message_by_name(name).encode(signals, strict=False))
        except Error as error:
            raise ValueError(str(error)) from error

    def _message(self, name):
        try:
            return self._by_name[name]
        except KeyError:
            raise self._unknown(name) from None

    def _unknown(self, name):
        return UnknownFrame(f'no message named {name} in {self.path}')


def _bad_value(message, signals, error):
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
            return BadValue(f'{message.name}.{signal.name} is {value}, allowed is {low:g} to {high:g}')
    return BadValue(f'{message.name}: {error}')


@cache
def _read(path):
    return BusDescription(path)
