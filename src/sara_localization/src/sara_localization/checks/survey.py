"""What a recorded drive says about a configuration: what is missing, what is no data, and which sensor misleads.

    survey = Survey(config, transforms)
    survey.add('imu0', ImuData(...), received)      # every message of every input, in the order of their reception
    survey.findings()                               # [check_config.Finding]

Nothing is estimated here: each input is looked at for itself, then the sources of yaw are compared (turning.py).
"""

from __future__ import annotations

import contextlib
import math

import numpy as np

from sara_common.diagnostics import ERROR, OK, WARN
from sara_localization.checks import yaw_sources as turning
from sara_localization.checks.check_config import Finding
from sara_localization.checks.mounting import check_mountings
from sara_localization.config.filter_config import FilterConfig, InputConfig
from sara_localization.filters.state import ACCELERATION, ANGLES, NAMES, RATES, TWIST, YAW
from sara_localization.geometry.rigid import IDENTITY, normalised, rotate, rpy_from_quaternion
from sara_localization.inputs.data import ImuData, OdometryData
from sara_localization.inputs.measurement import measures

LARGEST_DELAY = 1.0
LARGEST_CLOCK_ERROR = 3600.0
TINY_VARIANCE = 1e-9
LONGEST_GAP_PERIODS = 10.0


class _Record:
    """What came of one input: stamps, (n, 15) values as the message has them, variances, what was wrong."""

    def __init__(self, config: InputConfig):
        self.config = config
        self.stamps, self.received, self.values, self.variances = [], [], [], []
        self.frames, self.lost = {}, {}
        self.headings, self.rates = [], []  # (stamp, yaw) and (stamp, yaw rate) along the robot's axes
        self.wheels = []  # (stamp, speed, yaw rate) of a twist
        self.mounting = None  # robot_from_sensor


