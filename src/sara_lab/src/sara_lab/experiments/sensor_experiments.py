"""The thesis's experiments on the IMU, on the simulated chip: E1 accelerometer, E2 gyroscope and E3 yaw at rest, E6
full turns and the gain k.

Everything is measured where the thesis measured it, behind the bus: on decoded frames, a minute at a time. What the
thesis could not know, the truth, is asked of the simulator for the errors only.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from canserial.calibration.gain import ANGLES, GainProcedure
from canserial.dbc.bus import BusDescription
from canserial.reader.config import ReaderConfig
from canserial.reader.reader import Reader
from sara_lowlevel.config import SensorConfig
from sara_sim.chair import STEP_S, SimulatedChair
from sara_sim.config import ChairConfig
from sara_sim.world.world import World

MINUTE_S = 60.0
FIXED_OFFSET = -0.645  # deg/s, thesis 4.2.3.1
TRIALS = 4  # calibrations on the PC, as in table 4.7
CALIBRATION_S = 90.0  # s each: the noise of the mean falls with the time, the drift of the bias grows with it
GYRO_STEP = 1.0 / 32.8  # deg/s of the offset register
TURN_AXIS = 200  # deflection of the joystick in a turn, of 512
PAUSE_S = 2.0


def _chair(seed, calibrate, bus=None, config=None):
    """A chair at rest whose chip has settled, calibrated by its sensor node or not."""
    sensors = SensorConfig.of(calibrate=calibrate)
    chair = SimulatedChair(World.empty(), seed, bus=bus, config=config, sensors=sensors)
    if not calibrate:  # nobody else waited for it
        for _ in _frames(chair, sensors.settle_time):
            pass
    return chair


def _frames(chair, seconds):
    for _ in range(round(seconds / STEP_S)):
        yield from chair.step()


def _decoded(chair, bus, seconds, name):
    """Values of the frame `name` for so long, as it comes."""
    wanted = bus.id_of(name)
    for frame in _frames(chair, seconds):
        if frame.id == wanted:
            yield frame.time, bus.decode(frame)[1]


@dataclass(frozen=True)
class AtRest:
    """A minute at rest: what the frames say. `accel` (n, 3) m/s2, `gyro` (n, 3) deg/s."""

    accel: np.ndarray
    gyro: np.ndarray

    @classmethod
    def record(cls, seed: int, calibrated: bool) -> AtRest:
        """The chair `seed`, before or after its sensor node has written the offset registers."""
        bus = BusDescription.default()
        chair = _chair(seed, calibrated, bus)
        return cls.of(bus.decode(frame) for frame in _frames(chair, MINUTE_S))

    @classmethod
    def of(cls, decoded: Iterable[tuple[str, dict[str, float]]]) -> AtRest:
        """Of what was decoded: (name, values) of frames."""
        accel, gyro = [], []
        for name, values in decoded:
            if name == 'RANGE_ACCEL':
                accel.append((values['ax'], values['ay'], values['az']))
            elif name == 'IMPACT_GYRO':
                gyro.append((values['gx'], values['gy'], values['gz']))
        return cls(np.array(accel), np.array(gyro))


def before_and_after(seed: int) -> dict[str, AtRest]:
    """{'before': AtRest, 'after': AtRest} of E1 and E2."""
    return {'before': AtRest.record(seed, False), 'after': AtRest.record(seed, True)}


@dataclass(frozen=True)
class YawAtRest:
    """E3, a minute of it. `t` s, `yaw` deg; `rate`: deg/s, the mean of what was integrated; `offset`: deg/s that was
    taken off on the PC;
    `bias`: deg/s, the chip's own mean over the minute, which nobody but the simulator knows.
    """

    t: np.ndarray
    yaw: np.ndarray
    rate: float
    offset: float
    bias: float

    @property
    def left(self) -> float:
        """What a calibration on the PC left of the chip's bias, deg/s."""
        return self.bias - self.offset


