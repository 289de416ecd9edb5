"""The simulator's messages: its true pose, and its state for /diagnostics."""

from __future__ import annotations

from math import cos, sin

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan

from sara_common.diagnostics import ERROR, OK, WARN, Status
from sara_common.ros.diagnostics import diagnostic_array
from sara_common.scans import Sweep
from sara_sim.bus.lawicel import LawicelAdapter
from sara_sim.chair import SimulatedChair


def ground_truth(chair: SimulatedChair, stamp: rospy.Time) -> Odometry:
    """The true pose, map to base_link, and the true speed along and about the chair's axes (m/s, rad/s)."""
    message = Odometry()
    message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, 'map', 'base_link'
    x, y, yaw = chair.pose
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    orientation = message.pose.pose.orientation
    orientation.x, orientation.y, orientation.z, orientation.w = _quaternion(*chair.attitude, yaw)
    message.twist.twist.linear.x, message.twist.twist.angular.z = chair.velocity
    return message


def laser_scan(sweep: Sweep, frame: str, period: float) -> LaserScan:
    """A sweep as a scanner's driver publishes it: stamped with its first ray's time, without intensities. period: s
    from one sweep to the next.
    """
    message = LaserScan()
    message.header.stamp, message.header.frame_id = rospy.Time.from_sec(sweep.stamp), frame
    message.angle_min, message.angle_max = sweep.angle_min, sweep.angle_max
    message.angle_increment, message.time_increment = sweep.angle_increment, sweep.time_increment
    message.scan_time = period
    message.range_min, message.range_max = sweep.range_min, sweep.range_max
    message.ranges = sweep.ranges.tolist()
    return message


def status(
    chair: SimulatedChair, adapter: LawicelAdapter, stamp: rospy.Time, node: dict[str, object], slow: str
) -> DiagnosticArray:
    """`node`: what the node itself counts, by name. `slow`: a sentence if simulated time is too slow, else empty."""
    level, text = _verdict(chair, adapter, slow)
    values = {**_values(chair, adapter), **node}
    return diagnostic_array(stamp, [Status('chair', level, text, tuple(values.items()))], hardware_id='simulated')


def _verdict(chair: SimulatedChair, adapter: LawicelAdapter, slow: str) -> tuple[int, str]:
    if not chair.plugged:
        return WARN, 'the adapter is unplugged'
    if not adapter.is_open:
        return WARN, 'nobody has opened the CAN channel'
    if not adapter.agrees:
        text = f'the CAN channel is opened with {adapter.rate:.0f} bit/s, the bus has {adapter.bus_rate}'
        return ERROR, text
    faults = chair.faults.list()
    if faults:
        return WARN, f'{len(faults)} faults on command'
    if chair.drive.touching:
        return WARN, 'the chair touches a wall or an obstacle'
    if slow:
        return WARN, slow
    return OK, 'running'


def _values(chair: SimulatedChair, adapter: LawicelAdapter) -> dict[str, object]:
    return {
        'adapter plugged in': chair.plugged,
        'channel': adapter.state,
        'bit rate agrees': adapter.agrees,
        'faults on command': '; '.join(chair.faults.list()) or 'none',
        'sensor node': chair.sensors.state,
        'contacts': chair.contacts,
        'touching': chair.drive.touching,
        'modoPC': chair.motor.mode,
        **{f'adapter: {k}': v for k, v in sorted(adapter.counts.items())},
        **{f'bus: {k}': v for k, v in sorted(chair.counts.items())},
        **{f'motor node: {k}': v for k, v in sorted(chair.motor.counts.items())},
        **{f'sensor node: {k}': v for k, v in sorted(chair.sensors.counts.items())},
    }


def _quaternion(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    cr, sr, cp, sp, cy, sy = cos(roll / 2), sin(roll / 2), cos(pitch / 2), sin(pitch / 2), cos(yaw / 2), sin(yaw / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )
