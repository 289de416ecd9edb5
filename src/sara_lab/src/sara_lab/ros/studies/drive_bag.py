"""A recorded drive of the stack in lockstep as messages under the names of sara.launch, in a bag or an MCAP file."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import rosbag
import rospy
from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from move_base_msgs.msg import MoveBaseActionGoal, MoveBaseActionResult
from tf2_msgs.msg import TFMessage

from sara_common.planar import Pose2D
from sara_lab.campaign.results.recorded import Recording, Sample
from sara_lab.ros.studies.bag_report import WHEELS
from sara_lab.ros.studies.bag_track import COMMANDS, DIAGNOSTICS, FUSED, GOALS, PASSED, RESULTS, TRUE
from sara_nav.grids.grid import GridGeometry
from sara_nav.ros.conversions import grid_to_msg, pose_stamped, twist_to_msg
from sara_sim.ros.robot_messages import BASE, ODOM, odometry, transform
from sara_sim.world.world import World

BEGIN_S = 1.0  # a time of 0 is "now" to rosbag, and "the newest" to tf: the drive's 0 is this
Message = tuple[float, str, Any]
"""(s, topic, message)"""


def messages(recording: Recording) -> Iterator[Message]:
    """The messages of a Recording by time: map, poses, transforms, commands, goals and their ends, contacts."""
    events: list[tuple[float, str, Any]] = []
    for number, (t, pose) in enumerate(recording.goals):
        events.append((t, GOALS, _goal(t, str(number), pose)))
    for number, (t, reached, text) in enumerate(recording.ends):
        events.append((t, RESULTS, _result(t, str(number), reached, text)))
    events += [message for sample in recording.samples for message in _sampled(sample)]
    events.sort(key=lambda event: event[0])
    yield BEGIN_S, '/map', _map(recording.world)
    yield from ((BEGIN_S + t, topic, message) for t, topic, message in events)


def _sampled(sample: Sample) -> Iterator[Message]:
    t, stamp = sample.t, _stamp(sample.t)
    yield t, TRUE, odometry(stamp, 'map', sample.true, sample.velocity)
    yield t, WHEELS, odometry(stamp, ODOM, sample.odometry, sample.velocity)
    found = [transform(stamp, ODOM, BASE, sample.odometry)]
    if sample.map_from_odom is not None:
        found.append(transform(stamp, 'map', ODOM, sample.map_from_odom))
    yield t, '/tf', TFMessage(found)
    if sample.fused is not None:
        yield t, FUSED, odometry(stamp, 'map', sample.fused, sample.velocity)
    if sample.asked is not None:
        yield t, COMMANDS, twist_to_msg(*sample.asked)
    if sample.passed is not None:
        yield t, PASSED, twist_to_msg(*sample.passed)
    status = DiagnosticStatus(name='simulator', values=[KeyValue('contacts', str(sample.contacts))])
    diagnostics = DiagnosticArray(status=[status])
    diagnostics.header.stamp = stamp
    yield t, DIAGNOSTICS, diagnostics


def _stamp(t: float) -> rospy.Time:
    return rospy.Time.from_sec(BEGIN_S + t)


def _goal(t, number, pose):
    message = MoveBaseActionGoal()
    message.header.stamp = message.goal_id.stamp = _stamp(t)
    message.goal_id.id = number
    message.goal.target_pose = pose_stamped(Pose2D(*pose), 'map', _stamp(t))
    return message


def _result(t, number, reached, text):
    message = MoveBaseActionResult()
    message.header.stamp = _stamp(t)
    message.status.goal_id.id, message.status.text = number, text
    message.status.status = GoalStatus.SUCCEEDED if reached else GoalStatus.ABORTED
    return message


def _map(world: World):
    height, width = world.occupied.shape
    geometry = GridGeometry(width, height, world.resolution, *world.origin)
    return grid_to_msg(np.where(world.occupied, 100, 0).astype(np.int8), geometry, 0.0, 'map', _stamp(0.0))


def write_bag(path: Path, recording: Recording) -> None:
    """Write a bag. Raises OSError."""
    with rosbag.Bag(str(path), 'w', compression=rosbag.Compression.LZ4) as bag:
        for t, topic, message in messages(recording):
            bag.write(topic, message, rospy.Time.from_sec(t))


def write_mcap(path: Path, recording: Recording) -> None:
    """Write an MCAP file of the profile ros1 (https://mcap.dev/spec/registry). Raises OSError."""
    from mcap.writer import CompressionType, Writer

    channels: dict[str, int] = {}
    with tempfile.TemporaryDirectory(prefix='sara_mcap_') as folder, path.open('wb') as stream:
        write_bag(bag := Path(folder) / 'drive.bag', recording)
        writer = Writer(stream, compression=CompressionType.LZ4)
        writer.start('ros1', 'sara_lab')
        with rosbag.Bag(str(bag)) as source:
            for topic, (kind, data, _, _, made), t in source.read_messages(raw=True):
                if topic not in channels:
                    schema = writer.register_schema(kind, 'ros1msg', made._full_text.encode())
                    channels[topic] = writer.register_channel(topic, 'ros1', schema)
                writer.add_message(channels[topic], t.to_nsec(), data, t.to_nsec())
        writer.finish()