class Survey:
    """All inputs over one drive; `transforms` as the filter has them (transforms.Transforms)."""

    def __init__(self, config: FilterConfig, transforms):
        self.config, self.transforms = config, transforms
        self.replaces = set()  # keys of check_config's findings that findings() knows better
        self._records: dict[str, _Record] = {i.name: _Record(i) for i in config.inputs}

    def add(self, name: str, data, received: float):
        """A message of input `name` (data.py) received at a time (s)."""
        record = self._records[name]
        values, variances = _numbers(data)
        record.stamps.append(data.stamp)
        record.received.append(received)
        record.values.append(values)
        record.variances.append(variances)
        for part, target, source in self._ways(record.config, data):
            if not source or (
                source.lstrip('/') != target and self.transforms.lookup(target, source.lstrip('/'), data.stamp) is None
            ):
                record.lost[part, source, target] = record.lost.get((part, source, target), 0) + 1
        if data.stamp > 0.0 and abs(data.stamp - received) < LARGEST_CLOCK_ERROR:
            self._add_turning(record, data)

    def _ways(self, config, data):
        """The transforms that the message's used parts need: (part, target, source)."""
        base, world, mask = self.config.base_link_frame, self.config.world_frame, config.mask
        if isinstance(data, ImuData):
            return [('', base, data.frame_id)]
        ways = []
        if config.kind in ('odom', 'pose') and any(mask[:6]):
            ways.append(('pose', world, data.frame_id))
        if config.kind in ('odom', 'twist') and any(mask[TWIST]):
            ways.append(
                ('twist', base, (data.child_frame_id if isinstance(data, OdometryData) else data.frame_id) or base)
            )
        return ways

    def _add_turning(self, record, data):
        base = self.config.base_link_frame
        kind = record.config.kind
        frame = data.child_frame_id if kind == 'odom' else data.frame_id
        mounting = IDENTITY
        if kind in ('imu', 'odom', 'twist') and frame.lstrip('/') not in ('', base):
            mounting = self.transforms.lookup(base, frame.lstrip('/'), data.stamp)
        if mounting is None:
            return
        record.mounting = record.mounting or mounting
        if kind != 'pose' and not (kind == 'imu' and not measures(data.angular_velocity_covariance)):
            rate = rotate(mounting.rotation, data.angular_velocity if kind == 'imu' else data.angular)[2]
            if math.isfinite(rate):
                record.rates.append((data.stamp, rate))
                if kind != 'imu' and math.isfinite(data.linear[0]):
                    record.wheels.append((data.stamp, data.linear[0], rate))
        if kind in ('imu', 'pose') and not (kind == 'imu' and not measures(data.orientation_covariance)):
            with contextlib.suppress(ValueError):
                record.headings.append((data.stamp, rpy_from_quaternion(normalised(data.orientation))[2]))

    def findings(self) -> list[Finding]:
        """Everything found, input by input, then what the comparison of their yaws says."""
        found = []
        for record in self._records.values():
            found += self._of_input(record)
        mountings = {name: record.mounting for name, record in self._records.items() if record.mounting is not None}
        mounted, self.replaces = check_mountings(self.config, mountings)
        return found + mounted + self._of_turning()

    def _of_input(self, record) -> list[Finding]:
        name, topic, n = record.config.name, record.config.topic, len(record.stamps)
        key = name + '_data'
        if not n:
            return [Finding(ERROR, key, f'{name}: no message on {topic}. Set {name} to a topic that exists.')]
        found = []
        for (part, source, target), count in record.lost.items():
            what = f'{name} ({part})' if part else name
            found.append(
                Finding(
                    ERROR,
                    name + '_transform',
                    f'{what}: {count} of {n} messages are lost, no transform {source or "(empty frame_id)"} -> '
                    f'{target}. Publish it (static_transform_publisher, or a URDF with robot_state_publisher), or '
                    f'mend the frame_id of {topic}.',
                )
            )
        return found + self._of_stamps(record, key) + self._of_values(record, key)

    def _of_stamps(self, record, key):
        name, found = record.config.name, []
        stamps, received = np.array(record.stamps), np.array(record.received)
        none = int(np.sum(~(stamps > 0.0)))
        if none:
            found.append(
                Finding(
                    ERROR,
                    key,
                    f'{name}: {none} of {len(stamps)} messages have no time stamp and are dropped. Its driver must '
                    'set header.stamp.',
                )
            )
        stamped = stamps > 0.0
        steps, delays = np.diff(stamps[stamped]), (received - stamps)[stamped]
        back = int(np.sum(steps < 0.0))
        if back:
            lagged = self.config.smooth_lagged_data
            remedy = (
                'they are put in order by smooth_lagged_data.'
                if lagged
                else 'they are dropped. smooth_lagged_data: true with a history_length of '
                f'{max(0.1, -2.0 * steps.min()):.2g} s would use them.'
            )
            if not lagged:
                found.append(
                    Finding(
                        WARN,
                        key,
                        f'{name}: {back} of {len(stamps)} messages are older than the one before them, by up to '
                        f'{-steps.min():.3f} s: {remedy}',
                    )
                )
        if len(delays) and float(np.median(delays)) > LARGEST_DELAY:
            found.append(
                Finding(
                    WARN,
                    key,
                    f'{name}: messages arrive {np.median(delays):.2f} s after their stamp (median): is the clock of '
                    'its computer set? '
                    'smooth_lagged_data with a longer history_length is the remedy for real delays.',
                )
            )
        if len(delays) and float(np.median(delays)) < -0.1:
            found.append(
                Finding(
                    WARN,
                    key,
                    f'{name}: stamps are {-np.median(delays):.2f} s in the future (median): they wait until their '
                    'time comes. Set the clock '
                    'of its computer (chrony, NTP).',
                )
            )
        forward = steps[steps > 0.0]
        if len(forward) > 10 and forward.max() > max(LONGEST_GAP_PERIODS * np.median(forward), 1.0):
            found.append(
                Finding(
                    WARN,
                    key,
                    f'{name}: a gap of {forward.max():.1f} s between messages that usually come every '
                    f'{np.median(forward):.3f} s: the estimate only predicts '
                    'meanwhile. Look for lost messages or a sleeping driver.',
                )
            )
        return found

    def _of_values(self, record, key):
        name, mask, found = record.config.name, record.config.mask, []
        values, variances = np.array(record.values), np.array(record.variances)
        used = [k for k in range(15) if mask[k]]
        absent = [k for k in used if record.config.kind == 'imu' and (variances[:, _block_start(k)] == -1.0).all()]
        if absent:
            names = ', '.join(NAMES[k] for k in absent)
            found.append(
                Finding(
                    WARN,
                    key,
                    f'{name} is to give {names}, but its messages say (covariance -1) that it does not measure '
                    'that. Take it '
                    f'out of {name}_config.',
                )
            )
        for k in (k for k in used if k not in absent):
            what, v, s2 = NAMES[k], values[:, k], variances[:, k]
            if not np.isfinite(v).all():
                found.append(
                    Finding(
                        WARN,
                        key,
                        f'{name}: {what} is not a number in {int(np.sum(~np.isfinite(v)))} of {len(v)} messages, '
                        'which are left out.',
                    )
                )
            bad = int(np.sum(~(s2 > 0.0)))
            if bad:
                found.append(
                    Finding(
                        ERROR,
                        key,
                        f'{name}: the variance of {what} is zero, negative or no number in {bad} of {len(s2)} '
                        f'messages, and {what} is left out there. Its driver must state how exact it is.',
                    )
                )
            elif float(np.median(s2)) < TINY_VARIANCE:
                found.append(
                    Finding(
                        WARN,
                        key,
                        f'{name}: the variance of {what} is {np.median(s2):.1g}: nobody else will be believed. '
                        'State what the sensor really '
                        'does.',
                    )
                )
            if len(v) > 20 and np.isfinite(v).all() and np.ptp(v) == 0.0 and self._others_move(record, k):
                found.append(
                    Finding(
                        WARN,
                        key,
                        f'{name}: {what} is {v[0]:g} in every message although the robot moves: it is not measured. '
                        'Take it out of '
                        f'{name}_config.',
                    )
                )
        return found

    def _others_move(self, record, k):
        """Whether any input saw the variable, or for a yaw any turning, change."""
        for other in self._records.values():
            if other is record or not other.values:
                continue
            v = np.array(other.values)[:, k]
            v = v[np.isfinite(v)]
            if len(v) and np.ptp(v) > 0.05:
                return True
        return False

    def sources(self) -> list[turning.Source]:
        """Every yaw that the drive's messages hold."""
        found = []
        for record in self._records.values():
            name, kind = record.config.name, record.config.kind
            if len(record.headings) > 2:
                t, yaw = _in_order(record.headings)
                found.append(turning.Source(name + ("'s heading" if kind == 'imu' else "'s yaw"), t, np.unwrap(yaw)))
            if len(record.rates) > 2:
                t, rate = _in_order(record.rates)
                if np.ptp(rate) > 0.0:
                    found.append(
                        turning.Source(
                            name + ("'s gyro" if kind == 'imu' else "'s turning rate"), t, turning.integrated(t, rate)
                        )
                    )
        return found

    def comparison(self) -> turning.Comparison | None:
        """The sources of yaw compared."""
        return turning.compare(self.sources())

    def _of_turning(self) -> list[Finding]:
        comparison, found = self.comparison(), []
        for what in turning.misleading(comparison):
            name, measured = what.split("'s ")
            others = {b if a == what else a: value for (a, b), value in comparison.median.items() if what in (a, b)}
            against = ', '.join(f'{math.degrees(value):.1f} deg from {other}' for other, value in others.items())
            agreeing = min((pair for pair in comparison.median if what not in pair), key=comparison.median.get)
            level = WARN if self._used(name, measured) else OK
            found.append(
                Finding(
                    level,
                    name + '_misleads',
                    '{} misleads: in {:g} s it is off by {} (medians), while {} and {} agree to {:.1f} deg. {}'.format(
                        what,
                        turning.WINDOW,
                        against,
                        *agreeing,
                        math.degrees(comparison.median[agreeing]),
                        self._remedy(name, measured),
                    ),
                )
            )
        return found + self._of_gyros()

    def _used(self, name, measured):
        mask = self._records[name].config.mask
        return mask[YAW] if measured in ('heading', 'yaw') else any(mask[RATES])

    def _remedy(self, name, measured):
        if not self._used(name, measured):
            return 'It is rightly not used.'
        if measured == 'heading':
            return f'Take yaw out of {name}_config, use the rate of its gyro, and set {name}_gyro_bias: standstill.'
        if measured == 'yaw':
            return f'Take yaw out of {name}_config.'
        return f'Take the rate out of {name}_config, or give it a larger variance.'

    def _of_gyros(self) -> list[Finding]:
        """The mean rate of each used gyro where wheels say that the robot stands."""
        wheels = next((r.wheels for r in self._records.values() if len(r.wheels) > 20), None)
        if wheels is None:
            return []
        t, speed, turning_rate = _in_order(wheels)
        found = []
        for record in self._records.values():
            if record.config.kind != 'imu' or len(record.rates) < 20 or not any(record.config.mask[RATES]):
                continue
            at, rates = _in_order(record.rates)
            bias = turning.standstill_bias(at, rates, turning.at_rest(at, t, speed, turning_rate))
            if record.config.gyro_bias == 'off' and bias and abs(bias[0]) > max(4.0 * bias[1], math.radians(0.05)):
                found.append(
                    Finding(
                        WARN,
                        record.config.name + '_bias',
                        f'{record.config.name}: its gyro turns by {math.degrees(bias[0]):.3f} deg/s while the '
                        f'wheels stand: {abs(math.degrees(bias[0])) * 600.0:.0f} deg in ten minutes. Calibrate it, '
                        'or set '
                        f'{record.config.name}_gyro_bias: standstill.',
                    )
                )
        return found


