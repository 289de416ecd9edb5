"""The simulated magnetometers at register level, and the field that reaches them."""

import math
import struct
from dataclasses import replace

import numpy as np
import pytest

from canserial.dbc.bus import BusDescription
from sara_common.config import ConfigError
from sara_common.planar import Pose2D
from sara_lowlevel.sensor.hmc5883l import Hmc5883l as HmcDriver
from sara_lowlevel.sensor.qmc5883l import Qmc5883l as QmcDriver
from sara_sim.chair import SimulatedChair
from sara_sim.chips.hmc5883l import Hmc5883l
from sara_sim.chips.i2c_bus import SimulatedI2c
from sara_sim.chips.magnetic_config import MagneticConfig
from sara_sim.chips.magnetism import Magnetism, Placement, Wheel, rotation
from sara_sim.chips.qmc5883l import Qmc5883l
from sara_sim.faults.faults import FaultError
from sara_sim.world.world import World

BUS = BusDescription.named('+compass')
STILL = Wheel(0.0, 0.0)
ORIGIN = Placement(0.0, 0.0, 0.0, 0.0, 0.0, STILL, STILL)
BOX = (0.0, 0.0), Pose2D(0.0, -0.25, 0.0)
CLEAN = MagneticConfig(hard_iron_sigma=0.0, soft_iron_sigma=0.0, turn_sigma=0.0, motor_sigma=0.0, noise=0.0)


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


@pytest.mark.parametrize('kind, driver, address', [(Hmc5883l, HmcDriver, 0x1E), (Qmc5883l, QmcDriver, 0x0D)])
def test_a_driver_reads_what_the_chip_feels(kind, driver, address):
    clock, felt = Clock(), [20.0, -30.0, -40.0]
    chip = kind(lambda: felt, clock)
    sensor = driver(SimulatedI2c({address: chip}))
    sensor.start()
    clock.now += 0.1
    assert sensor.read() == pytest.approx((20.0, -30.0, -40.0), abs=0.08)
    felt[:] = 25.0, 0.0, 0.0
    assert sensor.read() == pytest.approx((20.0, -30.0, -40.0), abs=0.08)  # no new measurement yet
    clock.now += 0.02
    assert sensor.read() == pytest.approx((25.0, 0.0, 0.0), abs=0.08)
    felt[0] = 5000.0
    clock.now += 0.02
    assert sensor.read() is None
    chip.power_up()
    with pytest.raises(OSError, match='not configured'):
        sensor.read()


def test_an_hmc5883l_measures_once_after_power_up_and_then_idles():
    clock, felt = Clock(), [10.0, 0.0, 0.0]
    chip = Hmc5883l(lambda: felt, clock)
    first = chip.read(3, 6)
    felt[0] = 20.0
    clock.now = 10.0
    assert chip.read(3, 6) == first == list(struct.pack('>3h', 109, 0, 0)) and chip.read(2, 1)[0] & 2


def test_reading_an_hmc5883l_goes_on_at_the_data_and_at_zero():
    chip = Hmc5883l(lambda: (0.0, 0.0, 0.0), Clock())
    assert chip.read(8, 2) == [chip.read(8, 1)[0], chip.read(3, 1)[0]]
    assert bytes(chip.read(10, 4)) == b'H43' + bytes(chip.read(0, 1))


def test_a_qmc5883l_stands_by_until_it_is_told_and_after_a_reset():
    clock = Clock()
    chip = Qmc5883l(lambda: (10.0, 0.0, 0.0), clock)
    clock.now = 1.0
    assert chip.read(0, 7) == [0] * 7
    chip.write(0x09, [0x01])
    clock.now = 2.0
    assert chip.read(6, 1) == [0x01] and chip.read(0, 2) == list(struct.pack('<h', 1200)) and chip.read(6, 1) == [0]
    chip.write(0x0A, [0x80])
    clock.now = 3.0
    assert chip.read(0, 7) == [0] * 7 and chip.read(0x0D, 1) == [0xFF]


def body_field(config, at, seed=0, box=BOX):
    return Magnetism(config, seed, box, lambda: at, Clock()).body_field(at)


def test_the_earth_s_field_turns_with_the_chair_and_keeps_its_strength():
    earth = body_field(CLEAN, ORIGIN)
    assert np.linalg.norm(earth) == pytest.approx(45.2, abs=0.5)  # Alcala, by the model
    assert earth[1] > 25.0 and earth[2] < -36.0  # north is to the left of a chair that faces east; it points down
    for attitude in ((0.0, 0.0, 1.0), (0.1, -0.2, -2.0)):
        turned = ORIGIN._replace(roll=attitude[0], pitch=attitude[1], yaw=attitude[2])
        assert rotation(*attitude) @ body_field(CLEAN, turned) == pytest.approx(earth)


