"""Every kind of bad data that the reader drops, by name, with the sentence that a user reads."""

from canserial.reader.ranges import NAMES

KINDS = {
    'stamp_implausible': 'frames whose time is none',
    'unknown_id': 'frames of an id that the bus description does not hold',
    'bad_length': 'frames of a wrong length',
    'encoder_jumped': 'encoder frames with more steps than the wheels can turn',
    'encoder_clock_stuck': "encoder frames whose own clock stood (old, repeated, or the motor node's clock is stuck)",
    'encoder_clock_jumped': 'encoder frames whose own clock jumped',
    'encoder_restarts': 'new beginnings of the encoders (was the motor node switched on anew?)',
    'joystick_implausible': 'joystick frames beyond the range of the joystick or of an unknown mode',
    'mode_implausible': 'mode frames (modoPC) of an unknown mode',
    'battery_implausible': 'battery frames beyond what the battery can have',
    'acceleration_implausible': "accelerations (0x203) beyond the accelerometer's range",
    'acceleration_not_gravity': 'accelerations (0x203) that are not gravity though the chair stands',
    'acceleration_stuck': 'accelerations (0x203) that are always the same',
    'angles_implausible': 'angles (0x205) beyond 90 deg',
    'angles_stuck': 'angles (0x205) that are always the same',
    'madgwick_implausible': 'angles (0x206) beyond 90 deg',
    'madgwick_stuck': 'angles (0x206) that are always the same',
    'gyro_implausible': "rates (0x204) beyond the gyroscope's range, or an impact that is neither 0 nor 1",
    'gyro_stuck': 'rates (0x204) that are always the same',
    'imu_gaps': 'gaps between IMU frames (0x204)',
    'imu_long_gaps': 'gaps of the IMU frames (0x204) over which the turn is unknown',
    'imu_stale': 'IMU frames (0x204) not newer than the last one',
    'imu_without_acceleration': 'IMU frames without recent accelerations (0x203)',
    'imu_without_angles': 'IMU frames without recent angles (0x205)',
    'imu_restarts': 'new beginnings of the IMU (the sensor node was silent for long and may have calibrated itself)',
    'set_pose_implausible': 'poses on /set_pose without a yaw or a time',
    **{f'range_silent_{name}': f'ranges of {name}, whose sensor does not answer its node' for name in NAMES},
    **{f'range_implausible_{name}': f'ranges of {name} beyond what its sensor can measure' for name in NAMES},
}
