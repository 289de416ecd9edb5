"""Makes faults happen to a chair, for as long as they last.

Whenever a fault comes or goes, every place that faults may touch is put right, and the faults that remain are applied
again: so they end without traces and may overlap. Each fault has a random stream of its own, made from the chair's
seed, the fault's name and how
many of that name there were before it: one fault more does not change the luck of the others.
"""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np

from sara_sim.chips.magnetism import Magnetism
from sara_sim.faults import faults as kinds
from sara_sim.faults.faults import Fault, FaultError, build
from sara_sim.world import luck


class Active:
    """A fault that is happening: `until` (s), its own `random`, and what it must remember."""

    def __init__(self, fault: Fault, now: float, random: np.random.Generator):
        self.fault, self.since, self.until, self.random = fault, now, now + fault.duration, random
        self.memory: dict = {}

    def __str__(self) -> str:
        given = ', '.join(
            f'{each.name} {value}'
            for each in fields(self.fault)
            if (value := getattr(self.fault, each.name)) not in (math.inf, ()) and each.name != 'duration'
        )
        ends = '' if self.until == math.inf else f' until {self.until:.2f} s'
        return f'{self.fault.name}{f" ({given})" if given else ""}{ends}'


class Faults:
    """The faults of one chair: `chair.faults`."""

    def __init__(self, chair, seed: int, identifier_of):
        """`identifier_of`: the identifier of a frame's name (raises ValueError)."""
        self._chair, self._seed, self._identifier_of = chair, seed, identifier_of
        self._number: dict[str, int] = {}
        self._all: list[Active] = []
        self.active = False

    def add(self, name: str, **arguments) -> Active:
        """Make the fault `name` happen from now on. Raises FaultError that names every wrong argument."""
        fault = build(name, arguments)
        self._identifiers(fault)
        if isinstance(fault, (kinds.ScanSilent, kinds.ScanFrozen)) and self._chair.scanner is None:
            raise FaultError(f'{name}: this chair has no laser scanner; its option scan is false.')
        if isinstance(fault, kinds.COMPASS) and self._chair.magnetism is None:
            raise FaultError(f'{name}: this chair has no magnetometer; its bus is without +compass.')
        if isinstance(fault, kinds.SonarFault) and fault.sensor not in (*self._chair.box.sonars, 'all'):
            known = ', '.join((*self._chair.box.sonars, 'all'))
            raise FaultError(f'{name}: sensor is {fault.sensor!r}, allowed is one of {known}')
        number = self._number[name] = self._number.get(name, -1) + 1
        stream = luck.stream(self._seed, name, number)
        active = Active(fault, self._chair.time, stream)
        self._all.append(active)
        if isinstance(fault, kinds.Push):
            self._chair.drive.drift.push(fault.forward, fault.left, fault.turn, fault.duration)
        self._apply()
        return active

    def clear(self, name: str | None = None) -> int:
        """End all faults, or those of one name; returns how many. Raises FaultError for a name that is no fault's."""
        if name is not None and name not in kinds.FAULTS:
            raise FaultError(f'there is no fault {name!r}; there are {", ".join(kinds.FAULTS)}.')
        kept = [active for active in self._all if name is not None and active.fault.name != name]
        gone = [active for active in self._all if active not in kept]
        if any(isinstance(active.fault, kinds.Push) for active in gone):
            self._chair.drive.drift.stop()
        self._all = kept
        self._apply()
        return len(gone)

    def list(self) -> list[str]:
        """The faults that are happening, in words."""
        return [str(active) for active in self._all]

    def step(self, now: float) -> None:
        """What changes with time. Call it before each step while `active`. `now`: s."""
        if any(active.until <= now + 1e-9 for active in self._all):
            self._all = [active for active in self._all if active.until > now + 1e-9]
            self._apply()
        chair = self._chair
        grip = [1.0, 1.0]
        for active in self._all:
            fault = active.fault
            if isinstance(fault, kinds.WheelSlip):
                self._slip(fault, grip)
            elif isinstance(fault, kinds.BatteryLow):
                before = active.memory.setdefault('before', chair.battery)
                share = min((now - active.since) / fault.ramp, 1.0) if fault.ramp else 1.0
                chair.battery = before + share * (fault.voltage - before)
        chair.drive.grip = tuple(grip)

    def _slip(self, fault: kinds.WheelSlip, grip: list[float]) -> None:
        drive = self._chair.drive
        half = 0.5 * drive.config.track
        for index, (wheel, side) in enumerate((('right', -half), ('left', half))):
            x, y = drive.x - side * math.sin(drive.yaw), drive.y + side * math.cos(drive.yaw)
            if fault.wheel in (wheel, 'both') and (
                fault.radius == math.inf or math.hypot(x - fault.x, y - fault.y) <= fault.radius
            ):
                grip[index] *= fault.factor

    def _identifiers(self, fault: Fault) -> frozenset | None:
        if not isinstance(fault, kinds.FrameFault) or not fault.ids:
            return None
        try:
            return frozenset(self._identifier_of(each) if isinstance(each, str) else each for each in fault.ids)
        except ValueError as error:
            raise FaultError(f'{fault.name}: ids is {fault.ids!r} but {error}.') from error

    def _apply(self) -> None:
        """Put everything right, then apply what is happening."""
        self.active = self._chair.faulty = bool(self._all)
        self._apply_to_bus()
        self._apply_to_sonars()
        self._apply_to_imu()
        self._apply_to_encoders()
        self._apply_to_drive()
        if self._chair.scanner is not None:
            self._chair.scanner.silent = self._any(kinds.ScanSilent)
            self._chair.scanner.frozen = self._any(kinds.ScanFrozen)
        if self._chair.magnetism is not None:
            self._apply_to_compass(self._chair.magnetism)

    def _apply_to_bus(self) -> None:
        chair = self._chair
        chair.wire.faults = [
            (active.fault, self._identifiers(active.fault), active.random) for active in self._of(kinds.FrameFault)
        ]
        chair.pulled_out = self._any(kinds.AdapterUnplugged)
        chair.silent_nodes = frozenset(active.fault.node for active in self._of(kinds.NodeSilent))

    def _apply_to_sonars(self) -> None:
        box = self._chair.box
        for name, chip in box.sonars.items():
            mine = [active for active in self._of(kinds.SonarFault) if active.fault.sensor in (name, 'all')]
            chip.silent = any(isinstance(active.fault, kinds.SonarSilent) for active in mine)
            stuck = [active.fault.range for active in mine if isinstance(active.fault, kinds.SonarStuck)]
            chip.stuck_cm = round(100.0 * stuck[-1]) if stuck else None
            noisy = [
                (active.random, active.fault.sigma) for active in mine if isinstance(active.fault, kinds.SonarNoisy)
            ]
            box.acoustics.extra.pop(name, None)
            if noisy:
                box.acoustics.extra[name] = lambda noisy=noisy: sum(
                    float(random.normal(0.0, sigma)) for random, sigma in noisy
                )

    def _apply_to_imu(self) -> None:
        box = self._chair.box
        box.imu.silent, box.imu.stuck = self._any(kinds.ImuSilent), self._any(kinds.ImuStuck)
        box.noise = [
            (active.random, active.fault.accel_sigma, active.fault.gyro_sigma) for active in self._of(kinds.ImuNoisy)
        ]

    def _apply_to_compass(self, magnetism: Magnetism) -> None:
        chip = magnetism.chip
        chip.silent, chip.stuck = self._any(kinds.CompassSilent), self._any(kinds.CompassStuck)
        magnets = [active.fault for active in self._of(kinds.CompassMagnet)]
        magnetism.magnet = sum(magnet.x for magnet in magnets), sum(magnet.y for magnet in magnets), 0.0

    def _apply_to_encoders(self) -> None:
        encoders = self._chair.encoders
        frozen = [active.fault.wheel for active in self._of(kinds.EncoderFrozen)]
        encoders.frozen = frozenset(wheel for wheel in ('right', 'left') if wheel in frozen or 'both' in frozen)
        encoders.noise = [
            (active.random, active.fault.wheel, active.fault.sigma) for active in self._of(kinds.EncoderNoisy)
        ]

    def _apply_to_drive(self) -> None:
        """What pulls the joystick, the battery and the wheels' grip."""
        chair = self._chair
        grabbed = [(active.fault.x, active.fault.y) for active in self._of(kinds.JoystickGrabbed)]
        chair.grabbed = grabbed[-1] if grabbed else None
        if not self._any(kinds.BatteryLow):
            chair.battery = chair.config.battery
        if not self._any(kinds.WheelSlip):
            chair.drive.grip = (1.0, 1.0)

    def _of(self, kind: type) -> list[Active]:
        return [active for active in self._all if isinstance(active.fault, kind)]

    def _any(self, kind: type) -> bool:
        return bool(self._of(kind))
