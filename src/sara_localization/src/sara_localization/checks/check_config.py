"""What is wrong with a configuration before a single message came, each in one sentence with its remedy.

FilterConfig.from_params refuses what cannot work. Here is what can be started but will not do what its author wants:
the mistakes of robot_localization's users as their issue threads tell them. What only the data can show is in
survey.py.
"""

from __future__ import annotations

from typing import NamedTuple

from sara_common.config import ConfigError
from sara_common.diagnostics import ERROR, WARN
from sara_localization.config.filter_config import FilterConfig
from sara_localization.filters.state import ANGLES, AX, AY, AZ, NAMES, OFF_PLANE, POSE, RATES, SIZE, VX, YAW, X, Y

VY = VX + 1
TINY_PROCESS_NOISE = 1e-12
TIGHTEST_GATE = 1.0
# A sideways speed that walks by less than this, (m/s)2 per s, stays near zero where nothing measures it.
LARGEST_SIDEWAYS_NOISE = 1e-3
# robot_localization's names of the variables in its diagnostics.
PEER_NAMES = ('X', 'Y', 'Z', 'ROLL', 'PITCH', 'YAW')


class Finding(NamedTuple):
    """Something to be mended: its level (diagnostics.WARN or ERROR), what it is about, and a sentence with the
    remedy.
    """

    level: int
    key: str
    sentence: str


def check(params: dict[str, object], filter: str = 'ekf') -> tuple[FilterConfig | None, list[Finding]]:
    """The configuration, or None where it is refused, and everything found in a node's parameters."""
    try:
        config = FilterConfig.from_params(params, filter)
    except ConfigError as error:
        return None, [
            Finding(ERROR, 'configuration', sentence.rstrip('.') + '.') for sentence in error.faults
        ] + _doubtful(error.warnings)
    return config, _doubtful(config.warnings) + check_settings(config)


def _doubtful(sentences):
    return [Finding(WARN, 'parameters', sentence) for sentence in sentences]


def check_settings(config: FilterConfig) -> list[Finding]:
    """Everything found in a configuration that can be started."""
    found: list[Finding] = []
    for checker in (
        unmeasured,
        _contradicting,
        _useless_flags,
        _own_output,
        _accelerations,
        _variances,
        _gates,
        _times,
        _control,
    ):
        found += checker(config)
    return found


def absolute_sources(config: FilterConfig, variable: int) -> list[str]:
    """The names of the inputs that measure a pose variable itself, not its change."""
    return [i.name for i in config.inputs if i.mask[variable] and not i.differential]


def _measured_rates(config):
    """Which of the twelve pose and twist variables' rates are measured, by a twist or by a differential pose."""
    rates = [False] * 6
    for i in config.inputs:
        for k in range(6):
            rates[k] |= i.mask[6 + k] or (i.mask[k] and i.differential)
    return rates


def _controlled(config):
    return config.control.mask if config.control is not None else (False,) * 6


def unmeasured(config: FilterConfig) -> list[Finding]:
    """Pose variables of which neither the value nor the rate is measured, under the peer's keys (X_configuration)."""
    found, rates, control = [], _measured_rates(config), _controlled(config)
    for variable in range(POSE.start, POSE.stop):
        if absolute_sources(config, variable) or rates[variable] or (config.two_d_mode and variable in OFF_PLANE):
            continue
        sideways = variable == Y and config.two_d_mode and _moves_forward(config, rates)
        if sideways and config.process_noise_covariance[VY, VY] <= LARGEST_SIDEWAYS_NOISE:
            continue
        sentence = (
            'Neither {} nor its velocity is measured: its error grows without bound. Measure one of them{}.'.format(
                NAMES[variable],
                ' (a control input alone only predicts)' if control[variable] else '',
            )
        )
        if sideways:
            sentence = (
                'Neither y nor vy is measured: the estimate drifts sideways. If the robot cannot move sideways, use '
                'vy of its '
                f'wheel odometry (which says 0), or give vy a process noise of {LARGEST_SIDEWAYS_NOISE:g} or less.'
            )
        elif variable in OFF_PLANE:
            sentence = sentence[:-1] + ', or set two_d_mode if the robot stays on a floor.'
        level = ERROR
        if variable >= ANGLES.start and any(i.kind == 'imu' and any(i.mask[RATES]) for i in config.inputs):
            level = WARN
            sentence += (
                ' (Unless an IMU is mounted turned: its list counts along its own axes; check_config with a bag knows.)'
            )
        found.append(Finding(level, PEER_NAMES[variable] + '_configuration', sentence))
    return found


def _moves_forward(config, rates):
    """Whether x and yaw are known: then y of a robot that cannot move sideways is."""
    return all(rates[k] or absolute_sources(config, k) for k in (X, YAW))


def _contradicting(config) -> list[Finding]:
    found = []
    for variable in range(POSE.start, POSE.stop):
        names = absolute_sources(config, variable)
        if len(names) > 1 and not (config.two_d_mode and variable in OFF_PLANE):
            # What drifts (wheels) gives way to what does not.
            drifting = next((name for name in reversed(names) if name.startswith('odom')), names[-1])
            found.append(
                Finding(
                    WARN,
                    PEER_NAMES[variable] + '_configuration',
                    f'{len(names)} inputs measure {NAMES[variable]} itself ({", ".join(names)}): when they drift '
                    'apart the estimate jumps between them. Keep the one you trust and set '
                    f'{drifting}_differential: true on the others.',
                )
            )
    return found


