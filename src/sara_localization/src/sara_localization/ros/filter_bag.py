"""The filter over a recorded bag, without a master: the same answer at every run, and faster than it was recorded.

    rosrun sara_localization filter_bag IN.bag OUT.bag --params FILE.yaml [--filter ekf]
        [--static-tf "X Y Z YAW PITCH ROLL PARENT CHILD"]...

Messages are delivered in the order and at the times they were recorded; a tick comes every 1/frequency after the first
used message (/tf counts) and runs after all that was received by then; five ticks follow the last. Transforms come from
the bag's /tf and /tf_static, from the option, and from the filter itself, whose own enter right after the tick that gives
them. OUT.bag holds odometry/filtered, /tf (what the filter broadcasts) and, if configured, accel/filtered. The last line on
stdout is JSON.
"""
from __future__ import annotations

import argparse
import json
import os
import sys
import time

import rosbag
import rospy
import yaml
from tf2_msgs.msg import TFMessage
from tqdm import tqdm

from ..config import ConfigError, FilterConfig
from ..engine import FilterEngine
from ..geometry import Transform
from ..transforms import TransformBuffer
from . import conversions

TICKS_AFTER_LAST = 5
TYPES = {'odom': ('nav_msgs/Odometry', conversions.odometry, 'add_odometry'),
         'imu': ('sensor_msgs/Imu', conversions.imu, 'add_imu'),
         'pose': ('geometry_msgs/PoseWithCovarianceStamped', conversions.pose, 'add_pose'),
         'twist': ('geometry_msgs/TwistWithCovarianceStamped', conversions.twist, 'add_twist')}


class UsageError(Exception):
    """Something the user gave cannot be used; the text says what and what would do."""


def load_params(path: str) -> dict:
    """The parameters of a YAML file; one level of a node's name around them is taken off."""
    try:
        with open(path) as file:
            params = yaml.safe_load(file)
    except (OSError, yaml.YAMLError) as error:
        raise UsageError('--params %s cannot be read: %s' % (path, error))
    if isinstance(params, dict) and len(params) == 1 and isinstance(next(iter(params.values())), dict):
        params = next(iter(params.values()))
    if not isinstance(params, dict):
        raise UsageError('--params %s must hold parameters by name' % path)
    return params


def static_transform(text: str):
    """(parent, child, Transform) from "X Y Z YAW PITCH ROLL PARENT CHILD" (m, rad)."""
    words = text.split()
    try:
        x, y, z, yaw, pitch, roll = (float(word) for word in words[:6])
        parent, child = words[6:]
    except ValueError:
        raise UsageError('--static-tf must be "X Y Z YAW PITCH ROLL PARENT CHILD" (m, rad), not "%s"' % text)
    return parent, child, Transform.from_xyz_rpy(x, y, z, roll, pitch, yaw)


class BagFilter:
    """The lockstep rule around a FilterEngine.

    Args:
        config: FilterConfig; static: list of (parent, child, Transform).
        on_output: called with (time of the tick in s, FilterOutput) for every output.
    """

    def __init__(self, config: FilterConfig, static=(), on_output=None, report=None):
        self.config, self.buffer = config, TransformBuffer()
        for parent, child, transform in static:
            self.buffer.set_transform(parent, child, transform)
        self.engine = FilterEngine(config, self.buffer, report)
        self.on_output = on_output or (lambda now, output: None)
        self._by_topic = {}
        for i in config.inputs:
            self._by_topic.setdefault(_resolved(i.topic), []).append(i)
        self.start = None
        self.ticks = self.messages = 0
        self.last = None

    @property
    def topics(self):
        """All topics to be read from the bag, with a leading slash."""
        return list(self._by_topic) + ['/tf', '/tf_static', '/set_pose']

    def deliver(self, topic: str, msg, received: rospy.Time):
        """One message of the bag at the time (rospy.Time) it was received."""
        topic = _resolved(topic)
        now = received.to_sec()
        if self.start is None and (topic in self._by_topic or topic == '/tf'):
            self.start = received
        if self.start is not None:
            while self._tick_time(self.ticks + 1) < received:
                self._tick()
        if topic in ('/tf', '/tf_static'):
            for stamped in map(conversions.transform, msg.transforms):
                self.buffer.set_transform(stamped.parent, stamped.child, stamped.transform,
                                          None if topic == '/tf_static' else stamped.stamp)
        elif topic == '/set_pose':
            refused = self.engine.set_pose(conversions.pose(msg), now)
            if refused:
                print('warning: ' + refused, file=sys.stderr)
        for i in self._by_topic.get(topic, ()):
            kind, convert, method = TYPES[i.kind]
            if msg._type != kind:
                raise UsageError('%s: %s is a %s in this bag, a %s is needed' % (i.name, topic, msg._type, kind))
            getattr(self.engine, method)(i.name, convert(msg))
            self.messages += 1

    def finish(self):
        """The ticks after the last message."""
        if self.start is not None:
            for _ in range(TICKS_AFTER_LAST):
                self._tick()

    def _tick_time(self, k):
        return self.start + rospy.Duration(0, round(k * 1e9 / self.config.frequency))

    def _tick(self):
        self.ticks += 1
        now = self._tick_time(self.ticks).to_sec()
        output = self.engine.tick(now)
        if output is None:
            return
        self.last = output
        if output.transform is not None:
            t = output.transform
            self.buffer.set_transform(t.parent, t.child, t.transform, t.stamp)
        self.on_output(now, output)


