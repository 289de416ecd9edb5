"""ROS messages as plain data and back. A message is anything with genpy's `__slots__` and `_slot_types`."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable, Mapping
from typing import Any

from sara_common.config import is_number

WHOLE = {
    f'{sign}int{bits}': (0 if sign else -(2 ** (bits - 1)), 2 ** (bits if sign else bits - 1) - 1)
    for sign in ('', 'u')
    for bits in (8, 16, 32, 64)
} | {'byte': (-128, 127), 'char': (0, 255)}
FLOATS = ('float32', 'float64')
TIMES = ('time', 'duration')


class MessageError(ValueError):
    """Data that does not fit a message; the text is a sentence that names the field."""


def to_plain(value: Any) -> Any:
    """A message as dictionaries, lists, numbers, texts, bytes and numpy arrays."""
    if hasattr(value, '_slot_types'):
        return {name: to_plain(getattr(value, name)) for name in value.__slots__}
    if hasattr(value, 'secs'):
        return {'secs': value.secs, 'nsecs': value.nsecs}
    if isinstance(value, (list, tuple)):
        return [to_plain(held) for held in value]
    return value


def fill(message: Any, data: object, make: Callable[[str], Any], at: str = '') -> Any:
    """Put plain data into a message and return it. make(type): a new message of a type's name. What is not given stays
    as it is; what the message has not is a MessageError.
    """
    if not isinstance(data, Mapping):
        raise MessageError(
            f'{at or "the message"} is {_short(data)}, allowed is an object of {", ".join(message.__slots__)}'
        )
    unknown = [str(name) for name in data if name not in message.__slots__]
    if unknown:
        raise MessageError(f'there is no field {at}{unknown[0][:40]}; there are {", ".join(message.__slots__)}')
    for name, kind in zip(message.__slots__, message._slot_types):
        if name in data:
            setattr(message, name, _value(getattr(message, name), kind, data[name], make, f'{at}{name}'))
    return message


def _value(now, kind, data, make, at):
    """What to put into a field of a kind that holds `now`."""
    if kind.endswith(']'):
        return _array(kind, data, make, at)
    if kind in TIMES:
        return _time(now, data, at)
    if kind == 'string':
        if not isinstance(data, str):
            raise MessageError(f'{at} is {_short(data)}, allowed is a text')
        return data
    if kind == 'bool':
        if data not in (True, False):
            raise MessageError(f'{at} is {_short(data)}, allowed are true and false')
        return bool(data)
    if kind in WHOLE:
        low, high = WHOLE[kind]
        if not (is_number(data) and int(data) == data and low <= data <= high):
            raise MessageError(f'{at} is {_short(data)}, allowed are whole numbers from {low} to {high}')
        return int(data)
    if kind in FLOATS:
        if data is not None and not is_number(data):
            raise MessageError(f'{at} is {_short(data)}, allowed is a number')
        return float('nan') if data is None else float(data)
    return fill(now, data, make, f'{at}.')


def _array(kind, data, make, at):
    """A list of values of one kind, of a fixed length where the kind says so."""
    inner, length = kind[:-1].rsplit('[', 1)
    if inner in ('uint8', 'char') and isinstance(data, str):
        try:
            values: Any = base64.b64decode(data, validate=True)
        except (binascii.Error, ValueError):
            raise MessageError(f'{at} is no base64') from None
    elif isinstance(data, list):
        simple = inner in WHOLE or inner in FLOATS or inner in ('string', 'bool')
        values = [
            _value(None if simple else make(inner), inner, held, make, f'{at}[{k}]') for k, held in enumerate(data)
        ]
        values = bytes(values) if inner in ('uint8', 'char') else values
    else:
        raise MessageError(f'{at} is {_short(data)}, allowed is a list')
    if length and len(values) != int(length):
        raise MessageError(f'{at} has {len(values)} values, allowed are {length}')
    return values


def _time(now, data, at):
    seconds = data.get('secs', data.get('sec')) if isinstance(data, Mapping) else None
    rest = data.get('nsecs', data.get('nanosec')) if isinstance(data, Mapping) else None
    if not all(is_number(held) and int(held) == held and abs(held) < 2**31 for held in (seconds, rest)):
        raise MessageError(f'{at} is {_short(data)}, allowed is {{secs, nsecs}}')
    return type(now)(int(seconds), int(rest))


def _short(data):
    """How data are shown in a sentence."""
    text = repr(data)
    return text if len(text) <= 40 else f'{text[:37]}...'
