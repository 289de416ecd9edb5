"""Closed-loop speed of one wheel: encoder counts in, amplifier output out.

    u = w* / w_full + kp (m - w) + integral of ki (m - w) dt,   limited to -1..1
    dm/dt = (w* - m) / lag

w* follows the target with a limited acceleration; m is how a motor follows w* whose `w_full` and lag (with that of the
line) are those
of the configuration: so the integral gathers what the motor does differently, not the lag every motor has. The integral
goes no further into a limit than it takes to reach it (clamping; Astrom and Hagglund, "PID Controllers", 3.5). A target
of zero brakes with kp alone and then lets go.

Three faults cut the output until the target has been zero: `stalled`, output and no motion (a blocked wheel, a dead
motor, an encoder that is not plugged in), `reversed`, motion against the output that does not fade (a motor or encoder
wired the wrong way round: the loop would run away), and `unreadable`, nothing but counts that no wheel can have made (a
disturbed encoder line: the output would stay as it was).
"""

from __future__ import annotations

from math import exp, pi

from sara_lowlevel.config import SpeedLoopConfig

_UINT32 = 1 << 32


class SpeedLoop:
    """`speed`: rad/s, as last measured. `output`: -1..1. `fault`: '', 'stalled', 'reversed' or 'unreadable'.
    `glitches`: counts no wheel can have made.
    """

    def __init__(self, config: SpeedLoopConfig) -> None:
        self.config = config
        self.speed = self.output = 0.0
        self.fault = ''
        self.glitches = 0
        self._count: tuple[int, float] | None = None
        self._reference = self._model = self._integral = 0.0
        self._suspect = {'stalled': 0.0, 'reversed': 0.0}
        self._unreadable = 0.0  # s since a count was believed

    def reset(self) -> None:
        """Let go and forget what was measured; a fault stays."""
        self._count = None
        self.speed = 0.0
        self._release()

    def update(self, steps: int, t: float, target: float, allowed: bool = True) -> float:
        """A new encoder count (any integer, modulo 2^32), read at `t` (s), and the wheel speed that is wanted, rad/s.
        Returns the output.

        Not `allowed`: only measure, the amplifier is switched off for another reason.
        """
        last, self._count = self._count, (steps, t)
        if target == 0.0:
            self.fault = ''
        if last is None or t <= last[1]:
            return self.output
        dt = t - last[1]
        moved = (steps - last[0] + (_UINT32 >> 1)) % _UINT32 - (_UINT32 >> 1)
        speed = 2.0 * pi * moved / self.config.steps_per_turn / dt
        if abs(speed) > self.config.max_speed:
            self.glitches += 1
            self._unreadable += dt
            if self._unreadable >= self.config.unreadable_time:
                self.fault = self.fault or 'unreadable'
            if self.fault or target == 0.0 or not allowed:  # to stop needs no count that is believed
                self._release()
            return self.output
        self._unreadable = 0.0
        growing = abs(speed) > 0.9 * abs(self.speed)
        self.speed = speed
        self._watch(dt, growing)
        if self.fault or not allowed:
            self._release()
        elif target == 0.0:
            self._release()
            if abs(speed) > self.config.rest_speed:
                self.output = _within(-self.config.kp * speed, 1.0)
        else:
            self._drive(target, dt)
        return self.output

    def _drive(self, target: float, dt: float) -> None:
        config = self.config
        step = config.max_acceleration * dt
        if abs(target) < abs(self._reference) and target * self._reference >= 0.0:
            self._reference = target  # slowing down is not held up
        else:
            self._reference += _within(target - self._reference, step)
        self._model += (self._reference - self._model) * (1.0 - exp(-dt / config.lag))
        error = self._model - self.speed
        base = self._reference / config.full_speed + config.kp * error
        integral = self._integral + config.ki * error * dt
        if error > 0.0 and base + integral > 1.0:
            integral = max(self._integral, 1.0 - base)
        elif error < 0.0 and base + integral < -1.0:
            integral = min(self._integral, -1.0 - base)
        if self._suspect['stalled'] > 0.0:
            # It may be the encoder that is dead: the wheel must not race before that is certain.
            integral = _within(integral, max(abs(self._integral), config.stall_integral))
        self._integral = integral
        self.output = _within(base + self._integral, 1.0)

    def _release(self) -> None:
        self._reference, self._integral, self.output = 0.0, 0.0, 0.0
        self._model = self.speed

    def _watch(self, dt: float, growing: bool) -> None:
        config, output, speed = self.config, self.output, self.speed
        against = output * speed < 0.0 and abs(speed) > config.rest_speed
        signs = {
            'stalled': abs(output) >= config.stall_output and abs(speed) < config.rest_speed,
            'reversed': against
            and growing
            and abs(output) >= config.reversed_output
            and self._reference * output > 0.0,
        }
        for name, seen in signs.items():
            self._suspect[name] = self._suspect[name] + dt if seen else 0.0
            if self._suspect[name] >= (config.stall_time if name == 'stalled' else config.reversed_time):
                self.fault = self.fault or name


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