def _useless_flags(config) -> list[Finding]:
    found = []
    for i in config.inputs:
        if i.pose_use_child_frame and not any(i.mask[POSE]):
            found.append(
                Finding(
                    WARN,
                    i.name + '_configuration',
                    f'{i.name}_pose_use_child_frame has no effect: no pose variable of {i.name} is used. Leave it out.',
                )
            )
        if i.relative and absolute_sources(config, YAW) == [i.name] and config.publishes_map_to_odom:
            found.append(
                Finding(
                    WARN,
                    i.name + '_configuration',
                    f'{i.name}_relative makes yaw begin at zero: with world_frame {config.world_frame} the map is '
                    'turned by however the robot '
                    'stood at the start. Set it to false, or put the start into initial_state.',
                )
            )
    return found


def _own_output(config) -> list[Finding]:
    """x, y of wheel odometry taken absolutely into the map (docs/thesis_set.md)."""
    if not config.publishes_map_to_odom:
        return []
    return [
        Finding(
            WARN,
            i.name + '_configuration',
            f'{i.name} gives x and y into the world frame {config.world_frame}: if its messages are in the frame '
            f'{config.odom_frame}, the filter brings them there with '
            f'its own {config.map_frame} -> {config.odom_frame}, measures itself and counts a part of every step '
            'twice (legs come out too long). Use vx, or set '
            f'{i.name}_differential: true.',
        )
        for i in config.inputs
        if i.kind == 'odom' and (i.mask[X] or i.mask[Y]) and not i.differential
    ]


def _accelerations(config) -> list[Finding]:
    found, rates = [], _measured_rates(config)
    for i in config.inputs:
        if i.kind != 'imu':
            continue
        used = [k for k in (AX, AY, AZ) if i.mask[k]]
        lifted = AZ in used and not config.two_d_mode
        if lifted and not i.remove_gravity:
            found.append(
                Finding(
                    WARN,
                    i.name + '_configuration',
                    f'{i.name} uses az but leaves gravity in: the robot would fall upwards, unless the sensor takes '
                    'gravity off by '
                    f'itself. Set {i.name}_remove_gravitational_acceleration: true.',
                )
            )
        loose = [
            k
            for k in used
            if not rates[k - AX] and not absolute_sources(config, X + k - AX) and not (config.two_d_mode and k == AZ)
        ]
        if loose:
            names = ', '.join(NAMES[k] for k in loose)
            found.append(
                Finding(
                    WARN,
                    i.name + '_configuration',
                    f'{i.name} uses {names}, but nothing measures the speed of that axis: a bias of the '
                    'accelerometer grows into metres '
                    f'within seconds. Measure the speed, or leave {names} out.',
                )
            )
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
            Finding(
                WARN,
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
            Finding(
                WARN,
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
                    Finding(
                        WARN,
                        i.name + '_configuration',
                        f'{name} is {value:g} sigmas: good measurements are rejected too. It counts in sigmas; 3 to '
                        '5 keeps out '
                        'outliers only.',
                    )
                )
    return found


def _times(config) -> list[Finding]:
    found = []
    if abs(config.transform_time_offset) > 1.0:
        found.append(
            Finding(
                WARN,
                'transform_time_offset',
                f'transform_time_offset is {config.transform_time_offset:g} s: users of the transform see it that far '
                f'in the {"future" if config.transform_time_offset > 0 else "past"}. 0.05 to 0.1 is usual.',
            )
        )
    if config.sensor_timeout > 10.0 / config.frequency and config.sensor_timeout > 1.0:
        found.append(
            Finding(
                WARN,
                'sensor_timeout',
                f'sensor_timeout is {config.sensor_timeout:g} s: without messages the estimate stands still that '
                'long. About 1/frequency '
                f'({1.0 / config.frequency:.3g} s) is usual.',
            )
        )
    if config.transform_timeout * config.frequency > 5.0:
        found.append(
            Finding(
                WARN,
                'transform_timeout',
                f'transform_timeout is {config.transform_timeout:g} s, several cycles of the filter: it stands '
                'still while it waits for a '
                'transform. 0 to 0.1 s is usual.',
            )
        )
    if config.history_length > 60.0:
        found.append(
            Finding(
                WARN,
                'history_length',
                f'history_length is {config.history_length:g} s: every late measurement runs that much again. The '
                'largest '
                'delay of your sensors is enough.',
            )
        )
    return found


def _control(config) -> list[Finding]:
    if config.control is None or any(config.control.mask):
        return []
    return [
        Finding(
            WARN,
            'control_config',
            'use_control is true but control_config takes nothing that is not measured: the commands have '
            'no effect. Set vx and vyaw in it, or use_control: false.',
        )
    ]


def sorted_findings(findings: list[Finding]) -> list[Finding]:
    """Errors first, each sentence once, in the order they were found."""
    unique = list(dict.fromkeys(findings))
    return sorted(unique, key=lambda finding: -finding.level)
