"""The whole system in one process: the simulated chair, its bus, and the very objects that the nodes run, on one clock.

Frames pass as CAN frames, encoded and decoded by the code that serves the real bus; configuration is the nodes' own
YAML. A step is 10 ms. Nothing here waits or asks for the time, so that a seed gives the same drive to the last digit.
"""

from __future__ import annotations

from pathlib import Path

from canserial.dbc.bus import BusDescription
from canserial.reader.config import ReaderConfig
from canserial.reader.reader import Reader
from canserial.reader.readings import ImuReading, RangeReading
from sara_bringup.lockstep.command_chain import CommandChain
from sara_bringup.lockstep.localization import Filter, Truth
from sara_bringup.lockstep.ranges import RangeFeeds, mountings
from sara_bringup.lockstep.scans import ScanFeeds
from sara_common.files import merged
from sara_common.planar import Pose2D, compose
from sara_common.platforms import Platform, chosen, parameters
from sara_control.gate.reasons import sentence
from sara_lowlevel.config import FAST_IMU, SensorConfig
from sara_nav.config.parameters import Parameters
from sara_nav.goals.move_base_config import ACTIVE, IDLE
from sara_nav.maps import map_io
from sara_nav.move_base.settings import read_settings
from sara_sim.chair import STEP_S, SimulatedChair
from sara_sim.options import ChairOptions
from sara_sim.world.world import World

COMMAND_STEPS = 2  # 50 Hz: wheel commands
FILTER_STEPS = 2  # 50 Hz: ekf_se
LOST_TOPIC = 'lost_probability'
START_TIMEOUT_S = 120.0  # the gyro's calibration and more must be over by then


class LockstepError(RuntimeError):
    """The chair did not come up."""


