"""The driver against a chip at register level: it wakes a chip that sleeps after its reset; the thesis's listing does
not.
"""

import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_lowlevel.sensor.mpu6050 import RESET_WAIT_S, THESIS_LISTING, ChipError, Mpu6050, calibrated, write_sequence

sys.path.insert(0, str(Path(__file__).parent))
from fake_chips import FakeBus, FakeMpu  # noqa: E402


def started(chip):
    bus, t = FakeBus({0x68: chip}), 0.0
    driver = Mpu6050(bus)
    while not driver.advance(t):
        t += 0.01
        bus.now = t
        assert t < 1.0
    return driver, t


def test_the_listing_of_the_thesis_leaves_the_chip_asleep():
    chip = FakeMpu(bias=(100,) * 6)
    write_sequence(FakeBus({0x68: chip}), 0x68, THESIS_LISTING)
    assert chip.asleep
    assert Mpu6050(FakeBus({0x68: chip})).sample() == (0,) * 6


def test_ours_wakes_and_configures_it_after_the_waits():
    chip = FakeMpu(bias=(100, 0, 0, 7, 0, 0))
    driver, took = started(chip)
    assert not chip.asleep and took == pytest.approx(2 * RESET_WAIT_S)
    held = {register: chip.registers[register] for register in (0x6B, 0x37, 0x1B, 0x1C, 0x1F, 0x20, 0x69, 0x38)}
    assert held == {0x6B: 0x01, 0x37: 0x20, 0x1B: 0, 0x1C: 0x01, 0x1F: 20, 0x20: 40, 0x69: 0x15, 0x38: 0x40}
    assert driver.sample() == (100, 0, 16384, 7, 0, 0)


@pytest.mark.parametrize('register', [0x6B, 0x1C, 0x38, 0x20])
def test_a_register_that_does_not_hold_what_was_written_is_an_error(register):
    class Stubborn(FakeMpu):
        def write(self, first, values, now):
            super().write(first, values, now)
            if first == register:
                self.registers[first] = 0x55

    with pytest.raises(ChipError, match=f'0x{register:02x}'):
        started(Stubborn())


def test_another_chip_is_refused_by_name():
    chip = FakeMpu()
    chip.registers[0x75] = 0x70
    with pytest.raises(ChipError, match='0x70'):
        started(chip)


def test_the_interrupt_is_read_once():
    chip = FakeMpu()
    driver, _ = started(chip)
    chip.impact, chip.registers[0x3A] = True, 0
    assert driver.impact() and not driver.impact()


def test_a_short_answer_is_an_error_of_the_bus():
    chip = FakeMpu()
    driver, _ = started(chip)
    chip.read = lambda register, length, now: [0] * (length - 1)
    with pytest.raises(OSError):
        driver.sample()
    with pytest.raises(OSError):
        driver.offsets()


@given(
    st.tuples(*[st.integers(-32768, 32767)] * 3),
    st.tuples(*[st.integers(-32768, 32767)] * 3),
    st.tuples(*[st.floats(-32768, 32767)] * 6),
)
def test_offsets_always_fit_their_registers_and_keep_bit_0(accel, gyro, mean):
    new_accel, new_gyro = calibrated(accel, gyro, mean[:3], mean[3:])
    assert all(-32768 <= value <= 32767 for value in new_accel + new_gyro)
    assert all((new ^ old) & 1 == 0 for new, old in zip(new_accel, accel))
    for new, old, measured in zip(new_gyro, gyro, mean[3:]):
        if -32768 < new < 32767:
            assert abs(measured + 4 * (new - old)) <= 2
