"""Between frames and readings and their messages."""

from __future__ import annotations

import math
from collections.abc import Sequence

import rospy
from geometry_msgs.msg import Quaternion, Vector3Stamped
from sensor_msgs.msg import BatteryState, Imu, Joy, MagneticField, Range

from canserial.frame import Frame
from canserial.msg import CAN, Encoder
from canserial.reader.heading_filter import FIELD_NOISE
from canserial.reader.readings import (
    FIELD_OF_VIEW,
    NO_ESTIMATE,
    AnglesReading,
    BatteryReading,
    EncoderReading,
    FieldReading,
    HeadingReading,
    ImuReading,
    JoystickReading,
    RangeReading,
)

TESLA = 1e-6  # of a microtesla


def frame_to_msg(frame: Frame) -> CAN:
    """A Frame as canserial/CAN; its stamp is the frame's time of reception."""
    message = CAN(timestamp=rospy.Time.from_sec(frame.time), data=frame.data)
    message.stdId, message.extId = (0, frame.id) if frame.extended else (frame.id, -1)
    return message


def msg_to_frame(message: CAN) -> Frame:
    """canserial/CAN as a Frame; a negative extId marks a standard frame."""
    time = message.timestamp.to_sec()
    if message.extId >= 0:
        return Frame(message.extId, bytes(message.data), time, True)
    return Frame(message.stdId, bytes(message.data), time)


def encoder_to_msg(reading: EncoderReading) -> Encoder:
    """EncoderReading as canserial/Encoder."""
    message = Encoder(wheel=reading.wheel, steps=reading.steps, time_100us=reading.time_100us)
    message.header.stamp = rospy.Time.from_sec(reading.stamp)
    return message


def imu_to_msg(reading: ImuReading | HeadingReading, frame_id: str, variances: tuple) -> Imu:
    """ImuReading or HeadingReading as sensor_msgs/Imu, diagonal covariances; variances: see ImuReading.variances."""
    message = Imu()
    message.header.stamp = rospy.Time.from_sec(reading.stamp)
    message.header.frame_id = frame_id
    orientation = message.orientation
    orientation.x, orientation.y, orientation.z, orientation.w = quaternion(reading.roll, reading.pitch, reading.yaw)
    rate, acceleration = message.angular_velocity, message.linear_acceleration
    rate.x, rate.y, rate.z = reading.angular_velocity
    acceleration.x, acceleration.y, acceleration.z = reading.linear_acceleration
    angles, rates, accelerations = map(_diagonal, reading.variances(variances))
    message.orientation_covariance, message.angular_velocity_covariance = angles, rates
    message.linear_acceleration_covariance = accelerations
    return message


def field_to_msg(reading: FieldReading, frame_id: str) -> MagneticField:
    """FieldReading as sensor_msgs/MagneticField, T; of a field that the chair's iron is part of, the covariance is
    unknown (0).
    """
    message = MagneticField()
    message.header.stamp = rospy.Time.from_sec(reading.stamp)
    message.header.frame_id = frame_id
    field = message.magnetic_field
    field.x, field.y, field.z = (TESLA * value for value in reading.field)
    if reading.corrected:
        message.magnetic_field_covariance = _diagonal(((TESLA * FIELD_NOISE) ** 2,) * 3)
    return message


def has_estimate(covariance: Sequence[float]) -> bool:
    """False where the first element is -1: of that there is no estimate (sensor_msgs/Imu)."""
    return covariance[0] != NO_ESTIMATE[0]


def angles_to_msg(reading: AnglesReading, frame_id: str) -> Vector3Stamped:
    """AnglesReading as geometry_msgs/Vector3Stamped: x roll, y pitch, z yaw (modulo 65.536 deg), rad."""
    message = Vector3Stamped()
    message.header.stamp = rospy.Time.from_sec(reading.stamp)
    message.header.frame_id = frame_id
    message.vector.x, message.vector.y, message.vector.z = reading.roll, reading.pitch, reading.yaw
    return message


def range_to_msg(reading: RangeReading, minimum: float, maximum: float) -> Range:
    """RangeReading as sensor_msgs/Range in the frame `<name>_frame`."""
    message = Range(
        radiation_type=Range.ULTRASOUND,
        field_of_view=FIELD_OF_VIEW,
        min_range=minimum,
        max_range=maximum,
        range=reading.range,
    )
    message.header.stamp = rospy.Time.from_sec(reading.stamp)
    message.header.frame_id = f'{reading.name}_frame'
    return message


def joystick_to_msg(reading: JoystickReading) -> Joy:
    """JoystickReading as sensor_msgs/Joy: axes left, forward (-1..1), right, left wheel (rad/s); buttons [modo]."""
    message = Joy(axes=[reading.left, reading.forward, reading.right_wheel, reading.left_wheel], buttons=[reading.mode])
    message.header.stamp = rospy.Time.from_sec(reading.stamp)
    return message


def battery_to_msg(
    reading: BatteryReading, empty: float | None = None, full: float | None = None, charging: float | None = None
) -> BatteryState:
    """BatteryReading as sensor_msgs/BatteryState; what is not known is NaN or UNKNOWN.

    empty, full: V; where given, percentage is linear between them. charging: V; where given, from there on it is
    charging.
    """
    nan = math.nan
    voltage = reading.voltage
    percentage = nan if empty is None or full is None else min(1.0, max(0.0, (voltage - empty) / (full - empty)))
    status = BatteryState.POWER_SUPPLY_STATUS_UNKNOWN
    if charging is not None:
        status = (
            BatteryState.POWER_SUPPLY_STATUS_CHARGING
            if voltage >= charging
            else BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
        )
    message = BatteryState(
        voltage=voltage,
        temperature=nan,
        current=nan,
        charge=nan,
        capacity=nan,
        design_capacity=nan,
        percentage=percentage,
        present=True,
        power_supply_status=status,
        power_supply_health=BatteryState.POWER_SUPPLY_HEALTH_UNKNOWN,
        power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_UNKNOWN,
    )
    message.header.stamp = rospy.Time.from_sec(reading.stamp)
    return message


def quaternion(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """(x, y, z, w) of the rotation Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def yaw_of(q: Quaternion) -> float:
    """Yaw (rad) of a quaternion message; NaN if it is no rotation at all (not finite or all zero)."""
    norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if not (math.isfinite(norm) and norm > 1e-6):
        return math.nan
    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z)


def _diagonal(values):
    return [values[0], 0.0, 0.0, 0.0, values[1], 0.0, 0.0, 0.0, values[2]]
