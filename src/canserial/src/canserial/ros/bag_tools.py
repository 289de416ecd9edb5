"""Bus logs between candump's format and bags of canserial/CAN, without a master: `candump2bag`, `bag2candump`."""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from collections.abc import Callable
from typing import TextIO

import genpy
import rosbag
from tqdm import tqdm

from canserial.adapter.adapter import BadFrame, check
from canserial.adapter.candump import BadLine, parse, to_line
from canserial.msg import CAN
from canserial.ros.conversions import frame_to_msg, msg_to_frame
from sara_common.ros import bags

BAD_LINES_SHOWN = 10
LAST_STAMP = 2**32
"""s."""


class ToolError(Exception):
    """Why nothing could be converted, in one sentence."""


def candump_to_bag(
    log_path: str, bag_path: str, topic: str = 'canrx', interface: str | None = None, say: Callable[[str], None] = print
) -> Counter:
    """Every data frame of a log (of one interface, or of all) to a bag; returns a Counter of what the lines were.

    say(sentence) is called for bad lines, with their numbers. Raises ToolError.
    """
    counts, interfaces = Counter(), set()

    def convert(bag: rosbag.Bag) -> None:
        with _open(log_path) as log, _progress(log_path, os.path.getsize(log_path), 'B') as progress:
            for number, text in enumerate(log, 1):
                progress.update(len(text))
                if not text.strip():
                    continue
                try:
                    line = parse(text.decode('ascii', 'replace'))
                    if line.microseconds >= LAST_STAMP * 1000000:
                        raise BadLine('a stamp after 2106, which a bag cannot hold')
                except BadLine as error:
                    counts['bad'] += 1
                    if counts['bad'] <= BAD_LINES_SHOWN:
                        say(f'{log_path}, line {number}: {error}')
                    continue
                if interface not in (None, line.interface):
                    counts['other_interface'] += 1
                    continue
                interfaces.add(line.interface)
                counts[line.kind] += 1
                if line.frame:
                    message = frame_to_msg(line.frame)
                    message.timestamp = genpy.Time(line.microseconds // 1000000, line.microseconds % 1000000 * 1000)
                    # rosbag takes a time of 0 for "now".
                    bag.write(f'/{topic.strip("/")}', message, message.timestamp or genpy.Time(0, 1))

    _into(bag_path, lambda path: rosbag.Bag(path, 'w'), convert)
    if len(interfaces) > 1:
        say(
            f'{log_path} holds frames of {", ".join(sorted(interfaces))}: all of them are on one topic now '
            '(see --interface)'
        )
    return counts


def bag_to_candump(
    bag_path: str, log_path: str, topic: str = 'canrx', interface: str = 'can0', say: Callable[[str], None] = print
) -> Counter:
    """Every frame of a topic of a bag to a log, in the bag's order; returns a Counter. Raises ToolError."""
    counts = Counter()

    def convert(log: TextIO) -> None:
        try:
            bag = rosbag.Bag(bag_path)
        except (OSError, rosbag.ROSBagException) as error:
            raise ToolError(f'cannot read {bag_path}: {error}') from error
        with bag:
            found = bag.get_type_and_topic_info().topics
            names = [name for name in found if name.strip('/') == topic.strip('/')]
            if not names:
                raise ToolError(f'{bag_path} has no topic {topic}, but {", ".join(sorted(found)) or "none at all"}')
            wrong = [found[name].msg_type for name in names if found[name].msg_type != CAN._type]
            if wrong:
                raise ToolError(f'{topic} of {bag_path} is of type {wrong[0]}, not {CAN._type}')
            with _progress(bag_path, bag.get_message_count(names), ' frames') as progress:
                for _, message, time in bags.messages(bag, names):
                    progress.update()
                    frame = msg_to_frame(message)
                    try:
                        check(frame)
                    except BadFrame as error:
                        counts['bad'] += 1
                        if counts['bad'] <= BAD_LINES_SHOWN:
                            say(f'{bag_path}, {time.to_sec():.6f}: {error}')
                        continue
                    stamp = message.timestamp or time
                    log.write(to_line(frame, interface, stamp.secs * 1000000 + stamp.nsecs // 1000) + '\n')
                    counts['data'] += 1

    try:
        _into(log_path, lambda path: open(path, 'w', encoding='ascii'), convert)  # noqa: SIM115 (_into closes it)
    except rosbag.ROSBagException as error:
        raise ToolError(str(error)) from error
    return counts


def _open(path):
    try:
        return open(path, 'rb')  # noqa: SIM115 (the caller closes it)
    except OSError as error:
        raise ToolError(f'cannot read {path}: {error.strerror}') from error


def _progress(name, total, unit):
    return tqdm(total=total, unit=unit, unit_scale=True, desc=os.path.basename(name), delay=1.0, disable=None)


def _into(path, opener, convert):
    """Write a new file, which takes its name only when it is complete."""
    if os.path.exists(path):
        raise ToolError(f'{path} exists already')
    partial = f'{path}.part'
    try:
        target = opener(partial)
    except OSError as error:
        raise ToolError(f'cannot write {path}: {error.strerror}') from error
    try:
        with target:
            convert(target)
        os.rename(partial, path)
    finally:
        if os.path.exists(partial):
            os.unlink(partial)


def _parser(name: str, description: str, source: str, target: str) -> argparse.ArgumentParser:
    """The options that both commands have; source and target: what their files are called in the help."""
    parser = argparse.ArgumentParser(prog=name, description=description)
    parser.add_argument('source', metavar=source)
    parser.add_argument('target', metavar=target, help='must not exist yet')
    parser.add_argument('--topic', default='canrx', help='topic of the bag (default: %(default)s)')
    return parser


def _run(parser: argparse.ArgumentParser, convert: Callable[..., Counter], arguments: list[str] | None) -> None:
    options = parser.parse_args(arguments)
    try:
        counts = convert(
            options.source, options.target, options.topic, options.interface, lambda text: print(text, file=sys.stderr)
        )
    except ToolError as error:
        sys.exit(f'{parser.prog}: {error}')
    left = ', '.join(
        f'{count} {kind.replace("_", " ")}' for kind, count in sorted(counts.items()) if kind != 'data' and count
    )
    print(f'{counts["data"]} frames to {options.target}' + (f'; left out: {left}' if left else ''))
    if not counts['data']:
        sys.exit(1)


def candump2bag(arguments: list[str] | None = None) -> None:
    """The command of that name."""
    parser = _parser('candump2bag', 'A log of candump -l to a bag of canserial/CAN.', 'LOG', 'BAG')
    parser.add_argument('--interface', help='take frames of this interface only (default: all)')
    _run(parser, candump_to_bag, arguments)


def bag2candump(arguments: list[str] | None = None) -> None:
    """The command of that name."""
    parser = _parser('bag2candump', 'A bag of canserial/CAN to a log as candump -l writes it.', 'BAG', 'LOG')
    parser.add_argument('--interface', default='can0', help='name of the interface in the log (default: %(default)s)')
    _run(parser, bag_to_candump, arguments)
