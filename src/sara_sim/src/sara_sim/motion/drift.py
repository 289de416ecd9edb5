"""What moves, tilts and shakes the chair besides its wheels: castors, ramps, thresholds, payload, push, collision.

Nothing here costs anything until something of it is there (`active`).
"""

from __future__ import annotations

from math import cos, exp, pi, sin

from sara_sim.config import ChairConfig
from sara_sim.motion.castors import Castors
from sara_sim.options import ChairOptions
from sara_sim.world.terrain import attitude, bump

SHAKE_OVER = 6.0  # time constants after which a collision's ringing has died away
SHAKE_VERTICAL = 0.3  # share of the ringing that goes up and down


class Drift:
    """`droop`: rad/s that gravity takes from each wheel. `roll`, `pitch` (rad) and their rates: the body's attitude.
    `side_speed` (m/s),
    `side_acceleration` (m/s2): to the left. `shaken`: (forward, up) acceleration of the ringing frame, m/s2.
    """

    def __init__(self, world, config: ChairConfig, options: ChairOptions, lag: float, pose: tuple[float, float, float]):
        self._world, self._config, self._options, self._lag = world, config, options, lag
        self._castors = Castors(options) if options.castor_swing else None
        # Four springs at (+-wheelbase / 2, +-track / 2): moment / angle = 4 k (wheelbase / 2)^2, 4 k (track / 2)^2.
        weight = options.payload * config.gravity
        self._lean_pitch = weight * options.payload_x / (options.tyre_stiffness * options.wheelbase**2)
        self._lean_roll = -weight * options.payload_y / (options.tyre_stiffness * config.track**2)
        self._standing = bool(self._castors or world.ramps or world.thresholds or self._lean_pitch or self._lean_roll)
        self.active = self._standing
        self.droop = self.roll_rate = self.pitch_rate = 0.0
        self.roll = self.pitch = 0.0
        self.side_speed = self.side_acceleration = 0.0
        self.shaken = (0.0, 0.0)
        self._castor_rate = 0.0
        self._pushes: list[Push] = []
        self._pushed = (0.0, 0.0, 0.0)
        self._shake: tuple | None = None
        if self.active:
            self.lean(*pose, 0.0)

    def push(self, forward: float, left: float, turn: float, duration: float) -> None:
        """Somebody pushes: peak velocities (m/s, m/s, rad/s) of a half sine of `duration` s."""
        self._pushes.append(Push(forward, left, turn, duration))
        self.active = True

    def collide(self, speed: float) -> None:
        """The body has met something at `speed` (m/s); rings if the options say so."""
        if self._options.collision_shake and abs(speed) > 1e-3:
            self._shake = (speed, 0.0)
            self.active = True

    def stop(self) -> None:
        """A wall ends whatever pushes."""
        self._pushes.clear()
        self._pushed = (0.0, 0.0, 0.0)

    def displaced(
        self, distance: float, turn: float, speed: float, yaw_rate: float, dt: float
    ) -> tuple[float, float, float]:
        """(forward, left, turn) of a step, m and rad, from what the wheels alone would do."""
        side = 0.0
        if self._castors:
            self._castor_rate = self._castors.turn_rate(speed, yaw_rate, dt)
            turn += self._castor_rate * dt
        vx = vy = w = 0.0
        for push in self._pushes:
            dx, dy, dw = push.step(dt)
            distance, side, turn = distance + dx, side + dy, turn + dw
            vx, vy, w = vx + push.velocity[0], vy + push.velocity[1], w + push.velocity[2]
        self._pushes = [push for push in self._pushes if push.left > 0.0]
        self._pushed = (vx, vy, w)
        if self.pitch:
            distance *= cos(self.pitch)
        self.side_acceleration = (vy - self.side_speed) / dt
        self.side_speed = vy
        return distance, side, turn

    def velocity(self, speed: float, yaw_rate: float) -> tuple[float, float]:
        """(m/s, rad/s) of the body from those of the wheels."""
        return speed + self._pushed[0], yaw_rate + self._pushed[2] + self._castor_rate

    def lean(self, x: float, y: float, yaw: float, dt: float) -> None:
        """Attitude, gravity's pull and ringing at a pose, `dt` s after the last."""
        roll, pitch = self._lean_roll, self._lean_pitch
        if self._world.ramps:
            on_ramp = attitude(self._world.ramps, x, y, yaw, self._options.wheelbase)
            roll, pitch = roll + on_ramp[0], pitch + on_ramp[1]
            # dv/dt = (target - v) / tau - g sin(slope): the loop that follows the target lags behind it by tau g
            # sin(slope).
            self.droop = -self._lag * self._config.gravity * sin(on_ramp[1]) / self._config.wheel_radius
        if self._world.thresholds:
            config, ramp = self._config, self.droop if self._world.ramps else 0.0
            nose, rise = bump(self._world.thresholds, (x, y, yaw), self._options.wheelbase, config.wheel_radius)
            # At an edge the floor's force leans back: its horizontal part is the weight times the rise.
            pitch, self.droop = pitch + nose, ramp + self._lag * config.gravity * rise / config.wheel_radius
        if dt > 0.0:
            self.roll_rate, self.pitch_rate = (roll - self.roll) / dt, (pitch - self.pitch) / dt
        self.roll, self.pitch = roll, pitch
        self.shaken = (0.0, 0.0)
        if self._shake:
            self._ring(dt)
        self.active = bool(
            self._standing
            or self._pushes
            or self._shake
            or any(self._pushed)
            or self.side_acceleration
            or self.side_speed
        )

    def _ring(self, dt: float) -> None:
        """a = -v w exp(-t / tau) cos(w t): the frame springs back from what it met at v."""
        speed, t = self._shake
        t += dt
        if t >= SHAKE_OVER * self._options.shake_decay:
            self._shake = None
            return
        w = 2.0 * pi * self._options.shake_frequency
        ringing = -speed * w * exp(-t / self._options.shake_decay)
        self.shaken = (ringing * cos(w * t), SHAKE_VERTICAL * ringing * sin(w * t))
        self._shake = (speed, t)


class Push:
    """v(t) = peak sin(pi t / duration), along, across and about the body. `velocity`: now; `left`: s still to go."""

    def __init__(self, forward: float, left: float, turn: float, duration: float):
        self._peak = (forward, left, turn)
        self.duration = self.left = duration
        self.velocity = (0.0, 0.0, 0.0)

    def step(self, dt: float) -> tuple[float, float, float]:
        """Displacement (m, m, rad) of the next `dt` s: the exact integral."""
        before = self.duration - self.left
        after = min(before + dt, self.duration)
        self.left = self.duration - after
        if self.left < 1e-9:
            self.left = 0.0
        share = (cos(pi * before / self.duration) - cos(pi * after / self.duration)) * self.duration / pi
        now = sin(pi * after / self.duration) if self.left else 0.0
        self.velocity = tuple(peak * now for peak in self._peak)
        return tuple(peak * share for peak in self._peak)
