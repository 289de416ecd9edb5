"""What config/hmi.yaml holds, checked: every limit of the server, in groups."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any

from sara_common.config import ConfigError, is_number, is_whole, range_faults
from sara_nav.goals.move_base_config import lost_limits_faults

LOOK, CARER, RIDER = 'look', 'carer', 'rider'
ROLES = (LOOK, CARER, RIDER)
LOCAL_ADDRESSES = ('127.0.0.1', 'localhost', '::1')


class Group:
    """A frozen dataclass that a mapping of parameters fills. RANGES: {name: (low, high)} of its numbers."""

    RANGES: Mapping[str, tuple[float, float]] = {}

    @classmethod
    def from_params(cls, params: object) -> Any:
        """From a mapping; raises ConfigError with every fault."""
        if not isinstance(params, Mapping):
            raise ConfigError(f'it is {params!r}, allowed is a mapping of parameters')
        known = {entry.name: entry for entry in fields(cls)}
        faults = [f'{name} is {params[name]!r}, but there is no such parameter' for name in params if name not in known]
        values = {name: params[name] for name in known if name in params}
        group = cls(**{name: tuple(value) if isinstance(value, list) else value for name, value in values.items()})
        faults += range_faults(group, cls.RANGES)
        for name in cls.RANGES:
            default = known[name].default
            if isinstance(default, int) and not is_whole(getattr(group, name)) and is_number(getattr(group, name)):
                faults.append(f'{name} is {getattr(group, name)!r}, allowed are whole numbers')
        faults += group.more_faults()
        if faults:
            raise ConfigError(faults)
        return group

    def more_faults(self) -> list[str]:
        """One sentence for each fault that is no number out of its range."""
        return []


@dataclass(frozen=True)
class NetworkConfig(Group):
    """Where the server listens and how many it serves; times in s."""

    RANGES = {
        'port': (0, 65535),
        'tls_port': (0, 65535),
        'connections': (1, 1000),
        'connections_per_address': (1, 1000),
        'strangers': (1, 1000),
        'hello_s': (0.1, 600.0),
        'heartbeat_s': (0.5, 600.0),
    }
    address: str = '127.0.0.1'
    port: int = 8080
    tls_port: int = 8443
    host_names: tuple = ()
    connections: int = 32
    connections_per_address: int = 16
    strangers: int = 8
    hello_s: float = 5.0
    heartbeat_s: float = 5.0

    @property
    def is_local(self) -> bool:
        """Whether nothing outside this computer is served."""
        return self.address in LOCAL_ADDRESSES

    def more_faults(self) -> list[str]:
        """Names that are none."""
        faults = []
        if not (isinstance(self.address, str) and self.address):
            faults.append(f'address is {self.address!r}, allowed is the name or number of one of this computer')
        if not all(isinstance(name, str) and name for name in self.host_names):
            faults.append(f'host_names is {list(self.host_names)!r}, allowed is a list of names')
        return faults


@dataclass(frozen=True)
class LimitsConfig(Group):
    """What one connection may do."""

    RANGES = {
        'frame_bytes': (256, 1_000_000),
        'frames_per_s': (25.0, 10_000.0),
        'frames_burst': (10, 100_000),
        'faults': (1, 1_000_000),
        'faults_per_s': (0.0, 1000.0),
        'urgent_frames': (16, 100_000),
        'unsent_bytes': (1024, 10_000_000),
    }
    frame_bytes: int = 4096
    frames_per_s: float = 60.0
    frames_burst: int = 300
    faults: int = 40
    faults_per_s: float = 0.2
    urgent_frames: int = 256
    unsent_bytes: int = 16384


@dataclass(frozen=True)
class FreshnessConfig(Group):
    """How old a command may be; all in s."""

    RANGES = {
        'beat_s': (0.01, 0.2),
        'oldest_s': (0.05, 1.0),
        'repeat_s': (0.01, 0.2),
        'hold_s': (0.05, 0.45),
        'lift_s': (0.1, 60.0),
    }
    beat_s: float = 0.05
    oldest_s: float = 0.2
    repeat_s: float = 0.05
    hold_s: float = 0.125
    lift_s: float = 0.5


@dataclass(frozen=True)
class SessionsConfig(Group):
    """Who is who. local_role: of who opens the page on this computer."""

    RANGES = {'ask_s': (1.0, 600.0)}
    local_role: str = RIDER
    ask_s: float = 15.0

    def more_faults(self) -> list[str]:
        """A role that is none."""
        return (
            [] if self.local_role in ROLES else [f'local_role is {self.local_role!r}, allowed are {", ".join(ROLES)}']
        )


@dataclass(frozen=True)
class PairingConfig(Group):
    """How devices are paired; times in s, but for token_days. first_role: of the code that is printed at start."""

    RANGES = {
        'code_s': (10.0, 86400.0),
        'attempts': (1, 100),
        'pause_s': (0.0, 86400.0),
        'tokens': (1, 10_000),
        'token_days': (1, 3650),
    }
    code_s: float = 300.0
    attempts: int = 5
    pause_s: float = 60.0
    tokens: int = 32
    token_days: int = 90
    first_role: str = RIDER

    def more_faults(self) -> list[str]:
        """A role that is none."""
        return (
            [] if self.first_role in ROLES else [f'first_role is {self.first_role!r}, allowed are {", ".join(ROLES)}']
        )


@dataclass(frozen=True)
class RobotConfig(Group):
    """The robot: places file, frames, and the limits (m/s, rad/s) that are taken where no safety gate has its own."""

    RANGES = {
        'settle_s': (0.0, 10.0),
        'state_hz': (1.0, 50.0),
        'ranges_hz': (0.5, 50.0),
        'plan_hz': (0.1, 50.0),
        'history': (1, 1000),
        'lost_limit': (0.0, 1.0),
        'found_limit': (0.0, 1.0),
    }
    places: str = ''
    base_frame: str = 'base_link'
    map_frame: str = 'map'
    profiles: Mapping = field(
        default_factory=lambda: {'standard': dict(max_forward=0.4, max_reverse=0.2, max_turn=0.6)}
    )
    profile: str = 'standard'
    body: tuple = (1.0, 0.6)
    range_topics: tuple = ()
    settle_s: float = 0.7
    state_hz: float = 10.0
    ranges_hz: float = 5.0
    plan_hz: float = 2.0
    history: int = 20
    speech: bool = True
    lost_limit: float = 0.5
    found_limit: float = 0.2

    def more_faults(self) -> list[str]:
        """Names, switches and profiles."""
        faults = [
            f'{name} is {getattr(self, name)!r}, allowed is a name'
            for name in ('places', 'base_frame', 'map_frame', 'profile')
            if not isinstance(getattr(self, name), str)
        ]
        if not (
            isinstance(self.body, tuple) and len(self.body) == 2 and all(is_number(v) and v > 0 for v in self.body)
        ):
            faults.append(f'body is {self.body!r}, allowed are two numbers above 0: length and width, m')
        if not all(isinstance(topic, str) and topic for topic in self.range_topics):
            faults.append(f'range_topics is {list(self.range_topics)!r}, allowed is a list of names of topics')
        if not isinstance(self.speech, bool):
            faults.append(f'speech is {self.speech!r}, allowed are true and false')
        faults += profile_faults(self.profiles)
        faults += lost_limits_faults(self)
        if not faults and self.profile not in self.profiles:
            faults.append(f'profile is {self.profile!r}, allowed are {", ".join(self.profiles)}')
        return faults


@dataclass(frozen=True)
class RosbridgeConfig(Group):
    """The rosbridge endpoint and its allow-lists: names, in which * stands for anything."""

    RANGES = {
        'frame_bytes': (256, 100_000_000),
        'queue': (1, 1000),
        'subscriptions': (1, 1000),
        'service_s': (0.1, 600.0),
    }
    enabled: bool = False
    publish: tuple = ()
    subscribe: tuple = ()
    call: tuple = ()
    params: tuple = ()
    origins: tuple = ()
    frame_bytes: int = 1_000_000
    queue: int = 10
    subscriptions: int = 50
    service_s: float = 10.0

    def more_faults(self) -> list[str]:
        """Lists that hold no names."""
        faults = [
            f'{name} is {getattr(self, name)!r}, allowed is a list of names'
            for name in ('publish', 'subscribe', 'call', 'params', 'origins')
            if not all(isinstance(held, str) and held for held in getattr(self, name))
        ]
        if not isinstance(self.enabled, bool):
            faults.append(f'enabled is {self.enabled!r}, allowed are true and false')
        return faults


def profile_faults(profiles: object) -> list[str]:
    """One sentence for each speed profile that has no three limits above 0."""
    names = ('max_forward', 'max_reverse', 'max_turn')
    if not isinstance(profiles, Mapping) or not profiles:
        return [f'profiles is {profiles!r}, allowed is NAME: {{max_forward, max_reverse, max_turn}}']
    return [
        f'profiles/{profile} is {limits!r}, allowed are numbers above 0 for {", ".join(names)}'
        for profile, limits in profiles.items()
        if not (
            isinstance(limits, Mapping) and all(is_number(limits.get(name)) and limits[name] > 0.0 for name in names)
        )
    ]


@dataclass(frozen=True)
class HmiConfig:
    """All groups."""

    network: NetworkConfig = NetworkConfig()
    limits: LimitsConfig = LimitsConfig()
    freshness: FreshnessConfig = FreshnessConfig()
    sessions: SessionsConfig = SessionsConfig()
    pairing: PairingConfig = PairingConfig()
    robot: RobotConfig = RobotConfig()
    rosbridge: RosbridgeConfig = RosbridgeConfig()

    @classmethod
    def from_params(cls, params: Mapping) -> HmiConfig:
        """From the node's private parameters; raises ConfigError with every fault of every group."""
        faults, groups = [], {}
        kinds = {entry.name: type(entry.default) for entry in fields(cls) if entry.default is not MISSING}
        for name in params:
            if name not in kinds:
                faults.append(f'{name} is {params[name]!r}, but there is no such parameter')
        for name, kind in kinds.items():
            try:
                groups[name] = kind.from_params(params.get(name, {}))
            except ConfigError as error:
                faults += [f'{name}/{fault}' for fault in error.faults]
        if faults:
            raise ConfigError(faults)
        return cls(**groups)
