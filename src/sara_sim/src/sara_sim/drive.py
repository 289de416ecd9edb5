"""Two driven wheels on a floor: motor lag, slip in turns, walls that stop the body.

Wheel speed follows its target with a first-order lag, integrated exactly over a step:
    angle = target dt + (w0 - target) tau (1 - exp(-dt / tau)).
The body moves along the arc the wheels describe, with the turn shortened by the slip:
    ds = (Rr dr + Rl dl) / 2,    dyaw = slip (Rr dr - Rl dl) / track.
"""

from __future__ import annotations

from math import cos, exp, pi, sin

from sara_sim.config import ChairConfig, DrawnChair
from sara_sim.rays import wrap
from sara_sim.world import World, WorldError

# A chair that creeps against a wall touches it once: a new contact needs this long without one, s.
CONTACT_RELEASE_S = 0.5
_BISECTIONS = 6


class Drive:
    """True state of the chair. `x`, `y` (m), `yaw` (rad, unwrapped) in the map; `right`, `left` wheel angles (rad)."""

    def __init__(self, world: World, config: ChairConfig, chair: DrawnChair, start: tuple[float, float, float], dt: float):
        """`start`: (x, y, yaw) m, rad. Raises WorldError where the chair would stand in a wall."""
        self.world, self.config, self.chair, self.dt = world, config, chair, dt
        self.x, self.y, self.yaw = (float(value) for value in start)
        if world.overlaps(self.x, self.y, self.yaw, config.length, config.width):
            raise WorldError(f'start is {tuple(start)!r} but the chair would stand in a wall there.')
        self.right = self.left = 0.0
        self.right_speed = self.left_speed = 0.0
        self.speed = self.yaw_rate = 0.0
        self.acceleration = self.yaw_acceleration = 0.0
        self.contacts = 0
        self.touching = False
        self._since_touch = CONTACT_RELEASE_S
        self._decay = exp(-dt / config.motor_lag)

    @property
    def pose(self) -> tuple[float, float, float]:
        """(x, y, yaw), yaw in (-pi, pi]."""
        return self.x, self.y, wrap(self.yaw)

    def step(self, right_target: float, left_target: float) -> None:
        """Move on by `dt` towards the given wheel speeds (rad/s)."""
        right, right_speed = self._wheel(right_target, self.right_speed)
        left, left_speed = self._wheel(left_target, self.left_speed)
        chair = self.chair
        distance = 0.5 * (chair.right_radius * right + chair.left_radius * left)
        turn = chair.slip * (chair.right_radius * right - chair.left_radius * left) / self.config.track
        fraction = self._free_fraction(distance, turn) if distance or turn else 1.0
        self.touching = fraction < 1.0
        if self.touching:
            # The wall stalls the wheels: they turn no further than the body moves.
            right, left, distance, turn = (fraction * value for value in (right, left, distance, turn))
            right_speed = left_speed = 0.0
            if self._since_touch >= CONTACT_RELEASE_S - 1e-9:
                self.contacts += 1
            self._since_touch = 0.0
        else:
            self._since_touch += self.dt
        self.x, self.y, self.yaw = self._moved(distance, turn)
        self.right += right
        self.left += left
        self.right_speed, self.left_speed = right_speed, left_speed
        self._set_velocity(right_speed, left_speed)

    def _wheel(self, target: float, speed: float) -> tuple[float, float]:
        """(angle turned in dt, speed after it)."""
        limit = self.config.max_wheel_speed
        target = 0.0 if abs(target) < self.config.dead_band else min(max(target, -limit), limit)
        if target == 0.0 and abs(speed) < 1e-6:
            return 0.0, 0.0
        error = speed - target
        return target * self.dt + error * self.config.motor_lag * (1.0 - self._decay), target + error * self._decay

    def _set_velocity(self, right_speed: float, left_speed: float) -> None:
        chair = self.chair
        speed = 0.5 * (chair.right_radius * right_speed + chair.left_radius * left_speed)
        rate = chair.slip * (chair.right_radius * right_speed - chair.left_radius * left_speed) / self.config.track
        self.acceleration = (speed - self.speed) / self.dt
        self.yaw_acceleration = (rate - self.yaw_rate) / self.dt
        self.speed, self.yaw_rate = speed, rate

    def _moved(self, distance: float, turn: float) -> tuple[float, float, float]:
        """The pose after an arc: its chord points along the middle heading and is shorter by sin(turn/2) / (turn/2)."""
        half = 0.5 * turn
        chord = distance * (sin(half) / half if abs(half) > 1e-9 else 1.0)
        return self.x + chord * cos(self.yaw + half), self.y + chord * sin(self.yaw + half), self.yaw + turn

    def _free_fraction(self, distance: float, turn: float) -> float:
        """How much of the movement the walls allow: 1, or less by bisection."""
        if self._free(distance, turn):
            return 1.0
        low, high = 0.0, 1.0
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            if self._free(middle * distance, middle * turn):
                low = middle
            else:
                high = middle
        return low

    def _free(self, distance: float, turn: float) -> bool:
        return not self.world.overlaps(*self._moved(distance, turn), self.config.length, self.config.width)

    def steps(self) -> tuple[int, int]:
        """Encoder edges (right, left) since the start."""
        edges = self.config.steps_per_turn / (2.0 * pi)
        return int(self.right * edges // 1), int(self.left * edges // 1)
