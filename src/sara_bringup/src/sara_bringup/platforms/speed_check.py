"""What contradicts what in a robot's speeds: wheels against profiles, limits against what the wheels can do, slip,
move_base against the safety gate.
"""

from __future__ import annotations

from collections.abc import Iterator

from canserial.dbc.bus import BusDescription, BusError
from sara_bringup.platforms.gate_settings import safety_of
from sara_common.platforms import Platform, parameters

SLACK = 0.97  # of a limit that is rounded
ALIKE = 0.03  # share by which two values may differ that are to be one
TWICE = 1.03  # of both factors for slip in turns: more than what a calibration is off


def findings(platform: Platform) -> Iterator[str]:
    """A sentence for each contradiction; nothing where the gate's parameters cannot be read, which others report."""
    known = _known(platform)
    if known is None:
        return
    safety, fastest, change = known
    yield from _profiles(platform, safety, fastest)
    for where, limit in (
        ('read/max_wheel_speed', platform.parameters('read').get('max_wheel_speed', 0.0)),
        ('safety_gate/plausibility/max_wheel_speed', safety.plausibility.max_wheel_speed),
    ):
        if not limit > fastest:
            yield f'{where} is {limit:g} rad/s, the wheels turn up to {fastest:g}: true readings would be dropped'
    yield from _braking(platform, safety, change)
    yield from _command(platform, fastest)
    yield from _slip(platform, safety)
    yield from _smoothing(platform, safety)


def remarks(platform: Platform) -> Iterator[str]:
    """A sentence for each profile whose curves are driven slower than it allows. That is no mistake: the motor node
    slows both wheels alike, so that the robot stays on its curve.
    """
    known, radius = _known(platform), platform.wheels.radius
    if known is None or radius <= 0.0:
        return
    safety, fastest, _ = known
    for name, own in safety.profiles.items():
        profile = own.commanded(safety.turn_slip)
        # Speed and the outer wheel's share of the sharpest turn add up to most where one of them is as fast as allowed.
        full = profile.max_forward
        wheel, v, w = max(
            ((v + 0.5 * platform.wheels.separation * w) / radius, v, w)
            for v in (full, min(full, profile.max_lateral / profile.max_turn))
            for w in (min(profile.max_turn, profile.max_lateral / v),)
        )
        if SLACK * wheel > fastest:
            yield (
                f'profile {name} allows curves that ask for {wheel:.1f} rad/s of the outer wheel ({v:.2g} m/s, '
                f'commanded {w:.2g} rad/s), platform/motor_node/max_wheel_speed is {fastest:g}: those are driven slower'
            )


def _known(platform):
    """The gate's SafetyConfig, rad/s and rad/s2 of the wheels; None where one of them cannot be read."""
    safety = safety_of(platform)
    try:
        wheels = (float(platform.motor_node[name]) for name in ('max_wheel_speed', 'wheel_acceleration'))
        return None if safety is None else (safety, *wheels)
    except (KeyError, TypeError, ValueError):
        return None


def _profiles(platform, safety, fastest):
    radius, half = platform.wheels.radius, 0.5 * platform.wheels.separation
    for name, profile in safety.profiles.items() if radius > 0.0 else ():
        wheel = max(profile.max_forward, profile.max_turn * safety.turn_slip * half) / radius
        if SLACK * wheel > fastest:
            yield (
                f'profile {name} asks for {wheel:.1f} rad/s of a wheel, platform/motor_node/max_wheel_speed is '
                f'{fastest:g}: it would never be driven'
            )


def _braking(platform, safety, change):
    gate, wheels = safety.gate, platform.wheels
    if wheels.radius <= 0.0:
        return
    hardest = (gate.emergency_braking + gate.emergency_turn_braking * 0.5 * wheels.separation) / wheels.radius
    if change < SLACK * hardest:
        yield (
            f'platform/motor_node/wheel_acceleration is {change:g} rad/s2, the hard braking of the safety gate needs '
            f'{hardest:.1f} at the rim: the motor node would refuse it'
        )


def _command(platform, fastest):
    try:
        step = BusDescription.of(platform).resolution('WHEEL_COMMAND', 'right')
    except BusError:
        return
    if fastest > 127 * step:
        yield (
            f'platform/motor_node/max_wheel_speed is {fastest:g} rad/s, WHEEL_COMMAND says {127 * step:.1f} at '
            'most: more is never commanded'
        )


def _slip(platform, safety):
    low, high = platform.simulated.get('slip_range', (1.0, 2.0))
    multiplier = platform.parameters('diff_drive_controller').get('wheel_separation_multiplier', 1.0)
    if multiplier > TWICE and safety.turn_slip > TWICE:
        yield (
            f'diff_drive_controller/wheel_separation_multiplier is {multiplier:g} and safety_gate/turn_slip '
            f'{safety.turn_slip:g}: slip in turns counts twice'
        )
    elif not low - 0.02 <= safety.turn_slip * multiplier <= high + 0.02:
        yield f'safety_gate/turn_slip is {safety.turn_slip:g}, simulated chairs slip {low:g} to {high:g}'


def _smoothing(platform, safety):
    planner = parameters('sara_nav', 'sara_nav.yaml', platform)['RotateThenPursue']
    profile = safety.profiles[safety.profile].commanded(safety.turn_slip)
    for name, jerk in (('smoother_jerk_x', profile.jerk), ('smoother_jerk_theta', profile.turn_jerk)):
        told = planner.get(name, 0.0)
        if isinstance(told, (int, float)) and told > 0.0 and abs(told - jerk) > ALIKE * jerk:
            yield (
                f'move_base/RotateThenPursue/{name} is {told:g}, the safety gate limits jerk to {jerk:.3g} '
                f'(profile {safety.profile}): it would not drive what is planned'
            )
