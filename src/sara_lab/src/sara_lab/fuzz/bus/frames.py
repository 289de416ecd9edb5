"""Random frames against the reader: nothing it is given may make it raise, hang, or say a number that is none.

Half of the frames are plausible, so that the reader gets deep; the others are random or extreme bytes under right and
wrong identifiers, with right and wrong lengths and stamps.
"""

import math
import random
from collections.abc import Callable
from typing import NamedTuple

from canserial.dbc.bus import BusDescription
from canserial.frame import Frame
from canserial.reader.config import ReaderConfig
from canserial.reader.reader import Reader
from canserial.reader.readings import RangeReading

FRAMES_PER_READER = 500
STEPS_OF_TIME = (0.0, 0.001) + (0.01,) * 10 + (0.02,) * 10 + (0.05, 0.2, -0.01)
LEAPS_OF_TIME = (1.0, 10.0, 60.0, -0.5, -20.0)
STRANGE_STAMPS = (math.nan, math.inf, -math.inf, -1.0, 0.0, 1e-300, 2.0**32, 1e300)
RANGE_M = (0, 6.6)
CORNERS = (b'\x00', b'\xff', b'\x80', b'\x7f')


class FuzzFailure(AssertionError):
    """Which input made the reader say something that it must not."""


def fuzz_reader(
    count: int, seed: int, bus: BusDescription | None = None, on_reading: Callable[[NamedTuple], object] | None = None
) -> int:
    """Give `count` random frames (and now and then a yaw, a calibration, a gain) to readers; returns how many readings
    came.

    bus: BusDescription (default: SARA's). on_reading: called with each reading, for who wants to know what came.
    Raises FuzzFailure, or whatever the reader raised. The same seed gives the same frames.
    """
    chance = random.Random(seed)
    bus = bus or BusDescription.default()
    ids = [bus.id_of(name) for name in bus.names]
    reader, time, readings = None, 0.0, 0
    for number in range(count):
        if number % FRAMES_PER_READER == 0:
            reader, time = Reader(_config(chance), bus), chance.choice((0.0, 1.7e9))
        time = max(0.0, time + chance.choice(STEPS_OF_TIME if chance.random() < 0.99 else LEAPS_OF_TIME))
        frame = _plausible(chance, bus, time) if chance.random() < 0.6 else _rubbish(chance, ids, time)
        _poke(chance, reader, time)
        for reading in reader.on_frame(frame):
            readings += 1
            _check(reading, frame, number, seed)
            if on_reading:
                on_reading(reading)
        if not math.isfinite(reader.yaw) or not math.isfinite(reader.turned):
            raise FuzzFailure(f'seed {seed}, input {number}: {frame} made the yaw {reader.yaw}, turned {reader.turned}')
    return readings


def _config(chance):
    lax = chance.random() < 0.8  # strict limits seldom let noise come through to what lies behind them
    return ReaderConfig.of(
        calibration_time=0.3 if lax else 2.0,
        still_step=1e3 if lax else 0.8,
        still_drift=1e3 if lax else 0.12,
        still_steps=2**31 if lax else 20,
        gravity_tolerance=1e3 if lax else 2.0,
        imu_period=chance.choice(('auto', 0.05, 0.2)),
    )


# Drawn from these; the frame that says most is drawn twice.
NAMES = (
    'ENCODER_RIGHT',
    'ENCODER_LEFT',
    'JOYSTICK',
    'MODO_PC',
    'RANGES_1',
    'RANGES_2',
    'RANGE_ACCEL',
    'IMPACT_GYRO',
    'IMPACT_GYRO',
    'COMPLEMENTARY',
    'MADGWICK',
    'BATTERY',
)
# The values that a robot's frames may have besides its ranges; signals are drawn in this order, ranges first.
BETWEEN = {
    'RANGES_1': {},
    'RANGES_2': {},
    'RANGE_ACCEL': {'ax': (-22, 22), 'ay': (-22, 22), 'az': (-22, 22)},
    'COMPLEMENTARY': {'rx': (-32, 32), 'ry': (-32, 32), 'rz': (-32, 32)},
    'MADGWICK': {'roll': (-32, 32), 'pitch': (-32, 32), 'yaw': (-32, 32)},
    'BATTERY': {'voltage': (0, 41)},
}


def _plausible(chance, bus, time):
    """A frame as the chair could send it, if the bus has the kind."""
    uniform = chance.uniform
    name = chance.choice(NAMES)
    clock = int(time * 1e4) % 2**32
    if name in BETWEEN:
        limits = {**dict.fromkeys(bus.ranges.get(name, ()), RANGE_M), **BETWEEN[name]}
        signals = {signal: uniform(*pair) for signal, pair in limits.items()}
    elif name == 'JOYSTICK':
        signals = {
            'velD': uniform(-13, 13),
            'velI': uniform(-13, 13),
            'joyx': chance.randrange(1024),
            'joyy': chance.randrange(1024),
            'modo': chance.choice((0, 1, 3)),
        }
    elif name == 'MODO_PC':
        signals = {'modoPC': chance.choice((0, 1, 3))}
    elif name == 'IMPACT_GYRO':
        signals = {'alarma': chance.randrange(2), **{axis: uniform(-20, 20) for axis in ('gx', 'gy', 'gz')}}
    else:
        signals = {'steps': (clock * 5 + chance.randrange(3)) % 2**32, 'time': clock}
    return bus.encode(name, time, **signals)


def _rubbish(chance, ids, time):
    extended = chance.random() < 0.02
    identifier = chance.choice(ids) if chance.random() < 0.9 else chance.randrange(2**29 if extended else 2**11)
    length = 8 if chance.random() < 0.9 else chance.randrange(9)
    data = (chance.choice(CORNERS) * 8)[:length] if chance.random() < 0.2 else chance.randbytes(length)
    stamp = chance.choice(STRANGE_STAMPS) if chance.random() < 0.05 else time
    return Frame(identifier, data, stamp, extended)


def _poke(chance, reader, time):
    luck = chance.random()
    if luck < 0.01:
        reader.set_yaw(
            chance.choice((0.0, 1.0, -7.0, 1e6, math.nan, math.inf)),
            chance.choice((time, time - 0.3, time - 1e3, time + 0.1, math.nan)),
        )
    elif luck < 0.02:
        reader.calibrate(time)
    elif luck < 0.03:
        reader.gain = chance.uniform(0.5, 2.0)


def _check(reading, frame, number, seed):
    for name, value in reading._asdict().items():
        for part in value if isinstance(value, tuple) else (value,):
            may_be_inf = isinstance(reading, RangeReading) and name in ('range', 'raw')
            if isinstance(part, float) and not (math.isfinite(part) or may_be_inf and math.isinf(part)):
                raise FuzzFailure(f'seed {seed}, input {number}: {frame} gave {reading}')
