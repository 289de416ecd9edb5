"""Settings of the safety gate and of what it holds for plausible, checked all at once."""

from dataclasses import dataclass
from typing import Any

from sara_common.config import ConfigError, filled, is_number, number_faults
from sara_common.platforms import OfPlatform, Platform
from sara_control.gate.comfort import read_profiles
from sara_control.zones.caution import CautionConfig
from sara_control.zones.scan_config import ScanConfig
from sara_control.zones.zone_config import ZoneConfig


@dataclass(frozen=True)
class GateConfig:
    """Times in s; with a timeout of 0 an input is not watched. Decelerations in m/s2 and rad/s2.

    command_timeout: then the chair slows down gently; command_hard_timeout: then it brakes hard and needs a fresh
    command. wheels_timeout: after so long without a step of the gate the wheels brake by themselves; 0: they do not.
    fresh_silence: pause after which the next command is a fresh one. localization_for: sources that need to know where
    the chair is. rest_speed: m/s.
    """

    emergency_braking: float = 1.5
    emergency_turn_braking: float = 3.0
    command_timeout: float = 0.25
    command_hard_timeout: float = 0.45
    wheels_timeout: float = 0.25
    fresh_silence: float = 1.0
    bus_timeout: float = 0.25
    encoder_timeout: float = 0.25
    imu_timeout: float = 0.45
    range_timeout: float = 0.5
    localization_timeout: float = 0.5
    localization_for: tuple = ('navigation',)
    rest_speed: float = 0.05

    def __post_init__(self):
        faults = number_faults(
            self,
            above_0=(
                'emergency_braking',
                'emergency_turn_braking',
                'command_timeout',
                'command_hard_timeout',
                'fresh_silence',
                'rest_speed',
            ),
        )
        for name in (
            'wheels_timeout',
            'bus_timeout',
            'encoder_timeout',
            'imu_timeout',
            'range_timeout',
            'localization_timeout',
        ):
            if not (is_number(getattr(self, name)) and getattr(self, name) >= 0):
                faults.append(
                    f'{name} is {getattr(self, name)!r}, allowed are numbers above 0, and 0 for what is not there'
                )
        if not isinstance(self.localization_for, (list, tuple)) or not all(
            isinstance(name, str) for name in self.localization_for
        ):
            faults.append(f'localization_for is {self.localization_for!r}, allowed is a list of names of sources')
        if not faults and not self.command_timeout <= self.command_hard_timeout <= self.fresh_silence:
            faults.append(
                f'command_hard_timeout is {self.command_hard_timeout!r}, allowed are numbers between command_timeout '
                f'({self.command_timeout!r}) and fresh_silence ({self.fresh_silence!r})'
            )
        if faults:
            raise ConfigError(faults)


@dataclass(frozen=True)
class PlausibilityConfig(OfPlatform):
    """Geometry in m, which must be given: 0 is none. max_wheel_speed: rad/s, no wheel turns faster.

    frozen_distance: m of rim that one wheel may miss while the other turns, twice that if both stand. runaway_speed:
    m/s of rim that a wheel may differ from its command. turn_difference: rad/s between IMU and wheels. max_turn_rate:
    rad/s, no IMU can measure more. Readings in a row that make a fault: runaway_readings, turn_readings.
    """

    wheel_radius: float = 0.0
    wheel_separation: float = 0.0
    steps_per_turn: int = 0
    max_wheel_speed: float = 0.0
    frozen_distance: float = 0.01
    runaway_speed: float = 0.4
    runaway_readings: int = 3
    turn_difference: float = 0.6
    turn_readings: int = 3
    max_turn_rate: float = 4.4

    def __post_init__(self):
        faults = number_faults(
            self,
            above_0=(
                'wheel_radius',
                'wheel_separation',
                'max_wheel_speed',
                'frozen_distance',
                'runaway_speed',
                'turn_difference',
                'max_turn_rate',
            ),
        )
        for name in ('steps_per_turn', 'runaway_readings', 'turn_readings'):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < 1:
                faults.append(f'{name} is {value!r}, allowed are whole numbers of 1 or more')
        if faults:
            raise ConfigError(faults)

    @classmethod
    def known_of(cls, platform: Platform) -> dict[str, Any]:
        """Its wheels."""
        return platform.parameters('safety_gate')['plausibility']


