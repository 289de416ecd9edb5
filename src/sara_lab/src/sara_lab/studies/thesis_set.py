"""Why the thesis's set of inputs makes legs too long, measured: a straight drive, rates of odometry and IMU varied.

The set: world_frame map; x, y, vx from wheel odometry in the frame odom; yaw, vyaw from the IMU. The wheels' x, y are
brought into the map by the filter's own map -> odom, which at each tick is made of the filter's pose p(t') and the
odometry o(t'): the measurement is z(t) = p(t') (+) (o(t) (-) o(t')), the filter's own last pose moved on by what the
wheels have counted since. Turned into the map by the fused yaw, the wheels' slip in yaw cancels: that is why the set
survives it. But when the filter's state is younger than the newest odom -> base_link (an IMU message or a prediction
has moved it on by s), o(t') is still the old one, and z counts the way of s once more. (transform_time_offset dates map
-> odom ahead, so that an older one is used, of a smaller s: it hides a part.) With the gain K of x in the correction,
the way is too long by

    scale = 1 + K s / T,    T the period of the odometry,    K = P+ / R (x after the correction, R of the odometry's x).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.filters.state import X
from sara_localization.geometry.rigid import Transform
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import ImuData, OdometryData

FREQUENCY = 50.0
START = 1000.0
# Ticks and IMU messages never fall on the odometry's instants: (s) after them.
TICK_PHASE, IMU_PHASE = 0.0007, 0.003


def _mask(*variables):
    return [k in variables for k in range(15)]


# The inputs compared: the thesis's, and the two that are clean.
SETS = {
    'thesis: x, y, vx + yaw, vyaw': dict(odom0_config=_mask(0, 1, 6)),
    'x, y differential + yaw, vyaw': dict(odom0_config=_mask(0, 1), odom0_differential=True),
    'vx + yaw, vyaw': dict(odom0_config=_mask(6)),
}
THESIS = next(iter(SETS))
DURATION = 12.0  # s of a drive


@dataclass(frozen=True)
class Drive:
    """One straight drive: estimated per true length, the formula's, and how stale odom -> base_link was (s)."""

    scale: float
    predicted: float
    staleness: float


def parameters(name: str, predict: bool) -> dict:
    """Parameters of one of SETS; predict: predict_to_current_time."""
    return dict(
        frequency=FREQUENCY,
        two_d_mode=True,
        world_frame='map',
        transform_time_offset=0.05,
        predict_to_current_time=predict,
        sensor_timeout=1.0,
        odom0='odom',
        imu0='imu',
        imu0_config=_mask(5, 11),
        **SETS[name],
    )


class _Straight:
    """The filter on a straight drive with perfect sensors: `odometry`, `imu` and `tick` at times of the drive, s."""

    def __init__(self, config, variance, speed):
        self.transforms = TransformBuffer()
        self.engine = FilterEngine(config, self.transforms)
        self.variance, self.speed = variance, speed
        self.times, self.ways, self.staleness, self.gains = [], [], [], []
        # Of each map -> odom: its stamp, and by how much the state was younger than odom -> base_link.
        self._dated, self._stale = [0.0], [0.0]
        self._output, self._newest, self._corrected = None, 0.0, False

    def odometry(self, t):
        """A measurement of the wheels."""
        self.staleness.append(float(np.interp(t, self._dated[-16:], self._stale[-16:])))
        self._newest, self._corrected = t, True
        self.transforms.set_transform('odom', 'base_link', Transform.from_xyz_rpy(self.speed * t), START + t)
        covariance = np.eye(6) * self.variance
        position, velocity = (self.speed * t, 0.0, 0.0), (self.speed, 0.0, 0.0)
        self.engine.add_odometry(
            'odom0',
            OdometryData(
                START + t,
                'odom',
                'base_link',
                position,
                (0.0, 0.0, 0.0, 1.0),
                covariance,
                velocity,
                (0.0, 0.0, 0.0),
                covariance,
            ),
        )

    def imu(self, t):
        """A measurement of the IMU."""
        still = (0.0, 0.0, 0.0)
        data = ImuData(START + t, 'base_link', (*still, 1.0), np.eye(3) * 0.01, still, np.eye(3) * 1e-5)
        self.engine.add_imu('imu0', data)

    def tick(self, t):
        """A tick of the filter's timer."""
        self._output = output = self.engine.tick(START + t) or self._output
        if output is None:
            return
        if output.transform is not None:
            made = output.transform
            self.transforms.set_transform(made.parent, made.child, made.transform, made.stamp)
            self._dated.append(made.stamp - START)
            self._stale.append(max(0.0, output.stamp - START - self._newest))
        self.times.append(output.stamp - START)
        self.ways.append(float(output.state[X]))
        if self._corrected:  # what a prediction has added to the variance since is taken off
            noise = self.engine.config.process_noise_covariance[X, X]
            grown = noise * (output.stamp - START - self._newest)
            self.gains.append((float(output.covariance[X, X]) - grown) / self.variance)
        self._corrected = False


def drive(
    odometry_rate: float,
    imu_rate: float,
    name: str = THESIS,
    predict: bool = False,
    variance: float = 1e-3,
    speed: float = 0.5,
) -> Drive:
    """Drive straight on for DURATION with perfect sensors (rates in Hz, variance of the odometry in m2 and (m/s)2,
    m/s).
    """
    run = _Straight(FilterConfig.from_params(parameters(name, predict)), variance, speed)
    events = [(k / odometry_rate, 0) for k in range(int(DURATION * odometry_rate))]
    events += [(k / imu_rate + IMU_PHASE, 1) for k in range(int(DURATION * imu_rate))]
    events += [(k / FREQUENCY + TICK_PHASE, 2) for k in range(int(DURATION * FREQUENCY))]
    for t, kind in sorted(events):
        (run.odometry, run.imu, run.tick)[kind](t)
    settled = len(run.times) // 3
    slope = np.polyfit(run.times[settled:], run.ways[settled:], 1)[0] / speed
    late = float(np.mean(run.staleness[len(run.staleness) // 3 :]))
    gain = float(np.median(run.gains)) if run.gains else float('nan')
    return Drive(float(slope), 1.0 + gain * late * odometry_rate, late)


def table(
    odometry_rates: Sequence[float],
    imu_rates: Sequence[float],
    name: str = THESIS,
    predict: bool = False,
    variance: float = 1e-3,
) -> list[list[Drive]]:
    """A row for each rate of the odometry, a column for each of the IMU."""
    return [[drive(o, i, name, predict, variance) for i in imu_rates] for o in odometry_rates]
