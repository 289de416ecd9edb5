"""The chip at register level: what is written, what is read, and what only a chip that is awake does."""

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_lowlevel.sensor.mpu6050 import THESIS_LISTING
from sara_lowlevel.sensor.mpu6050 import Mpu6050 as Driver
from sara_sim.chips import mpu6050_sample
from sara_sim.chips.i2c_bus import SimulatedI2c
from sara_sim.chips.mpu6050 import (
    ACCEL_CONFIG,
    DATA,
    DECREMENT_MS,
    GYRO_CONFIG,
    INT_ENABLE,
    INT_PIN_CFG,
    INT_STATUS,
    MOT_DETECT_CTRL,
    MOT_DUR,
    MOT_THR,
    PWR_MGMT_1,
    SIGNAL_PATH_RESET,
    WHO_AM_I,
    WRITABLE,
    XA_OFFS,
    XG_OFFS,
    Mpu6050,
)

REST = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
SELF_CLEARING = {PWR_MGMT_1, SIGNAL_PATH_RESET, 0x6A}


def awake(**settings):
    chip = Mpu6050(settling=(0.0, 0.0, 1.0))
    chip.write(PWR_MGMT_1, [0x01])
    for register, value in settings.items():
        chip.write(int(register[1:], 16), [value])
    steps(chip, 5)
    return chip


def steps(chip, count, value=REST):
    for _ in range(count):
        chip.step(0.01, tuple(value))


def counts(chip):
    ax, ay, az, _, gx, gy, gz = struct.unpack('>7h', bytes(chip.read(DATA, 14)))
    assert chip.counts == (ax, ay, az, gx, gy, gz)
    return ax, ay, az, gx, gy, gz


def test_after_power_up_and_after_a_reset_it_sleeps():
    chip = awake(_1C=0x19, _06=1)
    assert not chip.asleep and chip.read(ACCEL_CONFIG, 1) == [0x19]
    chip.write(PWR_MGMT_1, [0x80])
    assert chip.read(PWR_MGMT_1, 1)[0] & 0x80, 'the reset bit stands until the reset is over'
    steps(chip, 10)
    assert chip.read(PWR_MGMT_1, 1) == [0x40] and chip.asleep
    assert chip.read(ACCEL_CONFIG, 1) == [0] and chip.read(WHO_AM_I, 1) == [0x68]
    assert struct.unpack('>3h', bytes(chip.read(XA_OFFS, 6))) == chip.trim and any(chip.trim)


def test_writes_within_a_reset_are_lost():
    chip = awake()
    chip.write(PWR_MGMT_1, [0x80])
    chip.write(ACCEL_CONFIG, [0x01])
    steps(chip, 10)
    assert chip.read(ACCEL_CONFIG, 1) == [0]


@given(st.integers(0, 127), st.integers(0, 255))
def test_only_bits_that_can_be_written_change(register, value):
    chip = Mpu6050()
    before = chip.read(register, 1)[0]
    chip.write(register, [value])
    mask = WRITABLE.get(register, 0)
    after = chip.read(register, 1)[0]
    if register == PWR_MGMT_1 and value & 0x80:
        assert after == 0xC0
    else:
        assert after == before & ~mask & 0xFF | value & mask
    assert chip.read(WHO_AM_I, 1) == [0x68]


def test_the_listing_of_the_thesis_leaves_it_asleep_and_the_driver_wakes_it():
    chip = awake()
    for register, value in THESIS_LISTING:
        chip.write(register, [value])
    steps(chip, 500, (0.5, 0.5, 0.5, 9.0, 9.0, 9.0))
    assert chip.asleep and counts(chip) == (0,) * 6
    driver = Driver(SimulatedI2c({0x68: chip}))
    for tick in range(100):
        driver.advance(tick * 0.01)
        chip.step(0.01, REST)
    assert driver.ready and not chip.asleep
    assert driver.sample()[2] == pytest.approx(16384, abs=400)


def test_asleep_the_data_stand_still():
    chip = awake()
    steps(chip, 1, (0.1, 0.2, 0.3, 1.0, 2.0, 3.0))
    before = counts(chip)
    chip.write(PWR_MGMT_1, [0x40])
    steps(chip, 50)
    assert counts(chip) == before != (0,) * 6


@pytest.mark.parametrize('select', range(4))
def test_full_scales(select):
    chip = awake(_1B=select << 3, _1C=select << 3)
    steps(chip, 1, (0.5, -0.5, 1.0, 100.0, -100.0, 0.0))
    a, g = 16384 / 2**select, 131.0 / 2**select
    assert counts(chip) == pytest.approx((0.5 * a, -0.5 * a, a, 100 * g, -100 * g, 0), abs=0.51)
    steps(chip, 1, (20.0, -20.0, 0.0, 3000.0, -3000.0, 0.0))
    assert counts(chip) == (32767, -32768, 0, 32767, -32768, 0)


