"""Frames from the page, checked (docs/protocol.md). `parse` returns a Frame whose fields can be trusted, or raises."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from sara_hmi.config.config import CARER, LOOK, RIDER, ROLES
from sara_nav.maps.edits import FARTHEST, KINDS

VERSION = 1
LARGEST = 2**53  # the whole numbers that JavaScript has
NONE = 'none'  # the role of who is not paired
PLACE = re.compile(r'[^\W\d][\w-]{0,39}')
LANGUAGE = re.compile(r'[a-z]{2,3}')
KEY = re.compile(r'[a-z_]+\.[A-Za-z_.]{1,60}')
MOVERS = (CARER, RIDER)
EVERYBODY = (LOOK, CARER, RIDER)


class ProtocolError(ValueError):
    """A frame that does not fit. key, values: what to tell its sender. of: the frame's op, "" where it has none."""

    def __init__(self, key: str, of: str = '', **values: str | float) -> None:
        super().__init__(f'{key} {values} ({of})')
        self.key, self.of, self.values = key, of, values


@dataclass(frozen=True)
class Frame:
    """op, and its fields by name; optional ones that were not given are missing."""

    op: str
    fields: dict[str, Any] = field(default_factory=dict)

    def get(self, name: str, default: Any = None) -> Any:
        """A field."""
        return self.fields.get(name, default)


def _whole(value):
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= LARGEST


def _number(value, limit=1e6):
    return (
        isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value) and abs(value) <= limit
    )


def _clock(value):
    return _number(value, 1e15)


def _share(value):
    return _number(value, 1.0)


def _flag(value):
    return isinstance(value, bool)


def _pose(value):
    return isinstance(value, list) and len(value) == 3 and all(map(_number, value))


def _points(value):
    return (
        isinstance(value, list)
        and len(value) == 2
        and all(isinstance(point, list) and len(point) == 2 for point in value)
        and all(_number(number, FARTHEST) for point in value for number in point)
    )


def _text(longest: int) -> Callable[[object], bool]:
    return lambda value: isinstance(value, str) and 0 < len(value) <= longest and value.isprintable()


def _match(pattern: re.Pattern) -> Callable[[object], bool]:
    return lambda value: isinstance(value, str) and pattern.fullmatch(value) is not None


def _values(value):
    return (
        isinstance(value, dict)
        and len(value) <= 8
        and all(
            KEY.fullmatch(f'a.{name}') and (_number(held) or _text(60)(held) or held == '')
            for name, held in value.items()
        )
    )


@dataclass(frozen=True)
class Op:
    """needs, may: {field: check}; who: the roles that may send it."""

    who: tuple[str, ...]
    needs: dict[str, Callable[[object], bool]] = field(default_factory=dict)
    may: dict[str, Callable[[object], bool]] = field(default_factory=dict)


OPS = {
    'hello': Op(
        (NONE, *EVERYBODY),
        {'version': _whole},
        {'token': _text(100), 'language': _match(LANGUAGE), 'name': _text(40)},
    ),
    'pair': Op((NONE, *EVERYBODY), {'code': _text(20)}),
    'echo': Op((NONE, *EVERYBODY), {'t': _clock}),
    'take': Op(MOVERS),
    'release': Op(MOVERS),
    'grant': Op(MOVERS, {'session': _whole}),
    'refuse': Op(MOVERS, {'session': _whole}),
    'drive': Op(MOVERS, {'seq': _whole, 't': _clock, 'n': _whole, 'v': _share, 'w': _share}),
    'halt': Op(MOVERS, {'seq': _whole}, {'t': _clock}),
    'stop': Op(EVERYBODY),
    'reset': Op(MOVERS),
    'go': Op(MOVERS, {}, {'place': _match(PLACE), 'pose': _pose}),
    'pause': Op(MOVERS),
    'resume': Op(MOVERS),
    'cancel': Op(MOVERS),
    'pose': Op(MOVERS, {}, {'place': _match(PLACE), 'pose': _pose}),
    'profile': Op(MOVERS, {'name': _text(40)}),
    'override': Op(MOVERS, {'on': _flag}),
    'help': Op(MOVERS, {'name': _text(40)}),
    'place': Op(MOVERS, {'name': _match(PLACE)}, {'pose': _pose}),
    'rename': Op(MOVERS, {'name': _match(PLACE), 'to': _match(PLACE)}),
    'delete': Op(MOVERS, {'name': _match(PLACE)}),
    'edit': Op(MOVERS, {'kind': lambda value: value in KINDS, 'points': _points}),
    'unedit': Op(MOVERS, {'kind': lambda value: value in KINDS, 'points': _points}),
    'save_map': Op(MOVERS),
    'say': Op(EVERYBODY, {'key': _match(KEY)}, {'values': _values, 'language': _match(LANGUAGE), 'asked': _flag}),
    'invite': Op((RIDER,), {'role': lambda value: value in ROLES}),
}


def _pairs(pairs):
    """A JSON object whose names are not given twice."""
    result = dict(pairs)
    if len(result) != len(pairs):
        raise ValueError('a name is given twice')
    return result


def _no_constant(name):
    raise ValueError(f'{name} is no number')


def _int(text):
    if len(text) > 17:
        raise ValueError('the number is too long')
    return int(text)


def parse(text: str) -> Frame:
    """The Frame of a text; raises ProtocolError. A field that the op does not have is a fault, too."""
    try:
        data = json.loads(text, object_pairs_hook=_pairs, parse_constant=_no_constant, parse_int=_int)
    except (ValueError, RecursionError):
        raise ProtocolError('error.no_frame') from None
    if not isinstance(data, dict) or not isinstance(data.get('op'), str):
        raise ProtocolError('error.no_frame')
    name = data.pop('op')
    op = OPS.get(name)
    if op is None:
        raise ProtocolError('error.no_such_op')
    for key, check in op.needs.items():
        if key not in data:
            raise ProtocolError('error.field_missing', name, field=key)
        if not check(data[key]):
            raise ProtocolError('error.field_wrong', name, field=key)
    for key, value in data.items():
        if key in op.needs:
            continue
        if key not in op.may or not op.may[key](value):
            raise ProtocolError('error.field_wrong', name, field=key if len(key) <= 40 and key.isprintable() else '')
    if name in ('go', 'pose') and len(data) != 1:
        raise ProtocolError('error.field_missing', name, field='place')
    return Frame(name, data)
