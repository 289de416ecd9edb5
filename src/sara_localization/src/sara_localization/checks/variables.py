"""Which of the state's variables a configuration measures: what is missing, what is measured twice, and what its flags
make of it.
"""

from __future__ import annotations

from sara_common.diagnostics import ERROR, WARN
from sara_localization.checks.findings import Finding, warning
from sara_localization.checks.gps_inputs import is_gps
from sara_localization.config.filter_config import FilterConfig
from sara_localization.filters.state import ANGLES, AX, AY, AZ, NAMES, OFF_PLANE, POSE, RATES, VX, YAW, X, Y

VY = VX + 1
# A sideways speed that walks by less than this, (m/s)2 per s, stays near zero where nothing measures it.
LARGEST_SIDEWAYS_NOISE = 1e-3
# robot_localization's names of the variables in its diagnostics.
PEER_NAMES = ('X', 'Y', 'Z', 'ROLL', 'PITCH', 'YAW')


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


def contradicting(config: FilterConfig) -> list[Finding]:
    """Pose variables that several inputs measure themselves, unless all say how long their errors persist: no drift."""
    found, drifts = [], {i.name for i in config.inputs if not i.correlation_time}
    for variable in range(POSE.start, POSE.stop):
        names = absolute_sources(config, variable)
        if len(names) > 1 and drifts.intersection(names) and not (config.two_d_mode and variable in OFF_PLANE):
            # What drifts (wheels) gives way to what does not.
            drifting = next((name for name in reversed(names) if name.startswith('odom')), names[-1])
            found.append(
                warning(
                    PEER_NAMES[variable] + '_configuration',
                    f'{len(names)} inputs measure {NAMES[variable]} itself ({", ".join(names)}): when they drift '
                    'apart the estimate jumps between them. Keep the one you trust and set '
                    f'{drifting}_differential: true on the others.',
                )
            )
    return found


def useless_flags(config: FilterConfig) -> list[Finding]:
    """Switches of an input that have no effect, or one that nobody wants."""
    found = []
    for i in config.inputs:
        if i.pose_use_child_frame and not any(i.mask[POSE]):
            found.append(
                warning(
                    i.name + '_configuration',
                    f'{i.name}_pose_use_child_frame has no effect: no pose variable of {i.name} is used. Leave it out.',
                )
            )
        if i.relative and absolute_sources(config, YAW) == [i.name] and config.publishes_map_to_odom:
            found.append(
                warning(
                    i.name + '_configuration',
                    f'{i.name}_relative makes yaw begin at zero: with world_frame {config.world_frame} the map is '
                    'turned by however the robot '
                    'stood at the start. Set it to false, or put the start into initial_state.',
                )
            )
    return found


def own_output(config: FilterConfig) -> list[Finding]:
    """x, y of wheel odometry taken absolutely into the map (docs/thesis_set.md)."""
    if not config.publishes_map_to_odom:
        return []
    return [
        warning(
            i.name + '_configuration',
            f'{i.name} gives x and y into the world frame {config.world_frame}: if its messages are in the frame '
            f'{config.odom_frame}, the filter brings them there with '
            f'its own {config.map_frame} -> {config.odom_frame}, measures itself and counts a part of every step '
            'twice (legs come out too long). Use vx, or set '
            f'{i.name}_differential: true.',
        )
        for i in config.inputs
        if i.kind == 'odom' and (i.mask[X] or i.mask[Y]) and not i.differential and not is_gps(i)
    ]


def accelerations(config: FilterConfig) -> list[Finding]:
    """Accelerations that would make the robot fall or run away."""
    found, rates = [], _measured_rates(config)
    for i in config.inputs:
        if i.kind != 'imu':
            continue
        used = [k for k in (AX, AY, AZ) if i.mask[k]]
        lifted = AZ in used and not config.two_d_mode
        if lifted and not i.remove_gravity:
            found.append(
                warning(
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
                warning(
                    i.name + '_configuration',
                    f'{i.name} uses {names}, but nothing measures the speed of that axis: a bias of the '
                    'accelerometer grows into metres '
                    f'within seconds. Measure the speed, or leave {names} out.',
                )
            )
    return found
