"""What a recorded drive says about a configuration: what is missing, what is no data, and which sensor misleads.

    survey = Survey(config, transforms)
    survey.add('imu0', ImuData(...), received)      # every message of every input, in the order of their reception
    survey.findings()                               # [findings.Finding]

Nothing is estimated here: each input is looked at for itself, then the sources of yaw are compared (turning.py).
"""

from __future__ import annotations

import contextlib
import math
from typing import Any

import numpy as np

from sara_common.diagnostics import OK, WARN
from sara_localization.checks import yaw_sources as turning
from sara_localization.checks.findings import Finding, error, warning
from sara_localization.checks.messages import stamp_findings, value_findings
from sara_localization.checks.mounting import check_mountings
from sara_localization.checks.records import Record, in_order
from sara_localization.config.filter_config import FilterConfig
from sara_localization.filters.state import ANGLES, RATES, TWIST, YAW
from sara_localization.geometry.rigid import IDENTITY, normalised, rotate, rpy_from_quaternion
from sara_localization.inputs.data import ImuData, OdometryData
from sara_localization.inputs.measurement import measures

LARGEST_CLOCK_ERROR = 3600.0


class Survey:
    """All inputs over one drive; `transforms` as the filter has them (transforms.Transforms)."""

    def __init__(self, config: FilterConfig, transforms):
        self.config, self.transforms = config, transforms
        self.replaces = set()  # keys of check_config's findings that findings() knows better
        self._records: dict[str, Record] = {i.name: Record(i) for i in config.inputs}

    def add(self, name: str, data: Any, received: float) -> None:
        """A message of input `name` (data.py) received at a time (s)."""
        record = self._records[name]
        record.keep(data, received)
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
            return [('', base, data.frame_id or ('' if any(mask[ANGLES]) else base))]
        ways = []
        if config.kind in ('odom', 'pose') and any(mask[:6]) and not config.differential:
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
        if not n:
            return [error(record.key, f'{name}: no message on {topic}. Set {name} to a topic that exists.')]
        found = []
        for (part, source, target), count in record.lost.items():
            what = f'{name} ({part})' if part else name
            found.append(
                error(
                    name + '_transform',
                    f'{what}: {count} of {n} messages are lost, no transform {source or "(empty frame_id)"} -> '
                    f'{target}. Publish it (static_transform_publisher, or a URDF with robot_state_publisher), or '
                    f'mend the frame_id of {topic}.',
                )
            )
        others = [other for other in self._records.values() if other is not record]
        return found + stamp_findings(record, self.config.smooth_lagged_data) + value_findings(record, others)

    def sources(self) -> list[turning.Source]:
        """Every yaw that the drive's messages hold."""
        found = []
        for record in self._records.values():
            name, kind = record.config.name, record.config.kind
            if len(record.headings) > 2:
                t, yaw = in_order(record.headings)
                found.append(turning.Source(name + ("'s heading" if kind == 'imu' else "'s yaw"), t, np.unwrap(yaw)))
            if len(record.rates) > 2:
                t, rate = in_order(record.rates)
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
        t, speed, turning_rate = in_order(wheels)
        found = []
        for record in self._records.values():
            if record.config.kind != 'imu' or len(record.rates) < 20 or not any(record.config.mask[RATES]):
                continue
            at, rates = in_order(record.rates)
            bias = turning.standstill_bias(at, rates, turning.at_rest(at, t, speed, turning_rate))
            if record.config.gyro_bias == 'off' and bias and abs(bias[0]) > max(4.0 * bias[1], math.radians(0.05)):
                found.append(
                    warning(
                        record.config.name + '_bias',
                        f'{record.config.name}: its gyro turns by {math.degrees(bias[0]):.3f} deg/s while the '
                        f'wheels stand: {abs(math.degrees(bias[0])) * 600.0:.0f} deg in ten minutes. Calibrate it, '
                        'or set '
                        f'{record.config.name}_gyro_bias: standstill.',
                    )
                )
        return found