def test_steel_is_as_strong_as_it_is_said_and_falls_with_the_third_power():
    steel = replace(CLEAN, steel=((0.0, 0.0),))
    magnetism = Magnetism(steel, 3, BOX, lambda: ORIGIN, Clock())

    def added(distance, angle):
        return np.linalg.norm(magnetism._steel(distance * np.array((math.cos(angle), math.sin(angle)))))

    around = [added(0.45, angle) for angle in np.linspace(0.0, math.tau, 60)]
    assert 25.0 <= max(around) <= 50.0 + 1e-9 and min(around) >= 25.0 - 1e-9
    assert added(0.9, 1.0) == pytest.approx(added(0.45, 1.0) / 8.0)


def test_motors_add_a_field_that_turns_its_sign_with_them():
    config = replace(CLEAN, motor_sigma=0.2)
    earth = body_field(config, ORIGIN)
    ahead = body_field(config, ORIGIN._replace(right=Wheel(3.0, 0.0), left=Wheel(3.0, 0.0))) - earth
    back = body_field(config, ORIGIN._replace(right=Wheel(-3.0, 0.0), left=Wheel(-3.0, 0.0))) - earth
    assert 0.05 < np.linalg.norm(ahead) < 10.0 and back == pytest.approx(-ahead)


def test_the_same_seed_gives_the_same_iron_and_another_seed_another():
    one, same, other = (Magnetism(MagneticConfig(), seed, BOX, lambda: ORIGIN, Clock()) for seed in (1, 1, 2))
    assert one.field() == pytest.approx(same.field()) and not np.allclose(one.hard_iron, other.hard_iron)


def test_a_chair_s_frames_but_for_the_compass_are_those_of_a_chair_without():
    def frames(bus):
        chair = SimulatedChair(World.empty(), 4, bus=bus)
        return [frame for _ in range(300) for frame in chair.step()]

    with_compass, plain = frames(BUS), frames(BusDescription.default())
    own = [frame for frame in with_compass if frame.id == BUS.id_of('COMPASS')]
    assert len(own) == 30 and {frame.id for frame in plain} == {f.id for f in with_compass} - {own[0].id}


@pytest.mark.parametrize('chip', ['HMC5883L', 'QMC5883L'])
def test_both_chips_come_through_to_the_bus(chip):
    chair = SimulatedChair(World.empty(), 0, bus=BUS, magnetic=replace(CLEAN, chip=chip))
    fields = [BUS.decode(f)[1] for _ in range(100) for f in chair.step() if f.id == BUS.id_of('COMPASS')]
    felt = chair.magnetism.iron @ chair.magnetism.body_field(ORIGIN)
    assert len(fields) >= 9 and chair.sensors.magnetometer.chip == chip
    assert (fields[5]['mx'], fields[5]['my'], fields[5]['mz']) == pytest.approx(tuple(felt), abs=0.1)


def test_numbers_that_cannot_be_are_named_all_at_once():
    with pytest.raises(ConfigError) as caught:
        MagneticConfig(chip='LSM303', date=(2026, 13, 1), noise=-1.0, steel=((1.0,),), latitude=math.nan)
    text = str(caught.value)
    assert len(caught.value.faults) == 5
    assert all(name in text for name in ('chip', 'date', 'noise', 'steel', 'latitude'))


def test_faults_of_the_compass_reach_the_bus_and_leave_no_trace():
    chair = SimulatedChair(World.empty(), 0, bus=BUS, magnetic=replace(CLEAN, noise=0.2))

    def fields():
        return [BUS.decode(f)[1]['my'] for _ in range(100) for f in chair.step() if f.id == BUS.id_of('COMPASS')]

    normal = np.mean(fields())
    chair.faults.add('compass_magnet', y=30.0, duration=0.95)
    assert np.mean(fields()[1:-1]) == pytest.approx(normal + 30.0, abs=0.5)
    chair.faults.add('compass_stuck', duration=0.95)
    assert len(set(fields()[1:-1])) == 1
    chair.faults.add('compass_silent', duration=0.95)
    assert len(fields()) <= 2 and chair.sensors.magnetometer.counts['magnetometer failures'] == 1
    fields()
    assert np.mean(fields()) == pytest.approx(normal, abs=0.3)


def test_a_chair_without_a_compass_has_no_fault_of_it():
    with pytest.raises(FaultError, match='compass_stuck: .* no magnetometer'):
        SimulatedChair(World.empty(), 0).faults.add('compass_stuck')
