"""What RotateThenPursue sends is what the safety gate, which limits jerk behind it, makes the planned speed of."""

import pytest

from sara_common.platforms import load, parameters
from sara_control.gate.comfort import Comfort
from sara_control.gate.gate_config import SafetyConfig
from sara_nav.pursuit.smooth_command import ahead_of_smoother
from sara_nav.pursuit.smooth_speed import NO_CAPS, Motion, SpeedLimits, following

PERIOD, GATE_STEPS, GATE_PERIOD = 0.06, 3, 0.02


def settings(platform):
    """(RotateThenPursue's parameters, the gate's default profile as commanded) of a robot."""
    platform = load(platform)
    gate = SafetyConfig.from_params(parameters('sara_control', 'safety.yaml', platform))
    planner = parameters('sara_nav', 'sara_nav.yaml', platform)['RotateThenPursue']
    return planner, gate.profiles[gate.profile].commanded(gate.turn_slip)


@pytest.mark.parametrize('platform', ['sara', 'kate'])
def test_the_planner_knows_the_gate_s_jerk(platform):
    planner, profile = settings(platform)
    assert planner['smoother_jerk_x'] == pytest.approx(profile.jerk)
    assert planner['smoother_jerk_theta'] == pytest.approx(profile.turn_jerk, rel=0.01)


@pytest.mark.parametrize('platform', ['sara', 'kate'])
@pytest.mark.parametrize('axis', ['x', 'theta'])
def test_the_gate_drives_what_is_planned(platform, axis):
    planner, profile = settings(platform)
    limits = SpeedLimits(*(float(planner[f'{name}_{axis}']) for name in ('acc_lim', 'comfort_dec', 'jerk_lim')))
    highest = planner[f'max_vel_{axis}']
    lags = {jerk: lag(profile, axis, limits, highest, jerk) for jerk in (0.0, planner[f'smoother_jerk_{axis}'])}
    behind, ahead = lags.values()
    assert max(behind) > 0.8 * limits.acceleration**2 / (2.0 * planner[f'smoother_jerk_{axis}'])  # what is made good
    assert max(ahead) < 0.5 * max(behind) and min(ahead) > -0.01 * highest


def lag(profile, axis, limits, highest, jerk):
    """[by how much the gate's speed is less than the planned one at the end of each of the planner's cycles] from rest
    to the highest.
    """
    gate, now, last, found = Comfort(profile), Motion(0.0, 0.0), 0.0, []
    while now.speed < highest - 1e-6:
        speed, acceleration, _ = following(now, highest, NO_CAPS, limits, PERIOD)
        sent = ahead_of_smoother(speed, last, PERIOD, jerk, highest)
        assert speed <= sent <= highest
        for _ in range(GATE_STEPS):
            v, w = gate.step(*((sent, 0.0) if axis == 'x' else (0.0, sent)), GATE_PERIOD)
        found.append(speed - (v if axis == 'x' else w))
        now, last = Motion(speed, acceleration), speed
    return found


def test_braking_and_standing_are_sent_as_planned():
    for now, last in ((0.3, 0.4), (-0.3, -0.4), (0.0, 0.2), (0.2, -0.1), (0.0, 0.0)):
        assert ahead_of_smoother(now, last, 0.05, 0.8, 0.8) == now
    assert ahead_of_smoother(0.3, 0.28, 0.05, 0.0, 0.8) == 0.3
    assert ahead_of_smoother(0.3, 0.28, 0.0, 0.8, 0.8) == 0.3
    assert ahead_of_smoother(-0.3, -0.28, 0.05, 0.8, 0.8) == pytest.approx(-0.4)
    assert ahead_of_smoother(0.79, 0.77, 0.05, 0.8, 0.8) == 0.8
    assert ahead_of_smoother(0.9, 0.88, 0.05, 0.8, 0.8) == 0.9  # a limit lowered on the way brakes nothing here
