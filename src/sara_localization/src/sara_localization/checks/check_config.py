"""What is wrong with a configuration before a single message came, each in one sentence with its remedy.

FilterConfig.from_params refuses what cannot work. Here is what can be started but will not do what its author wants:
the mistakes of robot_localization's users as their issue threads tell them. What only the data can show is in
survey.py.
"""

from __future__ import annotations

from sara_common.config import ConfigError
from sara_localization.checks.findings import Finding, error, warning
from sara_localization.checks.gps_inputs import gps_inputs
from sara_localization.checks.variables import (
    accelerations,
    contradicting,
    own_output,
    unmeasured,
    useless_flags,
)
from sara_localization.config.filter_config import FilterConfig
from sara_localization.filters.state import NAMES, OFF_PLANE, SIZE

TINY_PROCESS_NOISE = 1e-12
TIGHTEST_GATE = 1.0


def check(params: dict[str, object], filter: str = 'ekf') -> tuple[FilterConfig | None, list[Finding]]:
    """The configuration, or None where it is refused, and everything found in a node's parameters."""
    try:
        config = FilterConfig.from_params(params, filter)
    except ConfigError as refused:
        return None, [error('configuration', sentence.rstrip('.') + '.') for sentence in refused.faults] + _doubtful(
            refused.warnings
        )
    return config, _doubtful(config.warnings) + check_settings(config)


def _doubtful(sentences):
    return [warning('parameters', sentence) for sentence in sentences]


def check_settings(config: FilterConfig) -> list[Finding]:
    """Everything found in a configuration that can be started."""
    found: list[Finding] = []
    for checker in (
        unmeasured,
        contradicting,
        useless_flags,
        own_output,
        accelerations,
        _variances,
        _gates,
        _times,
        _control,
        gps_inputs,
    ):
        found += checker(config)
    return found


def _variances(config) -> list[Finding]:
    found = []
    Q, P = config.process_noise_covariance.diagonal(), config.initial_estimate_covariance.diagonal()
    measured = [any(i.mask[k] for i in config.inputs) for k in range(SIZE)]
    dead = [
        NAMES[k]
        for k in range(SIZE)
        if measured[k] and Q[k] < TINY_PROCESS_NOISE and not (config.two_d_mode and k in OFF_PLANE)
    ]
    if dead:
        found.append(
            warning(
                'process_noise_covariance',
                'process_noise_covariance is zero or nearly so for {}, which is measured: the filter soon believes '
                'itself and no longer follows its sensors. Give it the variance that grows in a second.'.format(
                    ', '.join(dead)
                ),
            )
        )
    huge = [NAMES[k] for k in range(SIZE) if Q[k] > 1e6 or P[k] > 1e12]
    if huge:
        found.append(
            warning(
                'process_noise_covariance',
                'the process noise or initial variance of {} is so large that numbers lose their digits; 1e3 already '
                'says "unknown".'.format(', '.join(huge)),
            )
        )
    return found


def _gates(config) -> list[Finding]:
    found = []
    for i in config.inputs:
        for part, value in (
            ('pose', i.pose_threshold),
            ('twist', i.twist_threshold),
            ('linear_acceleration', i.acceleration_threshold),
        ):
            if value < TIGHTEST_GATE:
                name = (
                    f'{i.name}_rejection_threshold'
                    if i.kind in ('pose', 'twist')
                    else f'{i.name}_{part}_rejection_threshold'
                )
                found.append(
                    warning(
                        i.name + '_configuration',
                        f'{name} is {value:g} sigmas: good measurements are rejected too. It counts in sigmas; 3 to '
                        '5 keeps out '
                        'outliers only.',
                    )
                )
    return found


def _times(config) -> list[Finding]:
    late_or_early = 'future' if config.transform_time_offset > 0 else 'past'
    doubtful = (
        (
            abs(config.transform_time_offset) > 1.0,
            'transform_time_offset',
            f'transform_time_offset is {config.transform_time_offset:g} s: users of the transform see it that far '
            f'in the {late_or_early}. 0.05 to 0.1 is usual.',
        ),
        (
            config.sensor_timeout > 10.0 / config.frequency and config.sensor_timeout > 1.0,
            'sensor_timeout',
            f'sensor_timeout is {config.sensor_timeout:g} s: without messages the estimate stands still that long. '
            f'About 1/frequency ({1.0 / config.frequency:.3g} s) is usual.',
        ),
        (
            config.transform_timeout * config.frequency > 5.0,
            'transform_timeout',
            f'transform_timeout is {config.transform_timeout:g} s, several cycles of the filter: it stands still while '
            'it waits for a transform. 0 to 0.1 s is usual.',
        ),
        (
            config.history_length > 60.0,
            'history_length',
            f'history_length is {config.history_length:g} s: every late measurement runs that much again. The largest '
            'delay of your sensors is enough.',
        ),
    )
    return [warning(key, sentence) for applies, key, sentence in doubtful if applies]


def _control(config) -> list[Finding]:
    if config.control is None or any(config.control.mask):
        return []
    return [
        warning(
            'control_config',
            'use_control is true but control_config takes nothing that is not measured: the commands have '
            'no effect. Set vx and vyaw in it, or use_control: false.',
        )
    ]
