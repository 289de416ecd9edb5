"""The simulated chair explores a map with its nine ultrasonic sensors alone, in lockstep: slam_sonar draws the map as
the chair drives, `explore` chooses where to by what the sensors would hear, move_base drives there by that map.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from canserial.reader.readings import FIELD_OF_VIEW, RangeReading
from sara_bringup.lockstep.localization import Estimate
from sara_bringup.lockstep.ranges import mountings
from sara_common.files import merged
from sara_common.planar import compose
from sara_common.platforms import chosen, parameters
from sara_lab.studies.explored import Exploration
from sara_lab.studies.sonar_trial import Made, made_by
from sara_lab.studies.wandering import Ear, Recording
from sara_nav.planners.planning import path_length
from sara_slam.exploring.orders import State
from sara_slam.exploring.survey import Survey
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.sonar_slam import SonarSlam
from sara_slam.sonar.walls_ahead import WALLS_S, same

LIMIT_S = 1200.0
"""s that an exploration may take, the way home with them."""
INTERVAL_S, REST = 5.0, 0.01
"""Between two maps: s, and s for each s since it began, as the node rests on a computer that draws a map of 20 minutes
in 1.7 s.
"""


class SonarMapping(Estimate):
    """Localization by the map that is being made, as mapping.launch scan:=false has it. `ear`: tells the odometry;
    `slam`: the map builder.
    """

    def __init__(self, ear: Ear, slam: SonarSlam) -> None:
        super().__init__()
        self.ear, self.slam = ear, slam
        self.on_imu, self.on_odometry = ear.on_imu, ear.on_odometry
        self._mounts = mountings(chosen())

    def on_range(self, reading: RangeReading) -> None:
        """A canserial RangeReading."""
        self.ear.on_range(reading)
        self.slam.on_range(reading.stamp, reading.name, self._mounts[reading.name], reading.range)

    def step(self, now: float) -> bool:
        """See Filter."""
        known = self.ear
        if not known.step(now):
            return False
        self.slam.on_pose(known.stamp, known.pose)
        offset = self.slam.map_from_odom
        self.pose, self.velocity, self.stamp = compose(offset, known.pose), known.velocity, known.stamp
        self.map_from_odom = known.map_from_odom and compose(offset, known.map_from_odom)
        return True


class SonarExplored(NamedTuple):
    """What came of an exploration: what was heard, the map, all sentences, the state that it ended in, s that it took,
    m that it ended off from where it began, and how often the body touched something.
    """

    drive: Recording
    made: Made
    said: list[str]
    state: State
    seconds: float
    off_home: float
    contacts: int


class SonarExploration(Exploration):
    """See Exploration."""

    scan = False
    _looked_at, _walls = -math.inf, None

    def _navigation(self):
        return merged(super()._navigation(), parameters('sara_bringup', 'sonar_mapping_nav.yaml'))

    def _mapping(self, reckoned):
        return SonarMapping(Ear(reckoned, self.lockstep.chair), SonarSlam(SonarConfig.of()))

    def _chooser(self, config):
        self.survey = survey = Survey(config.range_reach, self.lockstep.move_base.global_costmap.free_margin)
        for name, mount in mountings(chosen()).items():
            if name != 'scan':
                survey.add_sensor(mount, FIELD_OF_VIEW)
        return survey

    def _step(self):
        super()._step()
        now = self.lockstep.time
        if now - self._looked_at < WALLS_S - 1e-9:
            return
        self._looked_at, before, self._walls = now, self._walls, self.slam.walls_ahead()
        if not same(before, self._walls):
            machine = self.lockstep.move_base
            for costmap in (machine.global_costmap, machine.local_costmap):
                costmap.keepout_layers['walls'].set_mask(self._walls)

    def _explore(self):
        self.survey.on_obstacles(self.lockstep.move_base.global_costmap.costmap)
        super()._explore()

    def _draw(self):
        now, heard = self.lockstep.time, len(self.slam.kept)
        if heard > self._drawn and now - self._drawn_at >= max(INTERVAL_S, REST * now):
            self._drawn, self._drawn_at = heard, now
            snapshot = self.slam.snapshot()
            solved = snapshot.solved()
            grid, doorways = snapshot.drawn(solved)
            self._take(grid)
            self.slam.settle(solved, doorways)

    def explored(self, name: str, say: Callable[[str], None] | None = None) -> SonarExplored:
        """Explore to the end. say: called with each sentence."""
        seconds = self.drive(say=say)
        ear, slam, chair = self.known.ear, self.slam, self.lockstep.chair
        poses = np.array(ear.poses)
        drive = Recording(poses, np.array(ear.ranges), tuple(ear.sensors), path_length(poses[:, 5:7]))
        made, _ = made_by(slam, drive, name)
        return SonarExplored(drive, made, self.said, self.explorer.state, seconds, self.off_home, chair.contacts)


def explored(name: str, number: int, limit: float = LIMIT_S) -> SonarExplored:
    """Exploration `number` on a map, s long at most: the seed of chair and start."""
    return SonarExploration(name, number, {'return_by': limit}).explored(name)
