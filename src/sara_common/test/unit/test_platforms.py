"""The robots' folders: what they say, which one is chosen, and what is wrong with one in words."""

import argparse
import shutil
from math import radians

import pytest

from sara_common import platforms
from sara_common.config import ConfigError
from sara_common.planar import Pose2D
from sara_common.platforms import Wheels


@pytest.fixture(autouse=True)
def nobody_chose(monkeypatch):
    monkeypatch.delenv(platforms.ENVIRONMENT, raising=False)


def test_what_the_folders_say():
    sara, kate = map(platforms.load, ('sara', 'kate'))
    assert sara.wheels == Wheels(0.155, 0.525, 64000) and sara.size == (1.08, 0.58) and len(sara.sonars) == 9
    assert sara.footprint == ((0.54, 0.29), (0.54, -0.29), (-0.54, -0.29), (-0.54, 0.29))
    assert kate.sonars['RR'] == Pose2D(-0.40, -0.16, radians(-168.0)) and len(kate.sonars) == 6
    assert kate.parameters('safety_gate')['zones']['sensors']['ML'] == {
        'x': 0.05,
        'y': 0.275,
        'yaw_deg': 90.0,
        'near': 0.1,
    }
    assert kate.parameters('nobody') == {} and '<robot name="kate">' in kate.urdf


def test_nobody_changes_what_others_are_given():
    platforms.load('kate').parameters('safety_gate')['zones']['length'] = 9.0
    assert platforms.load('kate').parameters('safety_gate')['zones']['length'] == 0.80


def test_the_environment_chooses_and_a_command_may(monkeypatch):
    assert platforms.chosen() is platforms.load('default') is platforms.load('sara')
    monkeypatch.setenv(platforms.ENVIRONMENT, 'kate')
    assert platforms.chosen().name == 'kate'
    parser = argparse.ArgumentParser()
    platforms.add_option(parser)
    assert parser.parse_args(['--platform', 'sara']).platform is platforms.chosen() is platforms.load('sara')
    assert parser.parse_args([]).platform is None and platforms.chosen().name == 'sara'


def test_a_folder_anywhere(monkeypatch, tmp_path):
    monkeypatch.setenv(platforms.ENVIRONMENT, 'kate')
    shutil.copytree(platforms.folders()['kate'], tmp_path / 'mary')
    monkeypatch.chdir(tmp_path)
    assert platforms.choose('mary').name == 'mary'
    monkeypatch.chdir('/')
    assert platforms.chosen().folder == tmp_path / 'mary'


def test_a_robot_nobody_knows_ends_a_command_with_a_sentence(capsys):
    parser = argparse.ArgumentParser()
    platforms.add_option(parser)
    with pytest.raises(SystemExit):
        parser.parse_args(['--platform', 'nelly'])
    assert "platform is 'nelly', allowed are kate, sara or the path of a folder" in capsys.readouterr().err


def test_a_nodes_parameters_are_its_file_with_the_robot_on_top():
    gates = [platforms.parameters('sara_control', 'safety.yaml', platforms.load(name)) for name in ('sara', 'kate')]
    assert [gate['zones']['length'] for gate in gates] == [1.08, 0.80]
    assert gates[0]['zones']['stop_distance'] == gates[1]['zones']['stop_distance'] == 0.15
    assert set(gates[1]['zones']['sensors']) == set(platforms.load('kate').sonars)


FACTS = """
platform:
  body: {length: 1.0, width: 0.5, height: 1.0}
  wheels: {radius: 0.1, separation: 0.4, steps_per_turn: 100}
  imu: {x: 0.0, y: 0.0, yaw_deg: 0.0}
  scan: {x: 0.0, y: 0.0, yaw_deg: 0.0}
  gps: {x: 0.0, y: 0.0, yaw_deg: 0.0}
  sonars: {A: {x: 0.5, y: 0.0, yaw_deg: 0.0}}
  sensor_node: {imu_period: 0.05}
  motor_node: {max_wheel_speed: 7.0}
  joystick_node: {max_turn: 1.0}
  simulated: {battery: 24.0}
read: {}
"""


@pytest.mark.parametrize(
    'old, new, words',
    [
        ('length: 1.0', 'length: long', "platform/body/length is 'long', allowed are numbers"),
        (', height: 1.0', '', 'platform/body/height is None'),
        ('steps_per_turn: 100', 'steps_per_turn: 1.5', 'steps_per_turn is 1.5, allowed are whole numbers'),
        ('imu: {x: 0.0', 'imu: {up: 1.0, x: 0.0', 'platform/imu/up is 1.0, but there is no such line'),
        ('A: {x: 0.5', 'A: {x: .nan', 'platform/sonars/A/x is nan'),
        ('sonars: {A: {x: 0.5, y: 0.0, yaw_deg: 0.0}}', 'sonars: [A]', "platform/sonars is ['A']"),
        ('motor_node: {max_wheel_speed: 7.0}', 'motor: {}', 'platform/motor_node is {}'),
        ('simulated:', 'simulation:', "platform/simulation is {'battery': 24.0}, but there is no such section"),
        ('read: {}', 'read: 7', 'read is 7, allowed is a mapping'),
        ('platform:', 'platfrom:', 'has no section platform'),
        ('read: {}', 'read: {', 'cannot be read'),
    ],
)
def test_a_fault_is_said_in_words(tmp_path, old, new, words):
    assert old in FACTS
    folder = tmp_path / 'robot'
    folder.mkdir()
    (folder / 'platform.yaml').write_text(FACTS.replace(old, new))
    with pytest.raises(ConfigError) as error:
        platforms.load(str(folder))
    assert words in str(error.value)


def test_a_folder_without_faults_is_read(tmp_path):
    (tmp_path / 'platform.yaml').write_text(FACTS)
    assert platforms.load(str(tmp_path)).wheels.steps_per_turn == 100
    assert isinstance(platforms.load(str(tmp_path)).wheels.steps_per_turn, int)
