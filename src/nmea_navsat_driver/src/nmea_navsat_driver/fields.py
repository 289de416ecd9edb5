"""The fields of NMEA sentences: places, times, numbers. An empty field is None; a wrong one raises Damaged."""

from __future__ import annotations

import datetime
import math
from collections.abc import Sequence

from nmea_navsat_driver.sentences import Damaged


def text(fields: Sequence[str], i: int) -> str:
    """The field, '' where the sentence ends before it."""
    return fields[i] if i < len(fields) else ''


def number(fields: Sequence[str], i: int, low: float = -math.inf, high: float = math.inf) -> float | None:
    """A decimal number from low to high."""
    word = text(fields, i)
    if not word:
        return None
    digits = word[1:] if word[0] in '+-' else word
    if not (digits.replace('.', '', 1).isascii() and digits.replace('.', '', 1).isdigit()):
        raise Damaged('field', f'a field is {word!r}, a number is due there')
    value = float(word)
    if not low <= value <= high:
        raise Damaged('field', f'a field is {word}, allowed are numbers from {low:g} to {high:g}')
    return value


def angle(fields: Sequence[str], i: int, most: float, signs: str) -> float | None:
    """Degrees of a place: (d)ddmm.mmm and, in the next field, one of two letters, the second of which makes it
    negative.
    """
    value, sign = number(fields, i, 0.0), text(fields, i + 1)
    if value is None or not sign:
        return None
    degrees, minutes = divmod(value, 100.0)
    found = degrees + minutes / 60.0
    if minutes >= 60.0 or found > most or sign not in signs or len(sign) != 1:
        raise Damaged('field', f'a place is {text(fields, i)} {sign}, which is not on the earth')
    return -found if sign == signs[1] else found


def utc(fields: Sequence[str], time: int, date: int) -> datetime.datetime | None:
    """hhmmss.ss and ddmmyy (2000 to 2099) in those fields."""
    clock, day = text(fields, time), text(fields, date)
    if not clock or not day:
        return None
    try:
        seconds = number((clock[4:],), 0, 0.0, 60.0)
        if len(day) != 6 or seconds is None:
            raise ValueError
        start = datetime.datetime(
            2000 + int(day[4:]), int(day[2:4]), int(day[:2]), int(clock[:2]), int(clock[2:4]), tzinfo=datetime.UTC
        )
    except ValueError:
        raise Damaged('field', f'a time is {clock!r} on {day!r}, hhmmss.ss and ddmmyy are due') from None
    return start + datetime.timedelta(seconds=seconds)
