"""The magnetometer's drivers against register files written down here, and the chip that is found, lost and found."""

import struct
import sys
from pathlib import Path

import pytest

from canserial.dbc.bus import BusDescription
from sara_lowlevel.config import FAST_IMU, SensorConfig
from sara_lowlevel.schedule import frame_slots
from sara_lowlevel.sensor import hmc5883l, qmc5883l
from sara_lowlevel.sensor.hmc5883l import Hmc5883l
from sara_lowlevel.sensor.magnetometer import Magnetometer
from sara_lowlevel.sensor.mpu6050 import ChipError
from sara_lowlevel.sensor.qmc5883l import Qmc5883l
from sara_lowlevel.sensor.sensor_node import SensorNode

sys.path.insert(0, str(Path(__file__).parent))
from fake_chips import FakeBus  # noqa: E402


class Registers:
    """A chip that holds what is written, and answers with it."""

    def __init__(self, content):
        self.bytes = bytearray(content)

    def read(self, register, length, _now):
        return self.bytes[register : register + length]

    def write(self, register, values, _now):
        self.bytes[register : register + len(values)] = bytes(values)


def hmc(x, y, z):
    return Registers(bytes((0x10, 0x20, 0x01)) + struct.pack('>3h', x, z, y) + b'\x01H43')


def qmc(x, y, z, status=0x01):
    return Registers(struct.pack('<3h', x, y, z) + bytes((status, 0, 0, 0, 0, 0, 0, 0xFF)))


CHIPS = {0x1E: (Hmc5883l, hmc, 0.152), 0x0D: (Qmc5883l, qmc, 0.0334)}


@pytest.mark.parametrize('address', CHIPS)
def test_a_field_is_read_in_microtesla(address):
    driver, chip, step = CHIPS[address]
    bus = FakeBus({address: chip(110, -220, 330)})
    sensor = driver(bus)
    sensor.start()
    assert sensor.read() == pytest.approx((110 * step, -220 * step, 330 * step), rel=0.01)


def test_they_measure_continuously_and_fast_enough():
    chips = {0x1E: hmc(0, 0, 0), 0x0D: qmc(0, 0, 0)}
    bus = FakeBus(chips)
    Hmc5883l(bus).start()
    Qmc5883l(bus).start()
    assert chips[0x1E].bytes[2] == 0x00 and chips[0x1E].bytes[0] >> 2 & 7 == 6  # continuous, 75 Hz
    assert chips[0x0D].bytes[9] & 3 == 1 and chips[0x0D].bytes[9] >> 2 & 3 == 2  # continuous, 100 Hz


def test_a_field_beyond_the_range_is_none():
    bus = FakeBus({0x1E: hmc(0, -4096, 0), 0x0D: qmc(0, 32767, 0, status=0x03)})
    for driver in (Hmc5883l(bus), Qmc5883l(bus)):
        driver.start()
        assert driver.read() is None


@pytest.mark.parametrize('address', CHIPS)
def test_a_chip_that_lost_its_supply_or_is_another_is_told(address):
    driver, chip, _ = CHIPS[address]
    fresh = chip(1, 2, 3)
    with pytest.raises(ChipError, match='is not configured'):
        driver(FakeBus({address: fresh})).read()
    fresh.bytes[-1] ^= 0x55
    with pytest.raises(ChipError, match='identifies itself'):
        driver(FakeBus({address: fresh})).start()


def test_either_chip_is_found_lost_and_found_again():
    down = []
    bus = FakeBus({0x0D: qmc(300, 0, 0)}, fails=lambda: bool(down))
    magnetometer = Magnetometer(bus, 1.0)
    assert magnetometer.read(0.0) is None and magnetometer.chip == 'QMC5883L'
    assert magnetometer.read(0.1) == pytest.approx((10.0, 0.0, 0.0))
    down.append(1)
    assert magnetometer.read(0.2) is None and magnetometer.chip == '' and 'I/O' in magnetometer.reason
    assert magnetometer.read(1.1) is None and 'HMC5883L' in magnetometer.reason and 'QMC5883L' in magnetometer.reason
    down.clear()
    assert magnetometer.read(1.2) is None and magnetometer.read(2.2) is None
    assert magnetometer.read(2.3) == pytest.approx((10.0, 0.0, 0.0))
    assert magnetometer.counts == {'magnetometer failures': 1}


def test_a_field_that_no_frame_holds_is_counted():
    magnetometer = Magnetometer(FakeBus({0x0D: qmc(30000, 0, 0)}), 1.0)
    assert magnetometer.read(0.0) is None and magnetometer.read(0.1) is None
    assert magnetometer.counts == {'fields beyond the range': 1}


def frames_of(node, seconds):
    found = []
    for step in range(round(100 * seconds)):
        found += [(step, frame) for frame in node.update(step / 100)]
    return found


def test_the_sensor_node_sends_the_field_every_100_ms_on_a_bus_that_has_it():
    bus = BusDescription.named('+compass')
    chips = {0x0D: qmc(600, -900, 1200)}
    came = frames_of(SensorNode(bus, FakeBus(chips), SensorConfig.of(imu_period=FAST_IMU)), 2.0)
    fields = [(step, frame) for step, frame in came if frame.id == bus.id_of('COMPASS')]
    assert [step % 10 for step, _ in fields] == [5] * len(fields) and len(fields) == 19
    assert bus.decode(fields[0][1]) == ('COMPASS', pytest.approx({'mx': 20.0, 'my': -30.0, 'mz': 40.0}))
    assert len({step for step, _ in came}) == len(came)


def test_the_default_bus_knows_no_compass():
    chips = {0x0D: qmc(600, 0, 0)}
    bus = FakeBus(chips)
    node = SensorNode(BusDescription.default(), bus)
    frames_of(node, 0.5)
    assert node.magnetometer is None and chips[0x0D].bytes[9] == 0


@pytest.mark.parametrize('period', [0.05, 0.2])
@pytest.mark.parametrize('madgwick', [True, False])
def test_the_field_takes_no_other_frame_s_slot(period, madgwick):
    plain, more = frame_slots(period, madgwick), frame_slots(period, madgwick, compass=True)
    assert {slot: name for slot, name in more.items() if name != 'COMPASS'} == plain
    assert sorted(more.keys() - plain.keys()) == [5, 15]


def test_the_registers_that_are_read_back_are_those_of_the_data_sheets():
    assert (hmc5883l.ADDRESS, hmc5883l.DATA, hmc5883l.IDENTIFICATION) == (0x1E, 3, 10)
    assert (qmc5883l.ADDRESS, qmc5883l.DATA, qmc5883l.STATUS, qmc5883l.CONTROL_1) == (0x0D, 0, 6, 9)