class Lockstep:
    """The chair and the stack, stepped together.

    `world`: a ROS map's path, a map, or a sara_sim World whose map is `known`. `start`: (x, y, yaw), m, rad. `seed`:
    which chair. `ekf`: name of an ekf_*.yaml. `gain`: of this chair's gyro, as in its calibration file; None: read.py's
    own. `localization`: "ekf", "ukf", or "fake" for the true pose. `navigation`: a tree laid over sara_nav.yaml's.
    `ranges`: whether the fused pose is corrected by what the sonars hear of the map; as in sara.launch, None: with the
    default set alone. `imu_period`: s between the IMU's frames, 0.05 or 0.2. `scan`: whether the chair has the laser
    scanner, for gate and costmaps. `dbc`: the bus, as canserial names it; None: the robot's own. `platform`: the robot;
    None: the chosen one. `known`: the stack's map, in the world's frame; None: the world itself.
    """

    def __init__(
        self,
        world: Path | str | map_io.GridMap | World,
        start: tuple[float, float, float],
        seed: int,
        ekf: str = 'default',
        gain: float | None = None,
        localization: str = 'ekf',
        navigation: dict | None = None,
        ranges: bool | None = None,
        imu_period: float = FAST_IMU,
        scan: bool = False,
        dbc: str | None = None,
        platform: Platform | None = None,
        known: map_io.GridMap | None = None,
    ) -> None:
        self.platform = platform = platform or chosen()
        bus = BusDescription.named(dbc, platform) if dbc else BusDescription.of(platform)
        if isinstance(world, World) and known is None:
            raise ValueError('a World has no map: say what the stack knows of it')
        if not isinstance(world, World):
            grid = world if isinstance(world, map_io.GridMap) else map_io.load_map(str(world))
            world, known = world_of(grid), known or grid
        sensors = SensorConfig.of(platform, imu_period=imu_period)
        self.chair = SimulatedChair(
            world, seed, start, bus, options=ChairOptions(scan=scan), sensors=sensors, platform=platform
        )
        reader = parameters('canserial', 'read.yaml', platform)
        if gain is not None:
            reader['gain'] = gain
        self.reader = Reader(
            ReaderConfig(**{key: value for key, value in reader.items() if key in ReaderConfig.__dataclass_fields__}),
            bus,
        )
        self.reader.set_yaw(start[2], 0.0)
        self.wheels = CommandChain(bus, platform, scan)
        if localization == 'fake':
            self.localization = Truth(lambda: self.chair.pose)
        else:
            self.localization = Filter(start, localization, ekf, self.reader.config.variances)
        tree = parameters('sara_nav', 'sara_nav.yaml', platform)
        tree = merged(tree, parameters('sara_nav', 'scan.yaml')) if scan else tree
        corrected = localization != 'fake' and (ekf == 'default' if ranges is None else ranges)
        tree = merged(tree, {'lost_topic': LOST_TOPIC}) if corrected else tree
        settings = read_settings(Parameters(merged(tree, navigation or {})))
        if corrected:
            from sara_bringup.lockstep.corrected import Corrected  # the squares are driven without

            self.localization = Corrected(
                self.localization, known, (self.reader.config.range_min, self.reader.config.range_max), platform
            )
        self.move_base = settings.make_move_base(known)
        self.ranges = RangeFeeds(self.move_base, self.reader.config, mountings(platform))
        self.scans = None
        if scan:
            at, optics = mountings(platform)['scan'], self.chair.scanner.optics
            self.scans = ScanFeeds(self.move_base, self.wheels.guard, optics, at)
        self._control_steps = round(1.0 / (settings.move_base.controller_frequency * STEP_S))
        self.tick = 0  # steps so far
        self.navigation_runs = True  # False: as if move_base had been killed
        self.localization_runs = True  # False: as if ekf_se had been killed
        self.pilot = None  # called with the time instead of move_base; gives (v, w), m/s and rad/s, or None
        self.odometry = (0.0, 0.0, 0.0)  # of odom -> base_link
        self._odometry_stamp = None
        self._composed = None, None, None  # of what the pose in the map was made last, and that pose
        self.last_ranges: dict[str, float] = {}  # {ultrasonic sensor: its newest range, m}
        self.newest = None  # move_base's newest StepResult
        self.result = None  # the newest that ended a goal

    @property
    def fused(self) -> tuple[float, float, float] | None:
        """(x, y, yaw) in the map as localization has it, None before it is known."""
        return self.localization.pose

    @property
    def local_pose(self) -> tuple[float, float, float] | None:
        """(x, y, yaw) of base_link in the local costmap's frame, map or odom; None before it is known."""
        return self.odometry if self.ranges.local_frame == 'odom' else self._map_pose()

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self.chair.time

    def step(self) -> None:
        """Advance everything by 10 ms."""
        self.tick += 1
        frames, now = self.chair.step(), self.chair.time
        self._hear(frames)
        if self.scans is not None:
            self.scans.step(now, self.chair.scanner.scan)
        if self.tick % FILTER_STEPS == 0 and self.localization_runs:
            self._localize(now)
        if self.tick % self._control_steps == 0 and self.navigation_runs:
            self._navigate(now)
        if self.tick % COMMAND_STEPS == 0:
            self._command(now)

    def _hear(self, frames):
        for frame in frames:
            for reading in self.reader.on_frame(frame):
                self._on_reading(reading)

    def _command(self, now):
        self.chair.receive(self.wheels.step(now))
        self._give_up(now)

    def start_up(self) -> None:
        """Step, at rest, until the gyro is calibrated, the fused pose is there and the safety gate would let the chair
        drive. Raises LockstepError.
        """
        while not (self.localization.map_from_odom and self.wheels.ready):
            if self.time > START_TIMEOUT_S:
                raise LockstepError(
                    f'the chair is not ready after {START_TIMEOUT_S:.0f} s: '
                    f'{sentence(self.wheels.decision.state, self.wheels.decision.reason)}'
                )
            self.step()

    def _on_reading(self, reading):
        state = self.wheels.on_reading(reading, self.chair.time)
        if state is not None:
            self._on_odometry(state)
        kind = type(reading)
        if kind is RangeReading:
            self.last_ranges[reading.name] = reading.range
            self.localization.on_range(reading)
            self.ranges.add(reading, self._map_pose(), self.odometry)
        elif kind is ImuReading:
            self.localization.on_imu(reading)

    def _on_odometry(self, state):
        self.odometry, self._odometry_stamp = (state.x, state.y, state.heading), state.stamp
        self.localization.on_odometry(state)
        if self.scans is not None:
            self.scans.on_odometry(state.stamp, self.odometry, self.localization.map_from_odom)

    def _localize(self, now):
        localization = self.localization
        if localization.step(now):
            self.wheels.guard.on_localization(localization.stamp, *localization.pose)
        lost, config = localization.lost_probability, self.move_base.config
        if lost is not None:
            self.move_base.lost.hear(lost, now, config.lost_limit, config.found_limit)

    def _map_pose(self):
        """map -> base_link as tf has it: map -> odom of the localization, odom -> base_link of the wheels; None before
        both are known.
        """
        map_from_odom, odometry = self.localization.map_from_odom, self.odometry
        if map_from_odom is None or self._odometry_stamp is None:
            return None
        known_from, known_to, pose = self._composed
        if known_from is not map_from_odom or known_to is not odometry:  # the sonars of a frame ask for the same
            pose = compose(map_from_odom, odometry)
            self._composed = map_from_odom, odometry, pose
        return pose

    def _give_up(self, now):
        """As move_base's `~abort`, `~wait` and `cancel`."""
        wheels = self.wheels
        if wheels.decision.waits:
            self.move_base.excuse_standing()
        if wheels.cancel:
            self.move_base.cancel(now, wheels.cancel)
        if wheels.abort:
            self.move_base.abort(f'Goal aborted: {wheels.abort}')
        wheels.cancel = wheels.abort = ''

    def _navigate(self, now):
        if self.pilot is not None:
            command = self.pilot(now)
            if command is not None:
                self.wheels.on_navigation(*command, now)
            return
        pose = None if (there := self._map_pose()) is None else Pose2D(*there)
        local_pose = Pose2D(*self.odometry) if self.ranges.local_frame == 'odom' else None
        result = self.newest = self.move_base.step(
            now, pose, self.localization.velocity, self._odometry_stamp, local_pose
        )
        if result.status == ACTIVE:
            self.wheels.on_navigation(*result.command, now)
        elif result.status != IDLE:
            self.wheels.on_navigation(0.0, 0.0, now)
            self.result = result


def world_of(grid: map_io.GridMap) -> World:
    """The simulator's World in which a map_io.GridMap is true."""
    geometry = grid.geometry
    return World(map_io.occupied(grid.data), geometry.resolution, (geometry.origin_x, geometry.origin_y))
