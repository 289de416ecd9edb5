"""Faults in pairs: what is drawn, what is judged, a few drives; and that the motor node obeys all that the PC says."""

import random
from types import SimpleNamespace

import pytest

from canserial.dbc.bus import BusDescription
from sara_common.platforms import chosen, parameters
from sara_control.gate.comfort import Comfort
from sara_control.gate.gate_config import SafetyConfig
from sara_control.gate.reasons import State
from sara_control.wheels.can_base import CanBase
from sara_lab.campaign import pairs
from sara_lowlevel.motor.motor_node import Joystick, MotorNode
from sara_sim.faults.faults import FAULTS, build

BUS, WHEELS = BusDescription.default(), chosen().wheels
SAFETY = SafetyConfig.from_params(parameters('sara_control', 'safety.yaml'))


def test_every_fault_is_drawn_two_to_four_at_once_and_overlapping():
    met = set()
    for seed in range(200):
        planned = pairs.draw(seed)
        assert 2 <= len(planned) <= 4 and planned == pairs.draw(seed)
        assert planned[-1].at - planned[0].at <= pairs.APART_S
        for fault in planned:
            build(fault.name, fault.arguments)
            met.add(fault.name)
    elsewhere = 'scan_', 'compass_'  # test_scanned.py, test_compass_lab.py: no chair here has one
    assert met == {name for name in FAULTS if not name.startswith(elsewhere)}


# An IMU that freezes among damaged frames; four frames in ten with eight wrong bits while the gate holds.
@pytest.mark.parametrize('seed', (11, 31))
def test_the_goal_ends_in_words_nothing_is_touched_and_what_is_held_stays(seed):
    assert pairs.drive(seed)['faults'] == []


def held(poses, drifting=False, mode=3, state=State.HELD):
    watch = pairs.HeldWatch()
    for pose in poses:
        drive = SimpleNamespace(drift=SimpleNamespace(active=drifting))
        motor, platform = SimpleNamespace(mode=mode), SimpleNamespace(size=(1.08, 0.58))
        chair = SimpleNamespace(pose=pose, velocity=(0.0, 0.0), drive=drive, motor=motor, platform=platform)
        wheels = SimpleNamespace(decision=SimpleNamespace(state=state))
        watch.step(SimpleNamespace(chair=chair, wheels=wheels))
    return watch.moved


def test_what_moves_while_it_is_held_is_seen():
    poses = ((0.0, 0.0, 3.1), (0.03, 0.04, 3.1), (0.0, 0.0, -3.1))
    assert held(poses) == pytest.approx(0.083 * 0.613, abs=1e-3)
    assert held(poses[:2]) == pytest.approx(0.05)
    assert held(poses, drifting=True) == held(poses, mode=1) == held(poses, state=State.DRIVING) == 0.0


def said(seed, profile, lost):
    """A MotorNode's counts, and the fastest it drove, rad/s: told for a minute what the gate says of random commands,
    through a bus that delays by up to 10 ms and loses a share of the frames.
    """
    chance, comfort = random.Random(seed), Comfort(SAFETY.profiles[profile])
    base, node = CanBase(BUS, WHEELS.steps_per_turn), MotorNode(BUS)
    base.on_mode(3)
    node.update(0.0, 0, 0, Joystick())
    node.receive(base.stop(), 0.0)
    pending, fastest, wanted, brakes = [], 0.0, (0.0, 0.0), False
    for tick in range(1, 6000):
        t = tick / 100
        if chance.random() < 0.01:
            wanted = chance.uniform(-0.5, 1.1), chance.uniform(-1.0, 1.0)
            brakes = chance.random() < 0.3
        if tick % 2 == 0:
            if brakes:
                comfort.brake(0.02, SAFETY.gate.emergency_braking, SAFETY.gate.emergency_turn_braking)
            else:
                comfort.step(*wanted, 0.02)
            turn = 0.5 * WHEELS.separation * comfort.w
            left, right = [(comfort.v + wheel) / WHEELS.radius for wheel in (-turn, turn)]
            if chance.random() >= lost:
                pending.append((t + chance.uniform(0.0, 0.01), base.command(left, right)))
        for _, frame in [late for late in pending if late[0] <= t]:
            node.receive(frame, t)
        pending = [late for late in pending if late[0] > t]
        node.update(t, 0, 0, Joystick())
        fastest = max(fastest, *map(abs, node.target))
    return node.counts, fastest


@pytest.mark.parametrize('profile', ('gentle', 'standard', 'brisk'))
@pytest.mark.parametrize('lost', (0.0, 0.02, 0.3))
def test_the_motor_node_obeys_all_that_the_safety_gate_says(profile, lost):
    counts, fastest = said(7, profile, lost)
    assert fastest > 2.0 and counts['jump of a command'] + counts['damaged command'] == 0
