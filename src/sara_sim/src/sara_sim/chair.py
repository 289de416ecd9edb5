"""The simulated chair: true motion, sensors, and the programs of its three microcontrollers on one bus.

From outside it is a bus only: frames in by `receive`, frames out of `step`. The true pose is for tests and plots. Time is counted in
steps of 10 ms from 0.
"""

from __future__ import annotations

import heapq
from collections import Counter

import numpy as np
from canserial.frame import Frame

from sara_lowlevel.joystick_node import JoystickNode
from sara_lowlevel.motor_node import MotorNode
from sara_lowlevel.sensor_node import SensorNode
from sara_sim.config import ChairConfig, DrawnChair
from sara_sim.drive import Drive
from sara_sim.sensors import Imu, Sonars
from sara_sim.world import World

STEP_S = 0.01
STEPS_PER_S = 100


class SimulatedChair:
    """One chair, drawn from `seed`: the same seed and the same frames in give the same frames out.

    `time`: s. `chair`: what was drawn. `counts`: frames lost on the way. `joystick`: (x, y) raw axes, 512 is the centre; set it to drive by hand.
    """

    def __init__(self, world: World, seed: int, start: tuple[float, float, float] = (0.0, 0.0, 0.0), bus=None,
                 config: ChairConfig = ChairConfig()):
        """`start`: (x, y, yaw) in the map, m, rad. `bus`: canserial.bus.BusDescription, SARA's if None. Raises WorldError."""
        if bus is None:
            from canserial.bus import BusDescription
            bus = BusDescription.default()
        # A stream for each source: a change in one leaves the luck of the others alone.
        drawn, imu, sonar, bus_luck = (np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(4))
        self.config = config
        self.chair = DrawnChair.draw(config, drawn)
        self.drive = Drive(world, config, self.chair, start, STEP_S)
        self.motor, self.sensors, self.joystick_node = MotorNode(bus), SensorNode(bus), JoystickNode(bus)
        self.joystick = (512, 512)
        self.counts: Counter = Counter()
        self._imu = Imu(config, self.chair, imu, STEP_S)
        self._sonars = Sonars(world, config, sonar, lambda: (self.drive.x, self.drive.y, self.drive.yaw))
        self._random = bus_luck
        self._luck: list = []
        self._tick = 0
        self._order = 0
        self._incoming: list = []
        self._outgoing: list = []

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self._tick / STEPS_PER_S

    @property
    def pose(self) -> tuple[float, float, float]:
        """True (x, y, yaw) of `base_link` in the map: m, rad in (-pi, pi]."""
        return self.drive.pose

    @property
    def velocity(self) -> tuple[float, float]:
        """True (forward m/s, turn rad/s)."""
        return self.drive.speed, self.drive.yaw_rate

    @property
    def contacts(self) -> int:
        """How often the body came to touch a wall."""
        return self.drive.contacts

    def receive(self, frame: Frame) -> None:
        """Put a frame of the PC on the bus now. It is heard up to 10 ms later, or lost."""
        self._carry(self._incoming, frame)

    def step(self) -> list[Frame]:
        """Advance 10 ms. Returns the frames that arrive at the PC in it, in order, `time` being when (s)."""
        self._tick += 1
        now = self._tick / STEPS_PER_S
        while self._incoming and self._incoming[0][0] <= now:
            frame = heapq.heappop(self._incoming)[2]
            self.motor.receive(frame, now)
        drive = self.drive
        drive.step(*self.motor.target)
        sample = self._imu.sample(drive.acceleration, drive.speed, drive.yaw_rate, drive.yaw_acceleration)
        right, left = drive.steps()
        load = 0.05 * (abs(drive.right_speed) + abs(drive.left_speed))
        for frame in self.joystick_node.update(now, *self.joystick):
            self.motor.receive(frame, now)
            self._carry(self._outgoing, frame)
        for frame in self.motor.update(now, right, left, battery=self.config.battery - load):
            self.joystick_node.receive(frame, now)
            self._carry(self._outgoing, frame)
        for frame in self.sensors.update(now, *sample, self._sonars):
            self._carry(self._outgoing, frame)
        arrived = []
        while self._outgoing and self._outgoing[0][0] <= now:
            when, _, frame = heapq.heappop(self._outgoing)
            arrived.append(Frame(frame.id, frame.data, when, frame.extended))
        return arrived

    def _carry(self, queue: list, frame: Frame) -> None:
        """Hand a frame to the bus: it arrives after a random delay, or never."""
        if not self._luck:
            self._luck = self._random.random((256, 2)).tolist()
        delay, loss = self._luck.pop()
        if loss < self.config.frame_loss:
            self.counts['frames lost'] += 1
            return
        self._order += 1
        heapq.heappush(queue, (self.time + delay * self.config.frame_jitter, self._order, frame))
