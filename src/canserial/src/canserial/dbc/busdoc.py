"""A bus description as Markdown: what `rosrun canserial bus2md` prints."""

from __future__ import annotations

import argparse
import sys

from canserial.dbc.bus import BusDescription, BusError


def markdown(bus: BusDescription) -> str:
    """The document of a BusDescription: a section for each message, a line for each signal. Messages with the same
    signals share a section.
    """
    nodes = [f'- `{name}`: {comment}' for name, comment in bus.nodes.items() if comment]
    lines = [
        '# The bus',
        '',
        'Made by `rosrun canserial bus2md` from the DBC file; change that, not this page.',
        '',
        *((bus.comment, '') if bus.comment else ()),
        *((*nodes, '') if nodes else ()),
        'For each signal: its bits (8 n is the lowest of byte n), type, and step: the value is the raw number times '
        'its step, plus its offset if it has one. Unless stated, numbers are little-endian and frames have 8 bytes.',
    ]
    alike = {}
    for message in bus.messages:
        alike.setdefault(tuple(map(_signal, message.signals)), []).append(message)
    for signals, messages in alike.items():
        lines += ['', f'## {", ".join(f"{_identifier(message)} {message.name}" for message in messages)}']
        lines += [*map(_message, messages), '', *signals]
    return '\n'.join(lines) + '\n'


def _message(message):
    """From whom to whom, how often, how long, and what it is."""
    senders, receivers = _names(message.senders), _names(message.receivers)
    every = f', every {message.cycle_time} ms' if message.cycle_time else ''
    length = f', {message.length} bytes' if message.length != 8 else ''
    return f'{senders} to {receivers}{every}{length}. {message.comment or ""}'.rstrip()


def _signal(signal):
    order = ', big-endian' if signal.length > 8 and signal.byte_order != 'little_endian' else ''
    kind = ('float' if signal.is_float else 'int' if signal.is_signed else 'uint') + str(signal.length)
    scale = '' if signal.unit and signal.scale == 1 else _number(signal.scale)
    step = ' '.join(part for part in (scale, signal.unit) if part)
    step += f', offset {_number(signal.offset)}' if signal.offset else ''
    choices = ', '.join(f'{value} = {text}' for value, text in sorted((signal.choices or {}).items()))
    meaning = '; '.join(part for part in (signal.comment, choices) if part)
    last = signal.start + signal.length - 1
    bits = f'{signal.start}..{last}' if signal.byte_order == 'little_endian' else f'from {signal.start}'
    meaning = f'. {meaning[0].upper()}{meaning[1:]}' if meaning else ''
    return f'- `{signal.name}`: {bits}, {kind}{order}, {step}{meaning}'


def _identifier(message):
    return f'0x{message.frame_id:08X}' if message.is_extended_frame else f'0x{message.frame_id:03X}'


def _names(names):
    return ', '.join(f'`{name}`' for name in sorted(names)) or '-'


def _number(value):
    return f'{value:.10g}' if isinstance(value, int) or abs(value) >= 1e6 else f'{value:.6g}'


def main(arguments: list[str] | None = None) -> None:
    """Print the document of a bus description."""
    parser = argparse.ArgumentParser(prog='bus2md', description='A bus description (DBC) as Markdown.')
    parser.add_argument(
        'bus',
        nargs='?',
        help='a description that comes with a platform, or the path of a DBC file, each with +compass or without '
        '(without it: of the chosen platform)',
    )
    try:
        name = parser.parse_args(arguments).bus
        sys.stdout.write(markdown(BusDescription.named(name) if name else BusDescription.default()))
    except BusError as error:
        parser.error(str(error))
