"""Everything between a command and the wheels in one object: readings and commands in, at every step a Decision.

It keeps the stamps of what the SafetyGate watches and hands its verdicts on to the checks of plausibility. The safety
node and a simulation in lockstep use this same object.
"""

import math
from collections.abc import Sequence

from canserial.dbc.modes import PC_DRIVES
from sara_common.scans import Sweep
from sara_control.gate.comfort import Comfort, Profile
from sara_control.gate.gate_config import SafetyConfig
from sara_control.gate.plausibility import Plausibility
from sara_control.gate.safety import AHEAD, Command, Decision, Inputs, SafetyGate
from sara_control.zones.zones import Zones


class Guard:
    """config: SafetyConfig. All stamps in s on one clock. `dropped`: {kind: how often}."""

    def __init__(self, config: SafetyConfig) -> None:
        self.config = config
        self.comfort = Comfort(config.profiles[config.profile].commanded(config.turn_slip))
        self.zones = Zones(config.zones, config.caution, config.scan)
        self.gate = SafetyGate(config.gate, self.comfort, self.zones)
        self.plausibility = Plausibility(config.plausibility)
        self.profile = config.profile
        self._ranges = dict.fromkeys(self.zones.sensors, -math.inf)
        self._bus = self._localization = -math.inf
        self._impact = False
        self._turn_rate = 0.0  # rad/s, measured
        self._pc_drives = None if config.handshake else True
        self._source = ''
        self._command = None

    @property
    def rider(self) -> Profile:
        """The rider's limits, of the chair's own motion, asked for last."""
        return self.config.profiles[self.profile]

    @property
    def dropped(self) -> dict[str, int]:
        """{kind: how many readings were dropped}."""
        return self.plausibility.dropped

    @property
    def _by_hand(self):
        """Whether the chair's own joystick drives."""
        return self._pc_drives is False

    @property
    def _speed(self):
        """m/s: as commanded, which is known first; as the wheels roll where others command them."""
        return self.plausibility.rolling if self._by_hand else self.comfort.v

    def _drop(self, kind):
        self.dropped[kind] = self.dropped.get(kind, 0) + 1
        return False

    def on_command(self, t: float, v: float, w: float) -> bool:
        """The command (v m/s, w rad/s) came at t. False if it is not finite."""
        if not (math.isfinite(v) and math.isfinite(w)):
            return self._drop('command not finite')
        self._command = Command(v, w, t)
        return True

    def on_source(self, name: str) -> None:
        """Name of the source that commands from now on."""
        self._source = name

    def on_encoder(self, stamp: float, wheel: int, steps: int, time_100us: int) -> bool:
        """Counters of a wheel, see Plausibility. False if they are dropped."""
        self._bus = stamp
        before = self.plausibility.rolled
        valid = self.plausibility.on_encoder(stamp, wheel, steps, time_100us)
        if self.zones.scan is not None and self.plausibility.rolled is not before:
            self.zones.scan.reckoning.on_way(*self.plausibility.rolled)
        return valid

    def on_imu(self, stamp: float, rates: Sequence[float], frozen: bool = False) -> bool:
        """Angular velocity, 3 x rad/s, and whether the IMU says that it is no estimate. False if it is dropped."""
        self._bus = stamp
        valid = self.plausibility.on_imu(stamp, rates, frozen)
        if valid:
            self._turn_rate = rates[2]
            if self.zones.scan is not None:
                self.zones.scan.reckoning.on_turn(stamp, rates[2])
        return valid

    def on_range(self, stamp: float, name: str, distance: float) -> bool:
        """A range, see Zones. False if it is dropped."""
        self._bus = stamp
        if not self.zones.on_range(name, distance, stamp, self._speed, self._turn_rate):
            return self._drop('range not known or not possible')
        self._ranges[name] = stamp
        return True

    def on_raw_range(self, stamp: float, name: str, distance: float) -> bool:
        """A raw range, before any filter, see Zones. False if it is dropped."""
        moves = self.comfort.moving or self._by_hand
        if not self.zones.on_raw_range(name, distance, stamp, self._speed, self._turn_rate, moves):
            return self._drop('raw range not known or not possible')
        return True

    def on_scan(self, now: float, sweep: Sweep) -> bool:
        """A laser scan that came at now (s), see ScanZones. False if it is dropped, or there is no scanner."""
        if self.zones.scan is None:
            return self._drop('scan without a scanner')
        fault = self.zones.scan.on_scan(sweep, now)
        return self._drop(fault) if fault else True

    def on_mode(self, t: float, mode: int) -> None:
        """modoPC came at t: whether the chair obeys (PC_DRIVES)."""
        self._bus = t
        if self.config.handshake:
            self._pc_drives = mode in PC_DRIVES

    def on_impact(self, t: float, impact: bool) -> None:
        """Whether the chair feels an impact came at t."""
        self._bus = t
        self._impact = bool(impact)
        if impact:
            self.zones.caution.on_contact(t)

    def on_localization(self, stamp: float, *pose: float) -> bool:
        """A pose measured at stamp; False if it holds anything that is not finite."""
        if not all(map(math.isfinite, pose)):
            return self._drop('pose not finite')
        self._localization = stamp
        return True

    def on_emergency_stop(self, pressed: bool) -> None:
        """The emergency stop's button."""
        self.gate.emergency_stop(bool(pressed))

    def reset(self) -> tuple[bool, str]:
        """Release the emergency stop; (done, why in a sentence)."""
        return self.gate.reset(self._command, self._inputs())

    def set_profile(self, name: str) -> bool:
        """Another rider, from the next rest on. False if there is no such profile."""
        if name not in self.config.profiles:
            return False
        self.comfort.change(self.config.profiles[name].commanded(self.config.turn_slip))
        self.profile = name
        return True

    def late(self, t: float) -> bool:
        """Whether step(t) would stop the chair because something did not come in time."""
        return self.gate.late(t, self._command, self._inputs())

    def step(self, t: float, backlog: bool = False) -> Decision:
        """The Decision at t; to be called at a steady rate, and at once when something grave has come.

        backlog: as in SafetyGate.step.
        """
        command = self._command
        if command is not None and command.stamp > t + AHEAD:  # the clock was set back: silence begins now
            self._command = Command(command.v, command.w, t)
        self.zones.see(t)
        decision = self.gate.step(t, self._command, self._inputs(), backlog)
        self.plausibility.on_command(t, decision.v, decision.w, self._pc_drives is True)
        return decision

    def _inputs(self):
        watch, scan = self.plausibility, self.zones.scan
        return Inputs(
            self._bus,
            watch.encoder_stamp,
            watch.imu_stamp,
            min(self._ranges.values(), default=math.inf if scan is None else scan.stamp),
            self._localization,
            watch.fault,
            self._impact,
            self._pc_drives,
            self._source,
            watch.speed,
            watch.imu_frozen,
        )

    def missing(self, t: float) -> list[str]:
        """Names of watched inputs that have not come for a second at t, for the log."""
        gate, watch = self.config.gate, self.plausibility
        watched = [('encoders', watch.encoder_stamp, gate.encoder_timeout), ('imu', watch.imu_stamp, gate.imu_timeout)]
        watched += [(f'range {name}', stamp, gate.range_timeout) for name, stamp in self._ranges.items()]
        found = [name for name, stamp, timeout in watched if timeout and not -AHEAD <= t - stamp <= 1.0]
        return found + (['scan'] if self.zones.scan is not None and not self.zones.scan.live else [])
