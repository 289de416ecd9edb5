"""The robot node's parameters: every fault is named, what config/robot.yaml says are the defaults."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from sara_common.config import ConfigError
from sara_sim.ros.robot_settings import RobotSettings, made_robot
from sara_sim.world.obstacles import ObstacleError
from sara_sim.world.world import World, WorldError

CONFIG = Path(__file__).resolve().parents[2] / 'config' / 'robot.yaml'


def test_the_file_beside_the_launch_file_holds_the_defaults():
    values = yaml.safe_load(CONFIG.read_text())
    assert RobotSettings.from_params(values) == RobotSettings()
    assert set(values) == {
        *RobotSettings().robot.__dataclass_fields__,
        'odom_rate',
    }
    assert set(values['scanners'][0]) == set(RobotSettings().robot.scanners[0].__dataclass_fields__)


def test_every_fault_is_named_at_once():
    bad = {
        'map': 3,
        'map_topic': None,
        'obstacles': 1,
        'start': [1, 2],
        'seed': -1,
        'speed': float('nan'),
        'odom_rate': 30,
        'size': [0.4],
        'max_vel_x': 'fast',
        'velocity': 1.0,
    }
    with pytest.raises(ConfigError) as error:
        RobotSettings.from_params(bad)
    for name in bad:
        assert f'{name} is' in str(error.value)


@pytest.mark.parametrize('scanners', ['front', [3], [{'beams': 3}], [{}, {'rate': 7}]])
def test_a_bad_scanner_is_named(scanners):
    with pytest.raises(ConfigError, match='scanners'):
        RobotSettings.from_params({'scanners': scanners})


def test_a_map_comes_from_a_file_or_a_topic():
    with pytest.raises(ConfigError, match='map_topic'):
        RobotSettings.from_params({'map': 'a.yaml', 'map_topic': 'map'})


def test_scanners_are_as_many_as_are_given():
    assert RobotSettings.from_params({'scanners': []}).robot.scanners == ()
    two = RobotSettings.from_params({'scanners': [{'x': 0.1}, {'x': -0.1}]}).robot.scanners
    assert [one.x for one in two] == [0.1, -0.1]


def test_cells_of_an_occupancy_grid_are_walls_from_65_on():
    world = World.from_grid(np.array([[-1, 0, 64], [65, 100, 0]], np.int8), 0.5, (1.0, 2.0, 0.0))
    assert world.occupied.tolist() == [[False, False, False], [True, True, False]]
    assert world.origin == (1.0, 2.0) and world.resolution == 0.5


@pytest.mark.parametrize(
    ('cells', 'resolution', 'origin', 'name'),
    [
        (np.zeros((0, 3)), 0.05, (0.0, 0.0, 0.0), 'shape'),
        (np.zeros((2, 2)), 0.0, (0.0, 0.0, 0.0), 'resolution'),
        (np.zeros((2, 2)), float('nan'), (0.0, 0.0, 0.0), 'resolution'),
        (np.zeros((2, 2)), 0.05, (0.0, 0.0, 0.5), 'origin'),
        (np.zeros((2, 2)), 0.05, (float('nan'), 0.0, 0.0), 'origin'),
    ],
)
def test_a_grid_that_is_no_map_is_refused(cells, resolution, origin, name):
    with pytest.raises(WorldError, match=name):
        World.from_grid(cells, resolution, origin)


def test_a_map_and_obstacles_from_files_are_its_world(tmp_path):
    things = tmp_path / 'things.yaml'
    things.write_text('obstacles: [{name: box, size: [1.0, 1.0], at: [2.0, 0.0]}]')
    settings = RobotSettings.from_params({'obstacles': str(things), 'scanners': [{'x': 0.0, 'sigma': 0.0}]})
    robot = made_robot(settings)
    robot.step()
    assert robot.scans[0][1].ranges[270] == pytest.approx(1.5)
    with pytest.raises(WorldError, match='obstacle'):
        made_robot(RobotSettings.from_params({'obstacles': str(things), 'start': [2.0, 0.0, 0.0]}))


def test_ramps_and_what_cannot_be_read_are_refused(tmp_path):
    ramps = tmp_path / 'ramps.yaml'
    ramps.write_text('ramps: [{x: 1.0, y: 0.0, length: 2.0, width: 1.0, slope_deg: 5}]')
    with pytest.raises(ObstacleError, match='ramps'):
        made_robot(RobotSettings(obstacles=str(ramps)))
    with pytest.raises(WorldError, match='cannot be read'):
        made_robot(RobotSettings(map=str(tmp_path / 'none.yaml')))


def test_a_map_that_was_heard_is_its_world():
    cells = np.zeros((100, 100), np.int8)
    cells[:, 80:] = 100
    robot = made_robot(RobotSettings(start=(1.0, 2.0, 0.0)), World.from_grid(cells, 0.05, (0.0, 0.0, 0.0)))
    robot.step()
    assert robot.scans[0][1].ranges[270] == pytest.approx(4.0 - 1.05, abs=0.05)
