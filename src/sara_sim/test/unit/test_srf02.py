"""The ranger and the bus it hangs on."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.dbc.bus import BusDescription
from sara_common.platforms import chosen
from sara_lowlevel.config import SensorConfig
from sara_lowlevel.sensor.sensor_node import SensorNode
from sara_sim.chips.demo import demo
from sara_sim.chips.i2c_bus import SimulatedI2c
from sara_sim.chips.mpu6050 import Mpu6050
from sara_sim.chips.srf02 import AUTOTUNE, RANGE_CM, RANGE_INCHES, RANGE_US, REVISION, TUNING_STEPS, Srf02


class Ranger:
    def __init__(self, distance=1.0, tuned=True):
        self.now, self.distance = 0.0, distance
        self.chip = Srf02(lambda: self.distance, lambda: self.now)
        for _ in range(TUNING_STEPS if tuned else 0):
            self.range()

    def range(self, command=RANGE_CM):
        self.chip.write(0, [command])
        self.now += 0.07
        high, low = self.chip.read(2, 2)
        return high << 8 | low


@given(st.floats(0.16, 6.0))
def test_a_distance_comes_in_whole_centimetres(distance):
    assert Ranger(distance).range() == round(100 * distance)


@given(st.floats(0.0, 0.154))
def test_what_is_in_the_dead_zone_reads_one_step_below_it(distance):
    assert Ranger(distance).range() == 15


@given(st.one_of(st.just(math.inf), st.floats(6.006, 20.0)))
def test_no_echo_and_one_from_too_far_are_zero(distance):
    assert Ranger(distance).range() == 0


def test_ranging_takes_66_ms_in_which_it_neither_tells_nor_hears():
    ranger = Ranger(2.0)
    ranger.chip.write(0, [RANGE_CM])
    ranger.distance = 3.0
    assert ranger.chip.read(0, 4) == [0xFF] * 4
    ranger.chip.write(0, [RANGE_CM])
    ranger.now += 0.065
    assert ranger.chip.read(0, 1) == [0xFF]
    ranger.now += 0.001
    assert ranger.chip.read(0, 4) == [REVISION, 0x80, 0, 200]


def test_units():
    assert Ranger(2.54).range(RANGE_INCHES) == 100
    assert Ranger(1.0).range(RANGE_US) == 5800


def test_it_finds_its_least_range_by_itself():
    ranger = Ranger(0.20, tuned=False)
    assert ranger.chip.read(4, 2) == [0, 28] and ranger.range() == 27
    for _ in range(TUNING_STEPS):
        ranger.range()
    assert ranger.chip.read(4, 2) == [0, 16] and ranger.range() == 20
    ranger.chip.write(0, [AUTOTUNE])
    assert ranger.chip.read(4, 2) == [0, 28]


def test_only_commands_to_register_0_are_heard():
    ranger = Ranger(1.0)
    for register, command in ((1, RANGE_CM), (0, 0x13)):
        ranger.chip.write(register, [command])
        assert ranger.chip.read(0, 1) == [REVISION]


def test_nobody_at_an_address_and_a_silent_chip_are_an_oserror():
    chip = Mpu6050()
    bus = SimulatedI2c({0x68: chip})
    assert bus.read_byte_data(0x68, 0x75) == 0x68
    for call in (
        lambda: bus.read_byte_data(0x69, 0),
        lambda: bus.write_byte_data(0x69, 0, 0),
        lambda: bus.read_i2c_block_data(0x69, 0, 6),
        lambda: bus.write_i2c_block_data(0x69, 0, [1]),
    ):
        with pytest.raises(OSError):
            call()
    chip.silent = True
    with pytest.raises(OSError, match='0x68'):
        bus.read_i2c_block_data(0x68, 0x3B, 6)
    assert bus.counts['no acknowledge'] == 5


@pytest.mark.parametrize(
    'call',
    [
        lambda bus: bus.read_i2c_block_data(0x68, 0, 33),
        lambda bus: bus.read_i2c_block_data(0x68, 0, 0),
        lambda bus: bus.write_i2c_block_data(0x68, 0, [256]),
        lambda bus: bus.write_byte_data(0x68, 0, 256),
        lambda bus: bus.write_i2c_block_data(0x68, 0, []),
    ],
)
def test_what_smbus_refuses_is_refused(call):
    with pytest.raises(ValueError):
        call(SimulatedI2c({0x68: Mpu6050()}))


def test_a_sensor_node_runs_on_the_demo_by_itself():
    class Clock:
        now = 100.0

    bus = demo(seed=1, clock=lambda: Clock.now)
    node = SensorNode(BusDescription.default(), bus)
    frames = []
    for tick in range(3200):
        Clock.now = 100.0 + tick * 0.01
        frames += node.update(Clock.now)
    assert node.state == 'running' and not node.counts['I2C errors']
    heard = [BusDescription.default().decode(frame) for frame in frames]
    assert {'RANGES_1', 'RANGES_2', 'RANGE_ACCEL', 'IMPACT_GYRO'} <= {name for name, _ in heard}
    ranges = [values for name, values in heard if name == 'RANGES_1'][-1]
    ahead = [name for name, place in chosen().sonars.items() if abs(place.yaw) < 0.3 and name in ranges]
    assert ahead and all(0 < ranges[name] < 2.5 for name in ahead)
    known = SensorConfig.of()
    assert set(bus.chips) == {known.imu_address, *known.sonar_addresses.values()}
