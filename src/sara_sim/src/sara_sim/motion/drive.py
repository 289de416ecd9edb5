"""Two driven wheels on a floor: motor lag, slip in turns, walls and obstacles that stop the body.

The laws of wheels and body are in `rolling.py`. What else moves the body (castors, ramps, a push: `drift.py`) is
added to them; docs/simulator.md has the rest of the model.
"""

from __future__ import annotations

from math import exp, floor, pi

from sara_common.planar import wrap
from sara_sim.config import ChairConfig, DrawnChair
from sara_sim.motion import rolling
from sara_sim.motion.body_motion import Motion
from sara_sim.motion.drift import Drift
from sara_sim.motion.rolling import Contact, Motor, Surroundings
from sara_sim.options import ChairOptions
from sara_sim.world.world import World, WorldError

# A chair that creeps against a wall touches it once: a new contact needs this long without one, s.
CONTACT_RELEASE_S = 0.5
_BISECTIONS = 6


class Drive:
    """True state of the chair. `x`, `y` (m), `yaw` (rad, unwrapped) in the map; `right`, `left` wheel angles (rad).

    `drift`: what else moves the body.
    """

    def __init__(
        self,
        world: World,
        config: ChairConfig,
        chair: DrawnChair,
        start: tuple[float, float, float],
        dt: float,
        options: ChairOptions = ChairOptions(),
    ):
        """`start`: (x, y, yaw) m, rad. Raises WorldError where the chair would stand in a wall or an obstacle."""
        rolling.warm()  # here and not in the middle of a drive
        self.world, self.config, self.dt, self.options = world, config, dt, options
        self._grip = (1.0, 1.0)
        self.chair = chair
        self.x, self.y, self.yaw = (float(value) for value in start)
        if not world.has_room(self.x, self.y, self.yaw, config.length, config.width):
            raise WorldError(f'start is {tuple(start)!r} but the chair would stand in a wall or an obstacle there.')
        self.right = self.left = 0.0
        self.right_speed = self.left_speed = 0.0
        self.speed = self.yaw_rate = 0.0
        self.acceleration = self.yaw_acceleration = 0.0
        self.contacts = 0
        self.touching = False
        self._since_touch = CONTACT_RELEASE_S
        lag = config.motor_lag * (options.mass + options.payload) / options.mass
        self._edges = config.steps_per_turn / (2.0 * pi)
        self._motor = Motor(float(config.dead_band), float(config.max_wheel_speed), dt, lag, exp(-dt / lag))
        self._surroundings = Surroundings(world.clear_of(config.length, config.width), *world.origin, world.resolution)
        self.drift = Drift(world, config, options, lag, self.pose)

    @property
    def chair(self) -> DrawnChair:
        """What the wheels of this one chair are like; it may be exchanged."""
        return self._chair

    @chair.setter
    def chair(self, value: DrawnChair) -> None:
        self._chair = value
        self._touch_down()

    @property
    def grip(self) -> tuple[float, float]:
        """(right, left): the share of a wheel's rolling that moves the body; 1 unless a fault says less."""
        return self._grip

    @grip.setter
    def grip(self, value: tuple[float, float]) -> None:
        self._grip = value
        self._touch_down()

    def _touch_down(self) -> None:
        """What the wheels roll on follows from the chair and the grip."""
        radii = self._chair.right_radius * self._grip[0], self._chair.left_radius * self._grip[1]
        self._contact = Contact(*radii, self._chair.slip, self.config.track)

    @property
    def pose(self) -> tuple[float, float, float]:
        """(x, y, yaw), yaw in [-pi, pi)."""
        return self.x, self.y, wrap(self.yaw)

    @property
    def resting(self) -> bool:
        """True when nothing moves, tilts or shakes the body."""
        return not (self.speed or self.yaw_rate or self.acceleration or self.yaw_acceleration or self.drift.active)

    def step(self, right_target: float, left_target: float) -> None:
        """Move on by `dt` towards the given wheel speeds (rad/s)."""
        if self.drift.active or self.world.obstacles.all or not self._rolled(right_target, left_target):
            self._pushed_on(right_target, left_target)

    def _rolled(self, right_target: float, left_target: float) -> bool:
        """The step where nothing but the wheels moves the chair and only walls could stop it; False, and nothing done,
        where one does.
        """
        pose, (right, left), speeds, motion, near = rolling.roll(
            (self.x, self.y, self.yaw),
            ((float(right_target), self.right_speed), (float(left_target), self.left_speed)),
            (self.speed, self.yaw_rate),
            self._contact,
            self._motor,
            self._surroundings,
        )
        if near and self.world.overlaps(*pose, self.config.length, self.config.width):
            return False
        self._since_touch += self.dt
        self.touching = False
        self.x, self.y, self.yaw = pose
        self.right += right
        self.left += left
        self.right_speed, self.left_speed = speeds
        self.speed, self.yaw_rate, self.acceleration, self.yaw_acceleration = motion
        return True

    def _pushed_on(self, right_target: float, left_target: float) -> None:
        """The step with all that may move or stop the chair."""
        drift, contact = self.drift, self._contact
        right, right_speed = self._wheel(right_target, self.right_speed)
        left, left_speed = self._wheel(left_target, self.left_speed)
        distance, turn = rolling.body(right, left, contact)
        side = 0.0
        if drift.active:
            distance, side, turn = drift.displaced(distance, turn, self.speed, self.yaw_rate, self.dt)
        crowded = bool(self.world.obstacles.all)
        moved = self._moved(distance, side, turn)
        touched = crowded and bool(self._met(self.x, self.y, self.yaw).any())
        if (distance or turn or side) and not self._free(*moved):
            touched = True
            fraction = self._free_fraction(distance, side, turn)
            moved = self._moved(fraction * distance, fraction * side, fraction * turn)
            # The wall stalls the wheels: they turn no further than the body moves.
            right, left = fraction * right, fraction * left
            right_speed = left_speed = 0.0
            drift.stop()
        if touched:
            if self._since_touch >= CONTACT_RELEASE_S - 1e-9:
                self.contacts += 1
                drift.collide(self.speed)
            self._since_touch = 0.0
        else:
            self._since_touch += self.dt
        self.touching = touched
        self.x, self.y, self.yaw = moved
        self.right += right
        self.left += left
        self.right_speed, self.left_speed = right_speed, left_speed
        speed, rate = rolling.body(right_speed, left_speed, contact)
        if drift.active:
            speed, rate = drift.velocity(speed, rate)
            drift.lean(self.x, self.y, self.yaw, self.dt)
        self.acceleration = (speed - self.speed) / self.dt
        self.yaw_acceleration = (rate - self.yaw_rate) / self.dt
        self.speed, self.yaw_rate = speed, rate

    def motion(self) -> Motion:
        """What an IMU feels of it."""
        drift = self.drift
        if not drift.active:
            return Motion(self.acceleration, self.speed * self.yaw_rate, self.yaw_rate, self.yaw_acceleration)
        # In the chair's own axes: a moving chair that turns is accelerated towards the inside of the turn.
        shake = drift.shaken
        return Motion(
            self.acceleration + shake[0] - drift.side_speed * self.yaw_rate,
            self.speed * self.yaw_rate + drift.side_acceleration,
            self.yaw_rate,
            self.yaw_acceleration,
            drift.roll,
            drift.pitch,
            drift.roll_rate,
            drift.pitch_rate,
            shake[1],
        )

    def _wheel(self, target: float, speed: float) -> tuple[float, float]:
        """(angle turned in dt, speed after it)."""
        droop = float(self.drift.droop)
        return rolling.wheel(float(target), float(speed), droop, self._motor)

    def _moved(self, distance: float, side: float, turn: float) -> tuple[float, float, float]:
        return rolling.moved((self.x, self.y, self.yaw), float(distance), float(side), float(turn))

    def _free_fraction(self, distance: float, side: float, turn: float) -> float:
        """How much of a movement that walls or obstacles do not allow as a whole they allow, by bisection."""
        low, high = 0.0, 1.0
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            if self._free(*self._moved(middle * distance, middle * side, middle * turn)):
                low = middle
            else:
                high = middle
        return low

    def _free(self, x: float, y: float, yaw: float) -> bool:
        config = self.config
        return self.world.may_move((self.x, self.y, self.yaw), (x, y, yaw), config.length, config.width)

    def _met(self, x: float, y: float, yaw: float):
        return self.world.meets(x, y, yaw, self.config.length, self.config.width)

    def steps(self) -> tuple[int, int]:
        """Encoder edges (right, left): whole ones, counted on from the counters at the start."""
        return floor(self.right * self._edges) + self.options.right_steps, floor(
            self.left * self._edges
        ) + self.options.left_steps
