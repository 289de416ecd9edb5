"""Parameters of the robot node, checked before anything starts."""

from __future__ import annotations

from dataclasses import dataclass, replace

from sara_common.config import ConfigError, fault, filled, range_faults
from sara_sim.config import Checked
from sara_sim.pedestrians import course
from sara_sim.robot.robot import SimulatedRobot
from sara_sim.robot.robot_config import RobotConfig, ScannerConfig, rate_faults
from sara_sim.ros.settings import common_faults
from sara_sim.world.obstacles import ObstacleError
from sara_sim.world.world import World


@dataclass(frozen=True)
class RobotSettings(Checked):
    """Of the node; those of RobotConfig are parameters too, `scanners` as a list of mappings of ScannerConfig's fields.

    `map`: YAML file, '' for an empty floor. `map_topic`: topic (nav_msgs/OccupancyGrid) whose first map is taken
    instead, '' for none. `obstacles`: YAML file, '' for none. `start`: x, y (m), yaw (rad) of base_link in the map.
    `speed`: simulated seconds per second; 0: as many as the machine can. `odom_rate`: odometry, truth and tf per s.
    """

    map: str = ''
    map_topic: str = ''
    obstacles: str = ''
    start: tuple = (0.0, 0.0, 0.0)
    seed: int = 0
    speed: float = 1.0
    odom_rate: int = 20
    robot: RobotConfig = RobotConfig()

    @classmethod
    def from_params(cls, params: dict) -> RobotSettings:
        """From the node's private parameters. Raises ConfigError that names every fault, unknown names included."""
        own = [name for name in cls.__dataclass_fields__ if name != 'robot']
        rest, faults, made = {name: value for name, value in params.items() if name not in own}, [], []
        if 'scanners' in rest:
            rest['scanners'] = _scanners(rest['scanners'], faults)
        for part, values in ((RobotConfig, rest), (cls, {name: params[name] for name in own if name in params})):
            try:
                made.append(filled(part, values))
            except ConfigError as error:
                faults += error.faults
        if faults:
            raise ConfigError(faults)
        robot, settings = made
        return replace(settings, robot=robot)

    def validate(self) -> list[str]:
        """One sentence for every fault found."""
        faults = common_faults(self)
        if not isinstance(self.map_topic, str):
            faults.append(fault(self, 'map_topic', "is the name of a topic, or '' for none"))
        elif self.map and self.map_topic:
            faults.append(fault(self, 'map_topic', "is '' where map is given"))
        faults += range_faults(self, {'speed': (0.0, 100.0)})
        return faults + rate_faults(self, 'odom_rate')


def _scanners(given, faults) -> object:
    """ScannerConfigs of a list of mappings; what is wrong with them is added to `faults`."""
    if not isinstance(given, list):
        return given  # RobotConfig says what is allowed
    made = []
    for number, one in enumerate(given):
        try:
            made.append(filled(ScannerConfig, one))
        except ConfigError as error:
            faults += [f'scanners[{number}]: {sentence}' for sentence in error.faults]
    return tuple(made)


def made_robot(settings: RobotSettings, heard: World | None = None) -> SimulatedRobot:
    """The robot in its world: `heard` on the map's topic, else that of the map's file, with the obstacles. Raises
    WorldError, ObstacleError.
    """
    world = heard or (World.from_yaml(settings.map) if settings.map else World.empty())
    if settings.obstacles:
        found = course.load(settings.obstacles)
        if found.ramps or found.thresholds:
            raise ObstacleError(f'{settings.obstacles} has ramps or thresholds, but this robot drives on a level floor')
        found.put_on(world)
    return SimulatedRobot(world, settings.robot, settings.seed, settings.start)
