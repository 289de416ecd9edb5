"""Messages that stay bytes until they are wanted: the two that come most are read straight from them, the two that go
most written so.

rospy builds a message of a dozen objects as it arrives, of which the filter takes a few numbers a moment later: that
cost the node more than the filter does. What is written has its length in front, as on a connection. The layout is
genpy's: little-endian, strings and their lengths in place, nothing aligned.
"""

from __future__ import annotations

import functools
from struct import Struct

import numpy as np

from sara_localization.geometry.stamps import Stamp, nanoseconds
from sara_localization.inputs.data import FilterOutput, ImuData, OdometryData, StampedTransform

_HEADER, _LENGTH = Struct('<4I'), Struct('<I')
_IMU, _ODOMETRY = Struct('<37d'), Struct('<85d')
_DOUBLE = 8


@functools.cache
def unread(message: type) -> type:
    """A subclass of the message, of the same type to ROS, that keeps its `bytes` as they came."""

    class Unread(message):
        def __init__(self):  # pylint: disable=super-init-not-called
            self.bytes = b''

        def deserialize(self, str):
            self.bytes = str
            return self

    return Unread


@functools.lru_cache(maxsize=64)
def _square(values, n):
    """(n, n) read-only: most sensors state the same covariance in every message."""
    return np.frombuffer(values).reshape(n, n)


def _header(data):
    """(stamp, frame_id, where the rest begins)."""
    _, secs, nsecs, length = _HEADER.unpack_from(data)
    end = _HEADER.size + length
    return Stamp(secs, nsecs), data[_HEADER.size : end].decode('utf-8', 'replace'), end


def imu(data: bytes) -> ImuData:
    """A sensor_msgs/Imu."""
    stamp, frame, at = _header(data)
    v = _IMU.unpack_from(data, at)

    def square(first):
        return _square(data[at + first * _DOUBLE : at + (first + 9) * _DOUBLE], 3)

    return ImuData(stamp, frame, v[:4], square(4), v[13:16], square(16), v[25:28], square(28))


def odometry(data: bytes) -> OdometryData:
    """A nav_msgs/Odometry."""
    stamp, frame, at = _header(data)
    begin = at + _LENGTH.size
    at = begin + _LENGTH.unpack_from(data, at)[0]
    v = _ODOMETRY.unpack_from(data, at)

    def square(first):
        return _square(data[at + first * _DOUBLE : at + (first + 36) * _DOUBLE], 6)

    return OdometryData(
        stamp,
        frame,
        data[begin:at].decode('utf-8', 'replace'),
        v[:3],
        v[3:7],
        square(7),
        v[43:46],
        v[46:49],
        square(49),
    )


@functools.lru_cache(maxsize=64)
def _layout(before, frame, child, after):
    """(layout, frame, child): `before` integers, a header, the child's name and `after` doubles."""
    frame, child = frame.encode(), child.encode()
    return Struct(f'<{before + 4}I{len(frame)}sI{len(child)}s{after}d'), frame, child


def write_odometry(seq: int, output: FilterOutput) -> bytes:
    """A nav_msgs/Odometry."""
    layout, frame, child = _layout(1, output.frame_id, output.child_frame_id, 7)
    P, pose = output.covariance, output.pose
    return layout.pack(
        layout.size + 78 * _DOUBLE - _LENGTH.size,
        seq,
        *divmod(nanoseconds(output.stamp), 10**9),
        len(frame),
        frame,
        len(child),
        child,
        *pose.translation,
        *pose.rotation,
    ) + b''.join((P[:6, :6].tobytes(), output.state[6:12].tobytes(), P[6:12, 6:12].tobytes()))


def write_transform(_seq: int, stamped: StampedTransform) -> bytes:
    """A tf2_msgs/TFMessage of one transform."""
    layout, frame, child = _layout(2, stamped.parent, stamped.child, 7)
    return layout.pack(
        layout.size - _LENGTH.size,
        1,
        0,
        *divmod(nanoseconds(stamped.stamp), 10**9),
        len(frame),
        frame,
        len(child),
        child,
        *stamped.transform.translation,
        *stamped.transform.rotation,
    )
