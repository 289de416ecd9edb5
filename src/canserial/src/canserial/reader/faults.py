"""Every kind of bad data that the reader drops, by name, with the sentence that a user reads."""

from __future__ import annotations

from collections.abc import Iterable

KINDS = {
    'stamp_implausible': 'frames whose time is none',
    'unknown_id': 'frames of an id that the bus description does not hold',
    'bad_length': 'frames of a wrong length',
    'bad_value': 'frames that hold no finite numbers, or a part that the bus description does not know',
    'encoder_jumped': 'encoder frames with more steps than the wheels can turn',
    'encoder_clock_stuck': "encoder frames whose own clock stood (old, repeated, or the motor node's clock is stuck)",
    'encoder_clock_jumped': 'encoder frames whose own clock jumped',
    'encoder_restarts': 'new beginnings of the encoders (was the motor node switched on anew?)',
    'joystick_implausible': 'joystick frames beyond the range of the joystick or of an unknown mode',
    'mode_implausible': 'mode frames (modoPC) of an unknown mode',
    'battery_implausible': 'battery frames beyond what the battery can have',
    'acceleration_implausible': "accelerations (RANGE_ACCEL) beyond the accelerometer's range",
    'acceleration_not_gravity': 'accelerations (RANGE_ACCEL) that are not gravity though the chair stands',
    'acceleration_stuck': 'accelerations (RANGE_ACCEL) that are always the same',
    'angles_implausible': 'angles (COMPLEMENTARY) beyond 90 deg',
    'angles_stuck': 'angles (COMPLEMENTARY) that are always the same',
    'madgwick_implausible': 'angles (MADGWICK) beyond 90 deg',
    'madgwick_stuck': 'angles (MADGWICK) that are always the same',
    'gyro_implausible': "rates (IMPACT_GYRO) beyond the gyroscope's range, or an impact that is neither 0 nor 1",
    'gyro_stuck': 'rates (IMPACT_GYRO) that are always the same',
    'imu_frozen': 'IMU frames whose six axes are the same to the last bit: its registers stand still',
    'imu_gaps': 'gaps between IMU frames (IMPACT_GYRO)',
    'imu_long_gaps': 'gaps of the IMU frames (IMPACT_GYRO) over which the turn is unknown',
    'imu_stale': 'IMU frames (IMPACT_GYRO) not newer than the last one',
    'imu_without_acceleration': 'IMU frames without recent accelerations (RANGE_ACCEL)',
    'imu_without_angles': 'IMU frames without recent angles (COMPLEMENTARY)',
    'imu_restarts': 'new beginnings of the IMU (the sensor node was silent for long and may have calibrated itself)',
    'compass_implausible': 'magnetic fields (COMPASS) that are stronger than the earth and any iron on the chair',
    'compass_stuck': 'magnetic fields (COMPASS) that are always the same',
    'compass_disturbed': "magnetic fields that are not the earth's: steel or a current is near, the gyroscope goes on",
    'compass_contradicts': 'magnetic fields that contradict the gyroscope, which goes on',
    'compass_restarts': 'new beginnings of the heading, after fields that contradicted the gyroscope on a long way',
    'set_pose_implausible': 'poses on /set_pose that are none, or without a time, or in a frame that is not known',
}


def kinds_of(sensors: Iterable[str]) -> dict[str, str]:
    """KINDS and those of the ultrasonic sensors of these names."""
    return {
        **KINDS,
        **{f'range_silent_{name}': f'ranges of {name}, whose sensor does not answer its node' for name in sensors},
        **{f'range_implausible_{name}': f'ranges of {name} beyond what its sensor can measure' for name in sensors},
    }
