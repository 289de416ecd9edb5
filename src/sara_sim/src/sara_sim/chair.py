"""The simulated chair: true motion, chips, and the programs of its three microcontrollers on one bus.

From outside it is a bus only: frames in by `receive`, frames out of `step`. The true pose is for tests and plots. Time
is counted in steps of 10 ms from 0; the chair has been switched on before that, long enough for its sensor node to have
calibrated, or just then.
"""

from __future__ import annotations

from collections import Counter
from functools import cached_property
from typing import Any

import numpy as np

from canserial.dbc.modes import MANUAL
from canserial.frame import Frame
from sara_common.planar import Pose2D
from sara_common.platforms import Platform, chosen
from sara_lowlevel.config import JoystickConfig, MotorConfig, SensorConfig
from sara_lowlevel.joystick.joystick_node import JoystickNode
from sara_lowlevel.motor.motor_node import MotorNode
from sara_lowlevel.sensor.sensor_node import SensorNode
from sara_sim.bus.wire import CandumpLog, Wire
from sara_sim.chips.encoders import Encoders
from sara_sim.chips.gps_config import GpsConfig
from sara_sim.chips.gps_receiver import GpsReceiver, Place
from sara_sim.chips.imu import Imu
from sara_sim.chips.magnetic_config import MagneticConfig
from sara_sim.chips.magnetism import Magnetism, Placement, Wheel
from sara_sim.chips.scanner import Scanner, optics_at
from sara_sim.chips.sensor_box import SensorBox
from sara_sim.chips.sonars import Sonars
from sara_sim.config import ChairConfig, DrawnChair
from sara_sim.motion.drive import Drive
from sara_sim.options import ChairOptions
from sara_sim.world import luck
from sara_sim.world.obstacles import Body
from sara_sim.world.world import World

STEP_S = 0.01
STEPS_PER_S = 100
SWITCHED_ON_S, LONGEST_CALIBRATION_S = 30, 120
LOAD_V = 0.05  # V per rad/s of each wheel


class ChairError(RuntimeError):
    """A chair that does not come up."""