def _block_start(k):
    """The first variable of the block whose covariance begins with -1 where an IMU lacks it."""
    return ANGLES.start if k in range(3, 6) else RATES.start if k in range(9, 12) else ACCELERATION.start


def _in_order(rows):
    """(n,) times and the other columns of rows, oldest first, without repeated times."""
    columns = np.array(rows).T
    _, first = np.unique(columns[0], return_index=True)
    return columns[:, first]


def _numbers(data):
    """(15,) values and variances of a message, NaN and 1 where its kind has none."""
    values, variances = np.full(15, np.nan), np.ones(15)

    def put(first, value, covariance):
        n = len(value)
        values[first : first + n] = value
        size = int(round(math.sqrt(np.size(covariance))))
        variances[first : first + n] = np.reshape(covariance, (size, size)).diagonal()[:n]

    def angles(q):
        try:
            return rpy_from_quaternion(normalised(q))
        except ValueError:
            return (math.nan,) * 3

    if isinstance(data, ImuData):
        put(3, angles(data.orientation), data.orientation_covariance)
        put(9, data.angular_velocity, data.angular_velocity_covariance)
        put(12, data.linear_acceleration, data.linear_acceleration_covariance)
        return values, variances
    if isinstance(data, OdometryData):
        put(0, (*data.position, *angles(data.orientation)), data.pose_covariance)
        put(6, (*data.linear, *data.angular), data.twist_covariance)
    elif hasattr(data, 'position'):
        put(0, (*data.position, *angles(data.orientation)), data.covariance)
    else:
        put(6, (*data.linear, *data.angular), data.covariance)
    return values, variances
