"""What is needed of a DBC file to pack and unpack its frames, kept between runs: reading the file with cantools takes a
process longer than all that it then does with it.

It is kept beside the file as Python keeps compiled modules, in __pycache__, for the very bytes that were read; where it
is not there, is of other bytes or cannot be written, cantools reads the file.
"""

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path

FORMAT = 1  # of what is kept


@dataclass(frozen=True)
class Signal:
    """As cantools names them; `name` of the signal, its place in bits, and its physical unit: value = raw * scale +
    offset.
    """

    name: str
    start: int
    length: int
    byte_order: str
    is_signed: bool
    is_float: bool
    scale: float
    offset: float


@dataclass(frozen=True)
class Message:
    """As cantools names them; `plain`: neither multiplexed nor a container."""

    name: str
    frame_id: int
    is_extended_frame: bool
    length: int
    plain: bool
    signals: tuple

    @classmethod
    def of(cls, message):
        """That of a cantools Message."""
        return cls(
            message.name,
            message.frame_id,
            message.is_extended_frame,
            message.length,
            not (message.is_multiplexed() or message.is_container),
            tuple(
                Signal(*(getattr(signal, field) for field in Signal.__dataclass_fields__)) for signal in message.signals
            ),
        )


@dataclass(frozen=True)
class Layout:
    """A DBC file: the comment of its bus, {name: comment} of its nodes, its messages in their order."""

    comment: str
    nodes: dict
    messages: tuple

    @classmethod
    def of(cls, database):
        """That of a cantools Database."""
        return cls(
            next((bus.comment for bus in database.buses if bus.comment), ''),
            {node.name: node.comment for node in database.nodes},
            tuple(map(Message.of, database.messages)),
        )


def kept(path, content):
    """The Layout kept for these bytes of the file, or None."""
    try:
        found = json.loads(_place(path).read_text())
        if found['format'] != FORMAT or found['digest'] != _digest(content):
            return None
        messages = tuple(
            Message(**{**message, 'signals': tuple(Signal(**signal) for signal in message['signals'])})
            for message in found['messages']
        )
        return Layout(found['comment'], found['nodes'], messages)
    except (OSError, ValueError, KeyError, TypeError):
        return None


def keep(path, content, layout):
    """Keep a Layout for these bytes of the file, where that is allowed."""
    place = _place(path)
    try:
        place.parent.mkdir(exist_ok=True)
        new = place.with_suffix('.new')
        new.write_text(json.dumps({'format': FORMAT, 'digest': _digest(content), **asdict(layout)}))
        new.replace(place)
    except OSError:
        pass


def _place(path):
    path = Path(path)
    return path.parent / '__pycache__' / f'{path.name}.json'


def _digest(content):
    return hashlib.sha256(content).hexdigest()