@dataclass(frozen=True)
class SafetyConfig:
    """All that the safety gate's YAML holds. rate: Hz. profiles: {name: Profile}; profile: the one in use at start.

    turn_slip: turn rate commanded over turn rate driven, 1 for a base that turns as it is told to. handshake: whether
    the robot reports who drives, on `mode`. cancel_topics: where goals are given up.
    """

    gate: GateConfig
    plausibility: PlausibilityConfig
    zones: ZoneConfig
    caution: CautionConfig
    scan: ScanConfig
    profiles: dict
    profile: str
    rate: float = 50.0
    handshake: bool = True
    cancel_topics: tuple = ()
    turn_slip: float = 1.0

    @classmethod
    def from_params(cls, params: dict) -> 'SafetyConfig':
        """From the dictionary of config/safety.yaml. Raises ConfigError with every fault."""
        faults, parts = [], {}
        own = ('rate', 'profile', 'handshake', 'cancel_topics', 'turn_slip')
        for name, read in (
            ('gate', lambda values: filled(GateConfig, values)),
            ('zones', ZoneConfig.from_params),
            ('plausibility', lambda values: filled(PlausibilityConfig, values)),
            ('caution', lambda values: filled(CautionConfig, values)),
            ('scan', ScanConfig.from_params),
            ('profiles', read_profiles),
        ):
            try:
                parts[name] = read(params.get(name, {}))
            except ConfigError as error:
                faults.append(str(error))
        faults += [
            f'{name} is {params[name]!r}, but there is no such parameter'
            for name in params
            if name not in own and name not in ('gate', 'zones', 'plausibility', 'caution', 'scan', 'profiles')
        ]
        profile, rate = params.get('profile', 'standard'), params.get('rate', cls.rate)
        handshake, cancel = params.get('handshake', True), params.get('cancel_topics', [])
        turn_slip = params.get('turn_slip', cls.turn_slip)
        names = list(parts.get('profiles', [profile]))
        if not isinstance(profile, str) or profile not in names:
            faults.append(f'profile is {profile!r}, allowed are {", ".join(map(str, names))}')
        if not (is_number(rate) and 10 <= rate <= 200):
            faults.append(f'rate is {rate!r}, allowed are numbers from 10 to 200')
        if not (is_number(turn_slip) and 1.0 <= turn_slip <= 2.0):
            faults.append(f'turn_slip is {turn_slip!r}, allowed are numbers from 1 to 2')
        if not isinstance(handshake, bool):
            faults.append(f'handshake is {handshake!r}, allowed are true and false')
        if not isinstance(cancel, (list, tuple)) or not all(isinstance(topic, str) and topic for topic in cancel):
            faults.append(f'cancel_topics is {cancel!r}, allowed is a list of names of topics')
        faults = faults or _unwatched(parts['gate'], parts['zones'], parts['scan'])
        if faults:
            raise ConfigError(faults)
        return cls(
            **parts,
            profile=profile,
            rate=float(rate),
            handshake=handshake,
            cancel_topics=tuple(cancel),
            turn_slip=float(turn_slip),
        )


def _unwatched(gate, zones, scan):
    """A sentence for each timeout of 0 of what a laser scanner needs, or of it itself where it is alone."""
    if not scan.enabled:
        return []
    faults = [
        f'gate/{name} is 0, but scan/enabled is true: scans are placed by wheels and turn rates'
        for name in ('encoder_timeout', 'imu_timeout')
        if not getattr(gate, name)
    ]
    if not zones.sensors and not gate.range_timeout:
        faults.append('gate/range_timeout is 0, but scan/enabled is true: without zones/sensors it watches the scanner')
    return faults