class SimulatedChair:
    """One chair, drawn from `seed`: the same seed and the same frames in give the same frames out.

    `time`: s since the start. `chair`: what was drawn. `counts`: frames lost on the way. `joystick`: (x, y) raw axes,
    512 is the centre; set it to drive by hand. `assisted`: the rider's switch, by which the PC helps; of a bus that has
    this mode.
    `plugged`: False while the PC's adapter is pulled out. `battery`: V at rest. `faults`: add(name, **arguments),
    clear(), list().
    `scanner`: the laser scanner, beside the bus; None without the option `scan`.
    `magnetism`: the field at the magnetometer; None on a bus without its frame.
    `gps`: the GPS receiver, at a serial port of its own; None where there is none.
    `box`: the chips and their I2C bus. `sensors`, `motor`, `joystick_node`: the microcontrollers.
    """

    def __init__(
        self,
        world: World,
        seed: int,
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
        bus=None,
        config: ChairConfig | None = None,
        options: ChairOptions = ChairOptions(),
        sensors: SensorConfig | None = None,
        power_up: bool = False,
        platform: Platform | None = None,
        magnetic: MagneticConfig = MagneticConfig(),
        gps: GpsConfig | None = None,
    ):
        """`start`: (x, y, yaw) in the map, m, rad. `platform`: the robot, the chosen one if None; `bus`:
        canserial.dbc.bus.BusDescription, `config`, `sensors` (of the sensor node): the platform's if None. `magnetic`:
        the field, for a bus with the magnetometer's frame, and where on the earth the map is. `gps`: the receiver.

        `power_up`: time 0 is the switch-on; otherwise the sensor node's calibration is over by then. Raises WorldError.
        """
        platform = platform or chosen()
        if bus is None:
            from canserial.dbc.bus import BusDescription

            bus = BusDescription.of(platform)
        # A stream for each source: a change in one leaves the luck of the others alone.
        drawn, imu, sonar, bus_luck = (np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(4))
        self.platform, self.options, self.world = platform, options, world
        self.config = config = config or ChairConfig.of(platform)
        self.chair = DrawnChair.draw(config, drawn)
        world.obstacles.move_to(0.0)
        self.drive = Drive(world, config, self.chair, start, STEP_S, options)
        sensors = SensorConfig.of(platform, gravity=config.gravity) if sensors is None else sensors
        physics = Imu(config, self.chair, platform.imu, imu, STEP_S)
        acoustics = Sonars(world, config, platform.sonars, sonar, lambda: (self.drive.x, self.drive.y, self.drive.yaw))
        self.box = SensorBox(physics, acoustics, sensors, STEP_S)
        self.motor, self.sensors, self.joystick_node = (
            MotorNode(bus, MotorConfig.of(platform)),
            SensorNode(bus, self.box.i2c, sensors),
            JoystickNode(bus, JoystickConfig.of(platform)),
        )
        self.scanner = None
        if options.scan:
            self.scanner = Scanner(world, luck.stream(seed, 'scan'), start, STEP_S, optics_at(platform.scan))
        self.magnetism = self._magnetometer(magnetic, seed, platform.imu) if 'COMPASS' in bus.names else None
        self.gps: GpsReceiver | None = None
        if gps is not None:
            origin = Place(magnetic.latitude, magnetic.longitude)
            self.gps = GpsReceiver(gps, seed, origin, platform.gps, magnetic.date)
        self.joystick, self.assisted = (512, 512), False
        self.battery = config.battery
        self.encoders = Encoders()
        self.wire = Wire(bus_luck, config.frame_jitter, config.frame_loss)
        self.grabbed: tuple | None = None
        self.silent_nodes: frozenset = frozenset()
        self._plugged, self._pulled_out = True, False
        self._tick, self.time = 0, 0.0
        # The sensor node has a clock of its own, which started when it was switched on.
        self._sensor_tick = 0
        self.faulty = False  # whether any of `faults` is happening: they say so
        self._seed, self._identifier_of = seed, bus.id_of
        if not power_up:
            self._come_up()
            # A stick at rest: one that was held since the switch-on would not drive.
            centred = bus.encode('JOYSTICK', velD=0.0, velI=0.0, joyx=512, modo=MANUAL, joyy=512)
            self.motor.receive(centred, 0.0)

    def _come_up(self) -> None:
        """What happened since the switch-on, at rest: nobody listened yet."""
        box, node = self.box, self.sensors
        motion = self.drive.motion() if self.drive.drift.active else None
        now = 0.0
        while node.state != 'running' or now < SWITCHED_ON_S:
            self._sensor_tick += 1
            now = self._sensor_tick / STEPS_PER_S
            if now > LONGEST_CALIBRATION_S:
                raise ChairError(
                    f'the sensor node is {node.state} {LONGEST_CALIBRATION_S} s after its switch-on: {node.counts}'
                )
            if motion:
                box.step(now, motion)
            else:
                box.rest(now)
            node.update(now)

    @cached_property
    def faults(self) -> Any:
        """What is made to go wrong: fault_engine.Faults. Most chairs have none, and need not know their kinds."""
        from sara_sim.faults.fault_engine import Faults

        return Faults(self, self._seed, self._identifier_of)

    @property
    def pose(self) -> tuple[float, float, float]:
        """True (x, y, yaw) of `base_link` in the map: m, rad in (-pi, pi]."""
        return self.drive.pose

    @property
    def attitude(self) -> tuple[float, float]:
        """True (roll, pitch), rad: 0 on a level floor without a payload; a nose that points up is a negative pitch."""
        return self.drive.drift.roll, self.drive.drift.pitch

    @property
    def velocity(self) -> tuple[float, float]:
        """True (forward m/s, turn rad/s)."""
        return self.drive.speed, self.drive.yaw_rate

    def _magnetometer(self, magnetic: MagneticConfig, seed: int, imu: Pose2D) -> Magnetism:
        """Put the chip on the bus, in the IMU's box."""
        tilt = self.chair.roll, self.chair.pitch
        magnetism = Magnetism(magnetic, seed, (tilt, imu), self._placement, lambda: self.box.time)
        self.box.i2c.chips[magnetism.address] = magnetism.chip
        return magnetism

    def _placement(self) -> Placement:
        """Where the magnetometer feels it."""
        drive, target = self.drive, self.motor.target
        wheels = (drive.right_speed, target[0]), (drive.left_speed, target[1])
        lag = self.config.motor_lag
        right, left = (Wheel(speed, (wanted - speed) / lag) for speed, wanted in wheels)
        return Placement(drive.x, drive.y, *self.attitude, drive.yaw, right, left)

    def _body(self) -> Body:
        """Where pedestrians see it."""
        config = self.config
        return Body(*self.pose, 0.5 * config.length, 0.5 * config.width, *self.velocity)

    @property
    def contacts(self) -> int:
        """How often the body came to touch a wall or an obstacle."""
        return self.drive.contacts

    @property
    def counts(self) -> Counter:
        """Frames that were lost or changed on the way, by reason."""
        return self.wire.counts

    @property
    def plugged(self) -> bool:
        """Whether the PC's adapter is in: neither pulled out by hand (set this) nor by the fault adapter_unplugged."""
        return self.wire.plugged

    @plugged.setter
    def plugged(self, value: bool) -> None:
        self._plugged = bool(value)
        self.wire.plugged = self._plugged and not self._pulled_out

    @property
    def pulled_out(self) -> bool:
        """Whether a fault holds the adapter out."""
        return self._pulled_out

    @pulled_out.setter
    def pulled_out(self, value: bool) -> None:
        self._pulled_out = value
        self.wire.plugged = self._plugged and not value

    def calibrate(self) -> None:
        """Press the sensor node's push-button: it calibrates anew, which takes 30 s at rest."""
        self.sensors.recalibrate()

    def log(self, path: str) -> CandumpLog:
        """From now on write what passes the PC's adapter to a file as `candump -l` does; `close` it. Raises OSError."""
        if self.wire.log:
            self.wire.log.close()
        self.wire.log = CandumpLog(path)
        return self.wire.log

    def receive(self, frame: Frame) -> None:
        """Put a frame of the PC on the bus now. It is heard up to 10 ms later, or lost."""
        self.wire.receive(frame, self.time)

    def step(self) -> list[Frame]:
        """Advance 10 ms. Returns the frames that arrive at the PC in it, in order, `time` being when (s)."""
        self._tick += 1
        self._sensor_tick += 1
        now, sensor_now = self._tick / STEPS_PER_S, self._sensor_tick / STEPS_PER_S
        self.time = now
        wire, drive, box = self.wire, self.drive, self.box
        if self.faulty:
            self.faults.step(now)
        silent = self.silent_nodes
        motor = None if 'motor' in silent else self.motor
        for frame in wire.to_nodes(now):
            if motor is not None:
                motor.receive(frame, now)
        if self.world.obstacles.all:
            self.world.obstacles.step(now, self._body())
        drive.step(*(motor.target if motor is not None else (0.0, 0.0)))
        if drive.resting:
            box.rest(sensor_now)
        else:
            box.step(sensor_now, drive.motion())
        if 'joystick' not in silent:
            for frame in self.joystick_node.update(now, *(self.grabbed or self.joystick), assisted=self.assisted):
                if motor is not None:
                    motor.receive(frame, now)
                wire.send(frame, now)
        if motor is not None:
            right, left = self.encoders.read(*drive.steps())
            load = LOAD_V * (abs(drive.right_speed) + abs(drive.left_speed))
            for frame in motor.update(now, right, left, battery=self.battery - load):
                self.joystick_node.receive(frame, now)
                wire.send(frame, now)
        if 'sensor' not in silent:
            for frame in self.sensors.update(sensor_now):
                wire.send(frame, now)
        if self.scanner is not None:
            self.scanner.step(self.pose)
        if self.gps is not None:
            self.gps.step(self.pose, self.velocity, now)
        return wire.to_pc(now)
