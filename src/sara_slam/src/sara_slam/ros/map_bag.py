"""slam_gmapping over a recorded bag, without a master: the same map at every run, faster than it was recorded.

    rosrun sara_slam map_bag IN.bag OUT [--params FILE.yaml] [--scan TOPIC] [--static-tf "X Y Z YAW PITCH ROLL PARENT
        CHILD"]...

Writes OUT.pgm and OUT.yaml. The last line on stdout is JSON: scans, key scans, loops, seconds, times real time.
"""

from __future__ import annotations

import argparse
import json
import sys
import time

import rosbag
import rospy
from tqdm import tqdm

from sara_common.config import ConfigError
from sara_common.ros import bags
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.ros.amcl.scans import WaitingScans
from sara_localization.ros.bags.bag_tools import (
    TF_TOPICS,
    UsageError,
    Warnings,
    add_static_option,
    enter_transforms,
    load_params,
    static_transform,
    topic_types,
)
from sara_localization.ros.inputs import resolved
from sara_nav.maps.map_saver import SaveError, SaverConfig, save_map
from sara_slam.mapping.slam import Slam
from sara_slam.mapping.slam_config import SlamConfig

LASER_SCAN = 'sensor_msgs/LaserScan'


class BagSlam:
    """A Slam that is given a bag's messages in their order; `topic`: of the scans."""

    def __init__(self, config: SlamConfig, topic: str, warn: Warnings):
        self.config, self.topic = config, topic
        self.slam, self.transforms = Slam(config, warn), TransformBuffer()
        self._waiting = WaitingScans(self.transforms, self._lost)

    def _lost(self, sentence):
        self.slam.trouble('no_transform', sentence)

    def deliver(self, topic: str, msg: object, received: float) -> None:
        """A message of the bag, received at a time (s)."""
        if topic == self.topic:
            self._waiting.add(msg, received)
        else:
            enter_transforms(self.transforms, topic, msg)
        for scan in self._waiting.ready(self.config.odom_frame, self.config.base_frame):
            self.slam.on_scan(scan)

    def why_nothing(self, now: float) -> str:
        """What scans wait for, in a sentence, after the bag's last message at a time (s)."""
        return self._waiting.waiting_for(now + 1e6) or f'no scan on {self.topic} could be used'


def scan_topic(bag: rosbag.Bag, wanted: str | None) -> str:
    """The topic of the scans: the one that is wanted, or the only one of LaserScans. Raises UsageError."""
    topics = [topic for topic, type_ in topic_types(bag) if type_ == LASER_SCAN]
    if wanted is not None and resolved(wanted) in topics:
        return resolved(wanted)
    if wanted is None and len(topics) == 1:
        return topics[0]
    held = ', '.join(sorted(topics)) or 'none'
    if wanted is not None:
        raise UsageError(f'the bag has no {LASER_SCAN} on {resolved(wanted)}; it has them on: {held}')
    raise UsageError(f'the bag has {LASER_SCAN} on: {held}; say which by --scan')


def run(in_bag: str, out: str, config: SlamConfig, arguments: argparse.Namespace) -> dict[str, float | int]:
    """Map a bag; returns what is printed as JSON. Raises UsageError, OSError, ROSBagException."""
    warn, saver = Warnings(arguments.quiet), SaverConfig(name=out)
    if saver.faults():
        raise UsageError('; '.join(saver.faults()))
    with rosbag.Bag(in_bag) as bag:
        machine = BagSlam(config, scan_topic(bag, arguments.scan), warn)
        for parent, child, transform in map(static_transform, arguments.static_tf):
            machine.transforms.set_transform(parent, child, transform)
        names = [name for name in bag.get_type_and_topic_info().topics if resolved(name) in (machine.topic, *TF_TOPICS)]
        began, last = time.perf_counter(), 0.0
        _enter_static(bag, names, machine)
        with tqdm(total=bag.get_message_count(names), unit='msg', file=sys.stderr, disable=arguments.quiet) as bar:
            for name, msg, received in bags.messages(bag, names):
                last = received.to_sec()
                machine.deliver(resolved(name), msg, last)
                bar.update()
        length = bag.get_end_time() - bag.get_start_time()
    slam = machine.slam
    if not slam.scans:
        raise UsageError(f'no map came out of {in_bag}: {machine.why_nothing(last)}')
    slam.finish()
    save_map(slam.map(), saver)
    seconds = time.perf_counter() - began
    return {
        'scans': slam.counts['scans'],
        'key_scans': len(slam.scans),
        'loops': slam.counts['loops'],
        'seconds': round(seconds, 2),
        'times_real_time': round(length / seconds, 1),
    }


def _enter_static(bag, names, machine):
    """Fixed transforms hold from the start, whenever they were recorded."""
    for name in names:
        if resolved(name) == '/tf_static':
            for _, msg, received in bags.messages(bag, [name]):
                machine.deliver('/tf_static', msg, received.to_sec())


def main(argv: list[str] | None = None) -> None:
    """The program; its status is 1 where something cannot be used."""
    parser = argparse.ArgumentParser(prog='map_bag', description='Make a map of a bag, without a master.')
    add = parser.add_argument
    add('in_bag', metavar='IN.bag')
    add('out', metavar='OUT', help='the map goes to OUT.pgm and OUT.yaml')
    add('--params', metavar='FILE.yaml', help='the parameters of slam_gmapping')
    add('--scan', metavar='TOPIC', help='of the scans; needed where the bag has several')
    add('--quiet', action='store_true', help='no progress, no warnings')
    add_static_option(parser)
    arguments = parser.parse_args(rospy.myargv(sys.argv)[1:] if argv is None else argv)
    try:
        config = SlamConfig.from_params(load_params(arguments.params) if arguments.params else {})
        if not arguments.quiet:
            for warning in config.warnings:
                print(f'warning: {warning}', file=sys.stderr)
        result = run(arguments.in_bag, arguments.out, config, arguments)
    except (UsageError, ConfigError, SaveError, OSError, rosbag.ROSBagException) as error:
        sys.exit(f'map_bag: {error}')
    print(json.dumps(result))
