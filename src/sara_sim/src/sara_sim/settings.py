"""Parameters of the simulator node, checked before anything starts."""

from __future__ import annotations

import math
from dataclasses import dataclass


class SettingsError(ValueError):
    """Parameters that are not allowed, one sentence for each."""


@dataclass(frozen=True)
class SimulatorSettings:
    """`map`: YAML file, '' for an empty floor. `start`: x, y (m), yaw (rad) in the map. `speed`: simulated seconds per second."""

    map: str = ''
    start: tuple = (0.0, 0.0, 0.0)
    seed: int = 0
    speed: float = 1.0
    port: str = '/tmp/sara_can'

    @classmethod
    def from_params(cls, params: dict) -> SimulatorSettings:
        """From the node's private parameters. Raises SettingsError that names every fault, unknown names included."""
        known = dict.fromkeys(cls.__dataclass_fields__)
        faults = [f'{name} is not a parameter of the simulator (there are {", ".join(known)}).' for name in params if name not in known]
        values = {name: params[name] for name in known if name in params}
        if 'start' in values and isinstance(values['start'], (list, tuple)):
            values['start'] = tuple(values['start'])
        settings = cls(**values)
        faults += settings.validate()
        if faults:
            raise SettingsError(' '.join(faults))
        return settings

    def validate(self) -> list[str]:
        """One sentence for every fault found."""
        faults = []
        if not isinstance(self.map, str):
            faults.append(f"map is {self.map!r} but must be the path of a map's YAML file, or '' for an empty floor.")
        if not (isinstance(self.start, tuple) and len(self.start) == 3 and all(map(_number, self.start))):
            faults.append(f'start is {self.start!r} but must be [x, y, yaw], finite numbers in m and rad.')
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            faults.append(f'seed is {self.seed!r} but must be a whole number, 0 or more.')
        if not _number(self.speed) or not 0 < self.speed <= 100:
            faults.append(f'speed is {self.speed!r} but must be above 0 and at most 100 times real time.')
        if not isinstance(self.port, str) or not self.port.startswith('/'):
            faults.append(f'port is {self.port!r} but must be an absolute path.')
        return faults


def _number(value) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
