"""Parameters of the simulator node, checked before anything starts."""

from __future__ import annotations

from dataclasses import dataclass, fields

from sara_common.config import ConfigError, fault, filled, is_number, is_whole
from sara_sim.bus.lawicel import RATES
from sara_sim.chips.gps_config import GpsConfig
from sara_sim.chips.magnetic_config import MagneticConfig
from sara_sim.options import ChairOptions


class SettingsError(ValueError):
    """Parameters that are not allowed, one sentence for each."""


@dataclass(frozen=True)
class SimulatorSettings:
    """Of the node; those of ChairOptions are parameters too.

    `platform`: the robot, '' for the chosen one. `map`: YAML file, '' for an empty floor. `obstacles`: YAML file, ''
    for none. `start`: x, y (m), yaw (rad) in the map. `speed`: simulated seconds per second. `port`: where the link to
    the pseudo-terminal is made. `bitrate`: of the bus, bit/s. `dbc`: the bus's description, a name that canserial knows
    or a path, '' for the platform's. `assisted`: the rider's switch for shared control, of a bus that has it.
    `power_up`: begin with the switch-on. `calibrate`: whether the sensor node does. `fast`: IMU frames every 50 ms, not
    as the robot's are at first. `madgwick`: whether its angles are sent. `log`: file for a log in the format of
    candump, '' for none. `magnetic`: a mapping of MagneticConfig's fields, for a bus with the compass, and where the
    map is. `gps_port`: where a GPS receiver's port is made, '' for no receiver; `gps`: a mapping of GpsConfig's fields.
    """

    platform: str = ''
    map: str = ''
    obstacles: str = ''
    start: tuple = (0.0, 0.0, 0.0)
    seed: int = 0
    speed: float = 1.0
    port: str = '/tmp/sara_can'
    bitrate: int = 500000
    dbc: str = ''
    assisted: bool = False
    power_up: bool = False
    calibrate: bool = True
    fast: bool = True
    madgwick: bool = True
    log: str = ''
    options: ChairOptions = ChairOptions()
    magnetic: MagneticConfig = MagneticConfig()
    gps_port: str = ''
    gps: GpsConfig = GpsConfig()

    @classmethod
    def from_params(cls, params: dict) -> SimulatorSettings:
        """From the node's private parameters. Raises SettingsError that names every fault, unknown names included."""
        mappings = {'magnetic': MagneticConfig, 'gps': GpsConfig}
        known = [field.name for field in fields(cls) if field.name not in ('options', *mappings)]
        optional = [field.name for field in fields(ChairOptions)]
        faults = [
            f'{name} is not a parameter of the simulator (there are {", ".join([*known, *mappings, *optional])}).'
            for name in params
            if name not in known and name not in (*optional, *mappings)
        ]
        values = {name: params[name] for name in known if name in params}
        if 'start' in values and isinstance(values['start'], (list, tuple)):
            values['start'] = tuple(values['start'])
        try:
            values['options'] = ChairOptions(**{name: params[name] for name in optional if name in params})
        except ConfigError as error:
            faults.append(str(error))
        for name, kind in mappings.items():
            try:
                values[name] = filled(kind, params.get(name, {}))
            except ConfigError as error:
                faults += [f'{name}: {sentence}' for sentence in error.faults]
        settings = cls(**values)
        faults += settings.validate()
        if faults:
            raise SettingsError('; '.join(faults))
        return settings

    def validate(self) -> list[str]:
        """One sentence for every fault found."""
        faults = common_faults(self)
        if not isinstance(self.log, str):
            faults.append(f"log is {self.log!r}, allowed is the path of a file for the log, or '' for none")
        if not isinstance(self.dbc, str):
            faults.append(
                f"dbc is {self.dbc!r}, allowed is the name of a bus, the path of a DBC file, or '' for the robot's"
            )
        if not isinstance(self.platform, str):
            faults.append(f"platform is {self.platform!r}, allowed is the name of a robot, or '' for the chosen one")
        if not is_number(self.speed) or not 0 < self.speed <= 100:
            faults.append(f'speed is {self.speed!r}, allowed are numbers above 0 to 100, times real time')
        if not isinstance(self.port, str) or not self.port.startswith('/'):
            faults.append(f'port is {self.port!r}, allowed is an absolute path')
        if not isinstance(self.gps_port, str) or not self.gps_port.startswith('/') and self.gps_port:
            faults.append(f"gps_port is {self.gps_port!r}, allowed is an absolute path, or '' for no receiver")
        if isinstance(self.bitrate, bool) or self.bitrate not in RATES:
            faults.append(f'bitrate is {self.bitrate!r}, allowed are {", ".join(map(str, RATES))}')
        faults += [
            f'{name} is {getattr(self, name)!r}, allowed are true and false'
            for name in ('assisted', 'power_up', 'calibrate', 'fast', 'madgwick')
            if not isinstance(getattr(self, name), bool)
        ]
        return faults


def common_faults(settings: object) -> list[str]:
    """A sentence for each of map, obstacles, start and seed that is not allowed."""
    faults = []
    for name, what in (
        ('map', "a map's YAML file, or '' for an empty floor"),
        ('obstacles', "a YAML file of obstacles, or '' for none"),
    ):
        if not isinstance(getattr(settings, name), str):
            faults.append(fault(settings, name, f'is the path of {what}'))
    start = settings.start
    if not (isinstance(start, tuple) and len(start) == 3 and all(map(is_number, start))):
        faults.append(fault(settings, 'start', 'is [x, y, yaw], finite numbers in m and rad'))
    if not is_whole(settings.seed, 0):
        faults.append(fault(settings, 'seed', 'are whole numbers of 0 or more'))
    return faults
