"""The cases of E4 and E5: the sensor node's two filters side by side, at rest and turning (thesis 4.2.3.1, 4.2.3.2).

Both filters run in the same sensor node on the same samples; their angles are read from the bus, yaw unwrapped there
(it is sent modulo 65.536 deg).
"""

import math

import numpy as np

from canserial.dbc.bus import BusDescription
from canserial.frame import Frame
from canserial.reader.config import ReaderConfig
from sara_lab.experiments import sensor_experiments
from sara_lab.experiments.core import Case
from sara_sim.chair import STEP_S, SimulatedChair
from sara_sim.world.world import World

FRAMES = {'complementary': ('COMPLEMENTARY', ('rx', 'ry', 'rz')), 'madgwick': ('MADGWICK', ('roll', 'pitch', 'yaw'))}
SPAN_DEG = 65.536
Arrays = dict[str, np.ndarray]


class Listener:
    """Collects the angles and rates in a chair's frames while the chair is stepped."""

    def __init__(self, bus: BusDescription) -> None:
        self.bus, self.rows = bus, {name: [] for name in (*FRAMES, 'gyro', 'accel')}

    def on_frame(self, frame: Frame, true_yaw: float) -> None:
        """Take a frame, with the true yaw (rad) at its time."""
        name, values = self.bus.decode(frame)
        for key, (message, fields) in FRAMES.items():
            if name == message:
                self.rows[key].append((frame.time, *(values[field] for field in fields), math.degrees(true_yaw)))
        if name == 'IMPACT_GYRO':
            self.rows['gyro'].append((frame.time, values['gx'], values['gy'], values['gz']))
        elif name == 'RANGE_ACCEL':
            self.rows['accel'].append((frame.time, values['ax'], values['ay'], values['az']))

    def arrays(self) -> Arrays:
        """{name: (n, k)}; angles in deg with yaw unwrapped and from zero, their last column the true yaw from zero."""
        found = {key: np.array(rows) for key, rows in self.rows.items()}
        for key in FRAMES:
            found[key][:, 3] = unwrapped(found[key][:, 3])
            found[key][:, 4] -= found[key][0, 4]
        return found


def unwrapped(yaw: np.ndarray) -> np.ndarray:
    """A yaw from zero, unwrapped, deg, of one that is sent modulo 65.536 deg; Madgwick's is in +-180 deg before that: a
    step of a whole turn may be in it. A chair turns far less than 16 deg between two frames.
    """
    step = np.diff(yaw)
    steps = np.array([(step + turn + SPAN_DEG / 2) % SPAN_DEG - SPAN_DEG / 2 for turn in (0.0, 360.0, -360.0)])
    smallest = steps[np.abs(steps).argmin(axis=0), np.arange(len(step))]
    return np.concatenate([[0.0], np.cumsum(smallest)])


def at_rest(seed: int, bus: BusDescription | None = None, seconds: float = sensor_experiments.MINUTE_S) -> Arrays:
    """Arrays of a minute at rest, the sensor node calibrated."""
    bus = bus or BusDescription.default()
    chair, listener = SimulatedChair(World.empty(), seed, bus=bus), Listener(bus)
    for _ in range(round(seconds / STEP_S)):
        for frame in chair.step():
            listener.on_frame(frame, chair.drive.yaw)
    return listener.arrays()


class _Turner(sensor_experiments.Turner):
    def __init__(self, seed):
        self.listener = Listener(BusDescription.default())
        super().__init__(seed, calibration_time=ReaderConfig.of().calibration_time)

    def _step(self):
        for frame in self.chair.step():
            self.reader.on_frame(frame)
            self.listener.on_frame(frame, self.chair.drive.yaw)


def turning(seed: int, angle: float) -> Arrays:
    """Arrays of a full turn."""
    turner = _Turner(seed)
    turner.listener = Listener(BusDescription.default())
    turner.turn_to(angle)
    return turner.listener.arrays()


def case(seed: int) -> dict:
    """Drift, spread and the share of a full turn of both filters; of chair 0 the arrays too."""
    rest, turns = at_rest(seed), [turning(seed, angle) for angle in (360.0, -360.0)]
    result = compared(rest, turns)
    if seed == 0:
        result['trace'] = {'rest': rest, 'turns': turns, 'last': at_rest(seed, sensor_experiments.tenths())}
    return result


def compared(rest: Arrays, turns: list[Arrays]) -> dict:
    """The result of the arrays of a minute at rest and of a full turn each way."""
    result = {
        key: {
            'drift': float(rest[key][-1, 3]),
            'sigma': rest[key][:, 1:3].std(axis=0, ddof=1).tolist(),
            'share': [float(turn[key][-1, 3] / turn[key][-1, 4]) for turn in turns],
            'tilt_in_turn': [float(np.abs(turn[key][:, 1:3] - rest[key][:, 1:3].mean(axis=0)).max()) for turn in turns],
        }
        for key in FRAMES
    }
    result['variances'] = {
        'accel': rest['accel'][:, 1:].var(axis=0, ddof=1).tolist(),
        'gyro': rest['gyro'][:, 1:].var(axis=0, ddof=1).tolist(),
        'angles': rest['complementary'][:, 1:3].var(axis=0, ddof=1).tolist()
        + [float(np.var(rest['complementary'][:, 3], ddof=1))],
    }
    return result


def cases(seeds: int) -> list[Case]:
    """Those of E4 and E5."""
    return [Case(('orientation', seed), case, seed) for seed in range(seeds)]