@given(st.integers(-2000, 2000), st.integers(-2000, 2000))
def test_offset_registers_shift_by_their_steps(accel, gyro):
    chip = awake()
    for axis in range(3):
        chip.write(XA_OFFS + 2 * axis, list(struct.pack('>h', chip.trim[axis] + 2 * accel)))
        chip.write(XG_OFFS + 2 * axis, list(struct.pack('>h', gyro)))
    steps(chip, 1, (0.0,) * 6)
    expected_a, expected_g = accel * 2 / 2048 * 16384, gyro / 32.8 * 131.0
    limit = lambda value: min(max(value, -32768), 32767)
    assert counts(chip) == pytest.approx([limit(expected_a)] * 3 + [limit(expected_g)] * 3, abs=0.51)


def test_the_reserved_bit_of_the_accelerometers_offsets_shifts_nothing():
    chip = awake()
    before = counts(chip)
    for axis in range(3):
        chip.write(XA_OFFS + 2 * axis, list(struct.pack('>h', chip.trim[axis] ^ 1)))
    steps(chip, 1)
    assert counts(chip) == before


def test_offsets_in_units_do_not_depend_on_the_full_scale():
    shifted = []
    for select in range(4):
        chip = awake(_1B=select << 3, _1C=select << 3)
        chip.write(XA_OFFS, list(struct.pack('>h', chip.trim[0] + 200)))
        chip.write(XG_OFFS, list(struct.pack('>h', 100)))
        steps(chip, 1, (0.0,) * 6)
        ax, *_, gx, _, _ = counts(chip)
        shifted.append((ax * 2**select / 16384, gx * 2**select / 131))
    for accel, gyro in shifted:
        assert accel == pytest.approx(200 / 2048, abs=1e-3) and gyro == pytest.approx(100 / 32.8, abs=0.05)


def test_a_burst_is_what_single_bytes_say():
    chip = awake()
    steps(chip, 1, (0.3, -0.2, 0.9, -5.0, 6.0, 7.0))
    assert chip.read(DATA, 14) == [chip.read(register, 1)[0] for register in range(DATA, DATA + 14)]


def test_signal_path_reset_empties_the_data_and_holds_them_for_a_while():
    chip = awake()
    chip.write(SIGNAL_PATH_RESET, [0x07])
    assert counts(chip) == (0,) * 6 and chip.read(SIGNAL_PATH_RESET, 1) == [0]
    steps(chip, 1)
    assert counts(chip) == (0,) * 6
    steps(chip, 5)
    assert counts(chip)[2] == 16384


def test_it_settles_after_waking_up():
    chip = Mpu6050(settling=(0.02, 0.3, 1.5))
    chip.write(PWR_MGMT_1, [0x01])
    rates = []
    for _ in range(1500):
        chip.step(0.01, REST)
        rates.append(counts(chip)[3] / 131.0)
    assert rates[0] == 0.0 and rates[10] == pytest.approx(0.3, abs=0.03)
    assert rates[150] == pytest.approx(0.3 * math.exp(-1.0), abs=0.02)
    assert abs(rates[1000]) < 0.01 and rates[-1] == 0.0


def test_after_a_short_sleep_it_is_still_warm():
    def rate_after(asleep):
        chip = Mpu6050(settling=(0.02, 0.3, 1.5))
        chip.write(PWR_MGMT_1, [0x01])
        steps(chip, 2000)
        chip.write(PWR_MGMT_1, [0x40])
        steps(chip, round(100 * asleep))
        chip.write(PWR_MGMT_1, [0x01])
        steps(chip, 5)
        return counts(chip)[3] / 131.0

    assert rate_after(0.1) == pytest.approx(0.3 * (1 - math.exp(-0.1 / 1.5)), abs=0.02)
    assert rate_after(20.0) == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize('axis', range(6))
def test_an_axis_on_standby_stands_still(axis):
    chip = awake(_6C=0x20 >> axis)
    before = counts(chip)
    steps(chip, 1, (0.5, 0.6, 0.7, 5.0, 6.0, 7.0))
    assert [number for number, (old, new) in enumerate(zip(before, counts(chip))) if old == new] == [axis]


def detector(threshold=20, duration=40, decrement=1, high_pass=1, pin=0x20):
    chip = awake()
    for register, value in (
        (INT_PIN_CFG, pin),
        (ACCEL_CONFIG, high_pass),
        (MOT_THR, threshold),
        (MOT_DUR, duration),
        (MOT_DETECT_CTRL, 0x14 | decrement),
        (INT_ENABLE, 0x40),
    ):
        chip.write(register, [value])
    steps(chip, 20)
    chip.read(INT_STATUS, 1)
    return chip