def _minute(chair, bus, offset):
    """Integrate yaw over a minute at rest, `offset` (deg/s) taken off each rate."""
    samples = [
        (t, values['gz'], chair.box.physics.gyro_bias[2]) for t, values in _decoded(chair, bus, MINUTE_S, 'IMPACT_GYRO')
    ]
    t, rate, bias = np.array(samples).T
    t, mean, yaw = integrated(t, rate - offset)
    return YawAtRest(t, yaw, mean, offset, float(bias.mean()))


def integrated(t: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """(t from zero, mean rate, yaw) of rates at times: s, deg/s, deg."""
    return t - t[0], float(rate.mean()), np.concatenate(([0.0], np.cumsum(rate[1:] * np.diff(t))))


def yaw_in_the_sensor_node(
    seed: int, bus: BusDescription | None = None, config: ChairConfig | None = None
) -> YawAtRest:
    """Yaw with the offset registers as the only calibration. bus: another description, such as the last firmware's
    tenths. config: what the chair is drawn from.
    """
    bus = bus or BusDescription.default()
    return _minute(_chair(seed, True, bus, config), bus, 0.0)


def yaw_with_a_fixed_offset(seed: int) -> YawAtRest:
    """Yaw with the thesis's fixed offset taken off uncalibrated rates."""
    bus = BusDescription.default()
    return _minute(_chair(seed, False, bus), bus, FIXED_OFFSET)


def yaw_calibrated_on_the_pc(seed: int) -> list[YawAtRest]:
    """TRIALS minutes of yaw, each after a calibration of its own by read.py's Reader; the sensor node does not
    calibrate.
    """
    bus = BusDescription.default()
    chair = _chair(seed, False, bus)
    trials = []
    for _ in range(TRIALS):
        reader = Reader(ReaderConfig.of(calibration_time=CALIBRATION_S), bus)
        while not reader.ready:
            for frame in chair.step():
                reader.on_frame(frame)
        trials.append(_minute(chair, bus, reader.offset[2]))
    return trials


@dataclass(frozen=True)
class Turns:
    """E6. `gain`: canserial.calibration.gain.GainResult. `check`: (true, measured with the new k) of another full turn
    each way, deg.
    """

    gain: object
    check: tuple


class Turner:
    """Turns a chair by its joystick, as a person would, and reads the angle."""

    def __init__(self, seed: int, **config) -> None:
        bus = BusDescription.default()
        self.chair = _chair(seed, True, bus)
        self.reader = Reader(ReaderConfig.of(**config), bus)
        while not self.reader.ready:
            self._step()
        self.start_over()

    def _step(self):
        for frame in self.chair.step():
            self.reader.on_frame(frame)

    def start_over(self) -> None:
        """Count angles from here."""
        self._true, self._measured = self.chair.drive.yaw, self.reader.turned

    def turn_to(self, angle: float) -> None:
        """Turn until the chair stands `angle` deg (left positive) from the start. Returns (true, measured without
        gain), deg.
        """
        target = self._true + math.radians(angle)
        side = 1 if target > self.chair.drive.yaw else -1
        self.chair.joystick = (512 - side * TURN_AXIS, 512)
        while side * (target - self.chair.drive.yaw) > 0.0:
            self._step()
        self.chair.joystick = (512, 512)
        for _ in range(round(PAUSE_S / STEP_S)):
            self._step()
        return math.degrees(self.chair.drive.yaw - self._true), math.degrees(self.reader.turned - self._measured)


def full_turns(seed: int) -> Turns:
    """E6: the marks of table 4.11 both ways, the gain they give, and another full turn each way with it."""
    turner, procedure = Turner(seed, calibration_time=CALIBRATION_S), GainProcedure()
    for angle in procedure.angles:
        if abs(angle) == ANGLES[0]:
            turner.start_over()
        procedure.add(*turner.turn_to(angle))
    result = procedure.result()
    check = []
    for angle in (360.0, -360.0):
        turner.start_over()
        true, measured = turner.turn_to(angle)
        check.append((true, result.gain * measured))
    return Turns(result, tuple(check))


def tenths() -> BusDescription:
    """The bus of the thesis's last firmware: rates in tenths of a degree per second."""
    return BusDescription.named('sara_tenths')
