"""The simulator node's chair and world, as its settings say."""

from __future__ import annotations

from canserial.dbc.bus import BusDescription, BusError
from canserial.dbc.modes import has_assisted
from sara_common.platforms import chosen, load
from sara_lowlevel.config import FAST_IMU, SensorConfig
from sara_sim.chair import SimulatedChair
from sara_sim.pedestrians import course
from sara_sim.ros.settings import SimulatorSettings
from sara_sim.world.world import World


def make_chair(settings: SimulatorSettings) -> SimulatedChair:
    """The chair and its world. Raises WorldError, ObstacleError, BusError, ConfigError, OSError."""
    world = World.from_yaml(settings.map) if settings.map else World.empty()
    if settings.obstacles:
        course.load(settings.obstacles).put_on(world)
    platform = load(settings.platform) if settings.platform else chosen()
    fast = {'imu_period': FAST_IMU} if settings.fast else {}
    sensors = SensorConfig.of(platform, calibrate=settings.calibrate, madgwick=settings.madgwick, **fast)
    bus = BusDescription.named(settings.dbc, platform) if settings.dbc else BusDescription.of(platform)
    if settings.assisted and not has_assisted(bus):
        raise BusError(f'assisted is true, but the bus {bus.path} has no such mode')
    chair = SimulatedChair(
        world,
        settings.seed,
        settings.start,
        bus,
        options=settings.options,
        sensors=sensors,
        power_up=settings.power_up,
        platform=platform,
        magnetic=settings.magnetic,
        gps=settings.gps if settings.gps_port else None,
    )
    chair.assisted = settings.assisted
    if settings.log:
        chair.log(settings.log)
    return chair
