"""What the offline tools share: parameters from a file, fixed transforms from the command line, messages from a bag."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from struct import error as StructError
from typing import Any

import rosbag

from sara_common.config import ConfigError
from sara_common.diagnostics import ERROR
from sara_common.ros import bags
from sara_localization.checks import check_config
from sara_localization.checks.findings import sorted_findings
from sara_localization.config import parameters
from sara_localization.config.filter_config import FilterConfig
from sara_localization.geometry.rigid import Transform
from sara_localization.ros import conversions
from sara_localization.ros.bags.bag_reader import BagReader, Unreadable
from sara_localization.ros.inputs import KINDS, resolved, why_silent

TF_TOPICS = ('/tf', '/tf_static')


class UsageError(Exception):
    """Something the user gave cannot be used; the text says what and what would do."""


def load_params(path: str) -> dict:
    """The parameters of a YAML file; one level of a node's name around them is taken off. Raises UsageError."""
    try:
        return parameters.load(path)
    except ConfigError as error:
        raise UsageError(str(error)) from error


def checked_config(params: dict, kind: str, quiet: bool = False) -> FilterConfig:
    """The configuration of a filter ('ekf' or 'ukf'); what is doubtful about it goes to stderr. Raises UsageError."""
    config, findings = check_config.check(params, kind)
    if config is None:
        raise UsageError('\n'.join(finding.sentence for finding in findings))
    if not quiet:
        for finding in sorted_findings(findings):
            print('{}: {}'.format('error' if finding.level == ERROR else 'warning', finding.sentence), file=sys.stderr)
    return config


def static_transform(text: str) -> tuple[str, str, Transform]:
    """(parent, child, Transform) from "X Y Z YAW PITCH ROLL PARENT CHILD" (m, rad)."""
    words = text.split()
    try:
        x, y, z, yaw, pitch, roll = (float(word) for word in words[:6])
        parent, child = words[6:]
    except ValueError:
        raise UsageError(f'--static-tf must be "X Y Z YAW PITCH ROLL PARENT CHILD" (m, rad), not "{text}"') from None
    return parent, child, Transform.from_xyz_rpy(x, y, z, roll, pitch, yaw)


def add_static_option(parser: argparse.ArgumentParser) -> None:
    """The option --static-tf."""
    parser.add_argument(
        '--static-tf',
        action='append',
        default=[],
        metavar='"X Y Z YAW PITCH ROLL PARENT CHILD"',
        help='a fixed transform (m, rad) that the bag does not hold; may be given several times',
    )


def enter_transforms(buffer: Any, topic: str, msg: Any) -> None:
    """Put a TFMessage of the bag into a TransformBuffer."""
    for stamped in map(conversions.transform, msg.transforms):
        buffer.set_transform(
            stamped.parent, stamped.child, stamped.transform, None if topic == '/tf_static' else stamped.stamp
        )


def topic_types(bag: rosbag.Bag) -> list[tuple[str, str]]:
    """[(topic, type), ...] of a bag."""
    return [(resolved(topic), info.msg_type) for topic, info in bag.get_type_and_topic_info().topics.items()]


def wrong_topics(config: FilterConfig, published: Any) -> list[tuple[str, str]]:
    """(input's name, sentence) for each input whose topic the bag lacks or holds with another type."""
    found = []
    for i in config.inputs:
        why = why_silent(i.kind, resolved(i.topic), published)
        if why:
            found.append(
                (
                    i.name,
                    '{}: {}.'.format(
                        i.name,
                        why.replace(
                            f'nobody publishes {resolved(i.topic)}', f'the bag has no topic {resolved(i.topic)}'
                        ),
                    ),
                )
            )
    return found


def by_topic(config: FilterConfig) -> dict[str, list]:
    """{topic with a leading slash: [InputConfig, ...]}."""
    found = {}
    for i in config.inputs:
        found.setdefault(resolved(i.topic), []).append(i)
    return found


class Unread:
    """A message as it lies in a bag: what an input takes is read straight from its bytes, which spares making the
    message.
    class_of: called for the message's class where it is wanted after all.
    """

    __slots__ = ('_type', 'bytes', '_class_of')

    def __init__(self, type_, data, class_of):
        self._type, self.bytes, self._class_of = type_, data, class_of

    @property
    def message(self) -> Any:
        """The message itself."""
        with bags.damage_told(f'a {self._type}'):
            return self._class_of()().deserialize(self.bytes)


def unread_messages(bag: rosbag.Bag, topics: Iterable[str]) -> Iterator[tuple]:
    """Yield (topic, Unread, time of reception) of a bag, in its order; the time is a Stamp or rospy.Time."""
    with open(bag.filename, 'rb') as file, bags.damage_told(bag.filename):
        try:
            reader = BagReader(file)
        except Unreadable:
            for topic, (type_, data, _, _, class_), received in bag.read_messages(topics=topics, raw=True):
                yield topic, Unread(type_, data, lambda class_=class_: class_), received
            return
        for connection, data, received in reader.messages(topics):
            yield connection.topic, Unread(connection.type, data, connection.message_class), received


def converted(i: Any, topic: str, msg: Any) -> Any:
    """A message of the bag, or an Unread, as the plain data of an input's kind; raises UsageError for another type."""
    kind = KINDS[i.kind]
    if msg._type != kind.type:  # pylint: disable=protected-access
        raise UsageError(f'{i.name}: {topic} is a {msg._type} in this bag, a {kind.type} is needed')
    if not isinstance(msg, Unread):
        return kind.convert(msg)
    try:
        return kind.read(msg.bytes)
    except (StructError, ValueError) as error:
        raise UsageError(f'{i.name}: a message on {topic} is damaged: {error}') from error


class Warnings:
    """Sentences to stderr, each once, without breaking a progress bar."""

    def __init__(self, quiet=False):
        self.quiet, self.counts = quiet, Counter()

    def __call__(self, sentence):
        self.counts[sentence] += 1
        if self.counts[sentence] == 1:
            self.note('warning: ' + sentence)

    def note(self, sentence: str) -> None:
        """A sentence that is no warning."""
        if not self.quiet:
            from tqdm import tqdm

            tqdm.write(sentence, file=sys.stderr)