def _resolved(topic: str) -> str:
    return topic if topic.startswith('/') else '/' + topic


def run(in_bag, out_bag, config, static=(), quiet=False) -> dict:
    """Filter a bag into another; returns what is printed as JSON."""
    if os.path.abspath(in_bag) == os.path.abspath(out_bag):
        raise UsageError('OUT.bag must be another file than IN.bag')
    said = lambda sentence: None if quiet else tqdm.write('warning: ' + sentence, file=sys.stderr)
    with rosbag.Bag(in_bag) as source, rosbag.Bag(out_bag, 'w') as sink:

        def write(now, output):
            stamp = rospy.Time.from_sec(now)
            if output.transform is not None:
                sink.write('/tf', TFMessage([conversions.transform_message(output.transform)]), stamp)
            if output.published:
                sink.write('odometry/filtered', conversions.odometry_message(output), stamp)
                if config.publish_acceleration:
                    sink.write('accel/filtered', conversions.acceleration_message(output), stamp)

        machine = BagFilter(config, static, write, said)
        names = [topic for topic in source.get_type_and_topic_info().topics if _resolved(topic) in machine.topics]
        total = source.get_message_count(names) if names else 0
        began = time.perf_counter()
        with tqdm(total=total, unit='msg', file=sys.stderr, disable=quiet, mininterval=0.2) as bar:
            for topic, msg, received in source.read_messages(topics=names) if names else ():
                machine.deliver(topic, msg, received)
                bar.update()
            machine.finish()
        seconds = time.perf_counter() - began
    if machine.last is None:
        lines = machine.engine.status_lines(0.0)
        raise UsageError('no estimate came out of %s:\n  %s' % (in_bag, '\n  '.join(lines)))
    if not quiet:
        for line in machine.engine.status_lines(machine.last.stamp):
            print(line, file=sys.stderr)
    return {'final': [float(v) for v in machine.last.state[:6]], 'messages': machine.messages,
            'seconds': round(seconds, 3)}


def main(argv=None):
    parser = argparse.ArgumentParser(prog='filter_bag', description='Run the filter over a bag, without a master.')
    parser.add_argument('in_bag', metavar='IN.bag')
    parser.add_argument('out_bag', metavar='OUT.bag')
    parser.add_argument('--params', required=True, metavar='FILE.yaml', help='the parameters of ekf_localization_node')
    parser.add_argument('--filter', default='ekf', choices=['ekf'], help='which filter (default: ekf)')
    parser.add_argument('--static-tf', action='append', default=[], metavar='"X Y Z YAW PITCH ROLL PARENT CHILD"',
                        help='a fixed transform (m, rad) that the bag does not hold; may be given several times')
    arguments = parser.parse_args(rospy.myargv(sys.argv)[1:] if argv is None else argv)
    try:
        config = FilterConfig.from_params(load_params(arguments.params))
        for warning in config.warnings:
            print('warning: ' + warning, file=sys.stderr)
        static = [static_transform(text) for text in arguments.static_tf]
        result = run(arguments.in_bag, arguments.out_bag, config, static)
    except (UsageError, ConfigError, OSError, rosbag.ROSBagException) as error:
        sys.exit('filter_bag: %s' % error)
    print(json.dumps(result))
