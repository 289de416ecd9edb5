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


def drive(
    odometry_rate: float,
    imu_rate: float,
    name: str = THESIS,
    predict: bool = False,
    variance: float = 1e-3,
    speed: float = 0.5,
    duration: float = 12.0,
) -> Drive:
    """Drive straight on with perfect sensors (rates in Hz, variance of the odometry in m2 and (m/s)2, m/s, s)."""
    transforms = TransformBuffer()
    engine = FilterEngine(FilterConfig.from_params(parameters(name, predict)), transforms)
    events = [(k / odometry_rate, 0) for k in range(int(duration * odometry_rate))]
    events += [(k / imu_rate + IMU_PHASE, 1) for k in range(int(duration * imu_rate))]
    events += [(k / FREQUENCY + TICK_PHASE, 2) for k in range(int(duration * FREQUENCY))]
    times, ways, staleness, gains = [], [], [], []
    dated, stale = (
        [0.0],
        [0.0],
    )  # of each map -> odom: its stamp, and by how much the state was younger than odom -> base_link
    output, newest, corrected = None, 0.0, False
    for t, kind in sorted(events):
        stamp = START + t
        if kind == 0:
            staleness.append(float(np.interp(t, dated[-16:], stale[-16:])))
            newest, corrected = t, True
            transforms.set_transform('odom', 'base_link', Transform.from_xyz_rpy(speed * t), stamp)
            engine.add_odometry(
                'odom0',
                OdometryData(
                    stamp,
                    'odom',
                    'base_link',
                    (speed * t, 0.0, 0.0),
                    (0.0, 0.0, 0.0, 1.0),
                    np.eye(6) * variance,
                    (speed, 0.0, 0.0),
                    (0.0, 0.0, 0.0),
                    np.eye(6) * variance,
                ),
            )
        elif kind == 1:
            engine.add_imu(
                'imu0',
                ImuData(stamp, 'base_link', (0.0, 0.0, 0.0, 1.0), np.eye(3) * 0.01, (0.0, 0.0, 0.0), np.eye(3) * 1e-5),
            )
        else:
            output = engine.tick(stamp) or output
            if output is None:
                continue
            if output.transform is not None:
                made = output.transform
                transforms.set_transform(made.parent, made.child, made.transform, made.stamp)
                dated.append(made.stamp - START)
                stale.append(max(0.0, output.stamp - START - newest))
            times.append(output.stamp - START)
            ways.append(float(output.state[X]))
            if corrected:  # what a prediction has added to the variance since is taken off
                grown = engine.config.process_noise_covariance[X, X] * (output.stamp - START - newest)
                gains.append((float(output.covariance[X, X]) - grown) / variance)
            corrected = False
    settled = len(times) // 3
    slope = np.polyfit(times[settled:], ways[settled:], 1)[0] / speed
    late = float(np.mean(staleness[len(staleness) // 3 :]))
    gain = float(np.median(gains)) if gains else float('nan')
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