def shake(chip, count, g=0.5):
    for number in range(count):
        chip.step(0.01, (g if number % 2 else -g, 0.0, 1.0, 0.0, 0.0, 0.0))


def fired(chip):
    return bool(chip.read(INT_STATUS, 1)[0] & 0x40)


def test_motion_needs_its_duration():
    chip = detector()
    shake(chip, 3)
    assert not fired(chip)
    shake(chip, 3)
    assert fired(chip)


@given(st.integers(1, 255))
def test_motion_of_any_duration_fires_no_earlier(duration):
    chip = detector(duration=duration)
    needed = math.ceil(duration / 10)
    for number in range(1, needed + 1):
        shake(chip, 1, 0.6 if number % 2 else -0.6)
        assert fired(chip) == (number == needed)


def test_motion_needs_its_threshold():
    chip = detector(threshold=200)  # 0.4 g
    shake(chip, 100, 0.1)
    assert not fired(chip)
    shake(chip, 100, 0.5)
    assert fired(chip)


def test_the_interrupt_is_latched_until_it_is_read():
    chip = detector()
    shake(chip, 20)
    steps(chip, 500)
    assert chip.interrupt_pin
    assert fired(chip) and not chip.interrupt_pin
    assert not fired(chip)


def test_the_pin_follows_its_configuration():
    active_low = detector(pin=0xA0)
    assert active_low.interrupt_pin
    shake(active_low, 20)
    assert not active_low.interrupt_pin
    not_latched = detector(pin=0x00)
    shake(not_latched, 20)
    assert not not_latched.interrupt_pin and fired(not_latched)
    any_read_clears = detector(pin=0x30)
    shake(any_read_clears, 20)
    any_read_clears.read(WHO_AM_I, 1)
    assert not fired(any_read_clears)


def test_without_the_enable_bit_without_the_high_pass_and_asleep_nothing_fires():
    for register, value in ((INT_ENABLE, 0x00), (ACCEL_CONFIG, 0x00), (PWR_MGMT_1, 0x40)):
        chip = detector()
        chip.write(register, [value])
        shake(chip, 100)
        assert not fired(chip)


def test_a_steady_acceleration_passes_the_filter_only_at_first():
    chip = detector(duration=200)
    steps(chip, 300, (0.5, 0.0, 1.0, 0.0, 0.0, 0.0))
    assert not fired(chip)
    held = detector(duration=200, high_pass=7)
    steps(held, 30, (0.5, 0.0, 1.0, 0.0, 0.0, 0.0))
    assert fired(held)


@pytest.mark.parametrize('decrement', range(4))
def test_the_counter_falls_as_it_is_told(decrement):
    """20 ms above, then 10 ms below the threshold: 20 - 10 d are left; the rest must come again."""
    chip = detector(duration=40, decrement=decrement, high_pass=7)
    hit, rest = (0.5, 0.0, 1.0, 0.0, 0.0, 0.0), REST
    steps(chip, 2, hit)
    steps(chip, 1, rest)
    down = DECREMENT_MS[decrement]
    left = 0 if down is None else max(20 - 10 * down, 0)
    needed = math.ceil((40 - left) / 10)
    steps(chip, needed - 1, hit)
    assert not fired(chip)
    steps(chip, 1, hit)
    assert fired(chip)


def test_stuck_it_answers_but_tells_nothing_new():
    chip = awake()
    before = counts(chip)
    chip.stuck = True
    steps(chip, 10, (0.9,) * 6)
    assert counts(chip) == before
    chip.stuck = False
    steps(chip, 1, (0.9,) * 6)
    assert counts(chip) != before


def test_gyro_config_keeps_only_its_bits():
    chip = awake()
    chip.write(GYRO_CONFIG, [0xFF])
    assert chip.read(GYRO_CONFIG, 1) == [0xF8]


@given(
    st.lists(st.tuples(*[st.floats(-3.0, 3.0)] * 3), min_size=1, max_size=20),
    st.sampled_from((0.0, 0.63, 5.0)),
    st.sampled_from((-1.0, 1.0, 4.0)),
    st.integers(0, 255).map(lambda counts: 0.002 * counts),
    st.integers(0, 60),
)
def test_the_compiled_detector_says_what_its_source_says(forces, hz, decrement, threshold, duration):
    settings = np.ones(mpu6050_sample.SETTINGS)
    settings[mpu6050_sample.THRESHOLD :] = threshold, duration, decrement, hz
    compiled, plain = np.zeros(mpu6050_sample.MOTION), np.zeros(mpu6050_sample.MOTION)
    for force in forces:
        assert mpu6050_sample.take(
            np.zeros(14, np.uint8), settings, compiled, True, 0.01, (*force, 0.0, 0.0, 0.0)
        ) == mpu6050_sample.detect.py_func(plain, settings, 0.01, *force)
        assert np.array_equal(compiled, plain)
