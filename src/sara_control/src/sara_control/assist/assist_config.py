"""Parameters of shared control."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sara_common.config import ConfigError, filled, range_faults
from sara_common.platforms import OfPlatform, Platform


@dataclass(frozen=True)
class AssistConfig(OfPlatform):
    """m, s, m/s, rad/s. Names of the laws: see shared_control.

    enabled: whether it helps. sources: whose commands are assisted. length, width: of the body, centred on base_link;
    they must be given. horizon: s of driving that is looked ahead, within nearest_look and farthest_look (m). margin:
    the body comes no nearer to an obstacle. ahead: m more that its way keeps free where it drives to: there the safety
    gate stops. clear: m; nearer than that, room counts. beside: m; what is on one side only is kept so far off. help: 0
    to 1, how much room is minded over the wish. braking: m/s2, before what cannot be passed. steady_time: s over which
    a stick that trembles is averaged. veer_time: s; who drove so short a time ago and turns in place veers, where room
    is short. insist: share of the greatest deflection, and insist_time: s, from which on a rider who keeps to a
    direction is left alone until the stick is centred. max_linear, max_angular: m/s, rad/s at the greatest deflection.
    override_time: s that an override lasts. grid_timeout: s after which a grid is too old to be used. turn_slip: turn
    rate commanded over turn rate driven. latency: s until a command takes effect.
    """

    enabled: bool = True
    sources: tuple = ('joystick', 'touch', 'keyboard')
    length: float = 0.0
    width: float = 0.0
    horizon: float = 6.0
    nearest_look: float = 0.8
    farthest_look: float = 2.1
    margin: float = 0.04
    ahead: float = 0.2
    clear: float = 0.4
    beside: float = 0.3
    help: float = 0.65
    braking: float = 0.3
    steady_time: float = 0.25
    veer_time: float = 0.0
    insist: float = 0.95
    insist_time: float = 1.0
    max_linear: float = 0.4
    max_angular: float = 0.6
    override_time: float = 20.0
    grid_timeout: float = 1.0
    turn_slip: float = 1.0
    latency: float = 0.2

    def __post_init__(self):
        faults = range_faults(self, LIMITS)
        if not isinstance(self.enabled, bool):
            faults.append(f'enabled is {self.enabled!r}, allowed are true and false')
        if not isinstance(self.sources, (list, tuple)) or not all(isinstance(name, str) for name in self.sources):
            faults.append(f'sources is {self.sources!r}, allowed is a list of names of sources')
        if not faults and self.nearest_look > self.farthest_look:
            faults.append(
                f'nearest_look is {self.nearest_look!r}, allowed is at most farthest_look ({self.farthest_look!r})'
            )
        if not faults and self.margin >= self.clear:
            faults.append(f'margin is {self.margin!r}, allowed is less than clear ({self.clear!r})')
        if faults:
            raise ConfigError(faults)

    @classmethod
    def known_of(cls, platform: Platform) -> dict[str, Any]:
        """Its body."""
        return dict(zip(('length', 'width'), platform.size))

    @classmethod
    def from_params(cls, params: object) -> AssistConfig:
        """From a dictionary. Raises ConfigError with every fault."""
        return filled(cls, params)


LIMITS = {
    'length': (0.0, 5.0, True),
    'width': (0.0, 5.0, True),
    'horizon': (0.5, 10.0),
    'nearest_look': (0.2, 3.0),
    'farthest_look': (0.2, 3.0),
    'margin': (0.0, 0.5),
    'ahead': (0.0, 1.0),
    'clear': (0.05, 1.0),
    'beside': (0.0, 1.0),
    'help': (0.0, 1.0),
    'braking': (0.0, 2.0, True),
    'steady_time': (0.0, 2.0),
    'veer_time': (0.0, 10.0),
    'insist': (0.5, 1.0),
    'insist_time': (0.2, 10.0),
    'max_linear': (0.0, 5.0, True),
    'max_angular': (0.0, 5.0, True),
    'override_time': (0.0, 120.0),
    'grid_timeout': (0.1, 10.0),
    'turn_slip': (1.0, 2.0),
    'latency': (0.0, 1.0),
}
