"""One sample through the MPU6050, compiled: into its data registers and past its motion detector, a hundred times a
second.

What `Mpu6050` works out of its registers when they change comes in as `settings`; places in it, and in what the
detector remembers, are named here.
"""

from __future__ import annotations

from math import exp, log, pi

import numpy as np

from ahead_of_time import kernel

# In `settings`: counts per g and per deg/s, what the offset registers add (6 counts), MOT_THR (g), MOT_DUR (ms),
# MOT_COUNT (ms, below 0: a sample below the threshold clears the counter), the high-pass filter's frequency (Hz; 0:
# none, the difference from where it was switched on).
ACCEL_SCALE, GYRO_SCALE, SHIFT, THRESHOLD, DURATION, DECREMENT, HIGH_PASS_HZ, SETTINGS = 0, 1, 2, 8, 9, 10, 11, 12
# In `motion`: the counter (ms), whether there was a sample, the last one (3, g), what the filter passed of it (3, g).
COUNTER, SEEN, LAST, PASSED, MOTION = 0, 1, 2, 5, 8
TEMPERATURE_COUNTS = round((27.0 - 36.53) * 340.0)  # 27 degrees C


@kernel
def put(registers: np.ndarray, place: int, value: float) -> None:
    """A whole number into two registers, high byte first, limited to what they hold."""
    counts = min(max(round(value), -32768), 32767)
    registers[place], registers[place + 1] = counts >> 8 & 0xFF, counts & 0xFF


@kernel
def convert(data: np.ndarray, settings: np.ndarray, value: tuple[float, ...]) -> None:
    """Specific force (g) and angular velocity (deg/s), six values, into the fourteen data registers."""
    for axis in range(3):
        put(data, 2 * axis, value[axis] * settings[ACCEL_SCALE] + settings[SHIFT + axis])
        put(data, 8 + 2 * axis, value[3 + axis] * settings[GYRO_SCALE] + settings[SHIFT + 3 + axis])
    put(data, 6, float(TEMPERATURE_COUNTS))


@kernel
def detect(motion: np.ndarray, settings: np.ndarray, dt: float, ax: float, ay: float, az: float) -> bool:
    """Whether the motion detector fires: high-passed acceleration above MOT_THR on any axis for MOT_DUR.

    The chip looks every millisecond. A sample of `dt` (s) is a step at its input that then decays with the filter's
    time constant, so the time above the threshold is tau ln(peak / threshold), `dt` at most. The counter rises by one
    per millisecond above and falls by MOT_COUNT per millisecond below.
    """
    if motion[SEEN] == 0.0:
        motion[SEEN], motion[LAST], motion[LAST + 1], motion[LAST + 2] = 1.0, ax, ay, az
        return False
    x, y, z = (
        motion[PASSED] + ax - motion[LAST],
        motion[PASSED + 1] + ay - motion[LAST + 1],
        motion[PASSED + 2] + az - motion[LAST + 2],
    )
    motion[LAST], motion[LAST + 1], motion[LAST + 2] = ax, ay, az
    peak, threshold, hz = max(x, y, z, -x, -y, -z), settings[THRESHOLD], settings[HIGH_PASS_HZ]
    turn_ms = above = 1000.0 * dt
    decay = exp(-dt * 2.0 * pi * hz)
    motion[PASSED], motion[PASSED + 1], motion[PASSED + 2] = x * decay, y * decay, z * decay
    if peak <= threshold:
        if motion[COUNTER] == 0.0:
            return False
        above = 0.0
    elif threshold > 0.0 and hz > 0.0:
        above = min(turn_ms, 1000.0 * (1.0 / (2.0 * pi * hz)) * log(peak / threshold))
    motion[COUNTER] += above
    if above > 0.0 and motion[COUNTER] >= settings[DURATION]:
        motion[COUNTER] = 0.0
        return True
    if above < turn_ms:
        down = settings[DECREMENT]
        motion[COUNTER] = 0.0 if down < 0.0 else max(motion[COUNTER] - down * (turn_ms - above), 0.0)
    return False


@kernel
def take(
    data: np.ndarray, settings: np.ndarray, motion: np.ndarray, detects: bool, dt: float, value: tuple[float, ...]
) -> bool:
    """A sample (ax, ay, az in g, gx, gy, gz in deg/s), `dt` s after the last, into the fourteen data registers; whether
    the detector, if it `detects`, fires.
    """
    convert(data, settings, value)
    return detects and detect(motion, settings, dt, value[0], value[1], value[2])


def warm() -> None:
    """Compile, or load from the cache, the kernel for the types it is called with."""
    take(np.zeros(14, np.uint8), np.ones(SETTINGS), np.zeros(MOTION), True, 0.01, (0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
