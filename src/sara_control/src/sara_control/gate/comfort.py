"""Speeds that change gently: acceleration is limited first, jerk second, exactly and for every length of a step.

De Winkel et al. (TU Delft, "Standards for passenger comfort in automated vehicles: acceleration and jerk") found that
discomfort grows with the amplitude of the acceleration; the jerk limit keeps bodies and things on the seat in their
place. From a speed v the change d that is still wanted allows the acceleration a that can be brought to zero in time: a
dt + a^2 / (2 jerk) <= d. What follows a step is at most a^2 / (2 jerk), however long the steps to come are, so a fixed
target is never overshot.
"""

import math
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import NamedTuple

from ahead_of_time import kernel
from sara_common.config import ConfigError, number_faults

SHORTEST_STEP = 1e-6  # s
RATE_TIME = 0.3  # s over which the rate of a target is averaged
TOGETHER = 0.8  # share of its target from which on an axis no longer holds the other back: it follows one that rises
ARRIVED = 1e-9  # m/s or rad/s: closer than this is there


@dataclass(frozen=True)
class Profile:
    """A rider's limits: m/s, rad/s, m/s2, rad/s2, m/s3, rad/s3; max_lateral is v w, m/s2. They are those of the chair's
    own motion, unless they come from `commanded`.
    """

    max_forward: float = 0.8
    max_reverse: float = 0.4
    max_turn: float = 0.8
    max_lateral: float = 0.4
    acceleration: float = 0.4
    braking: float = 0.8
    jerk: float = 0.8
    turn_acceleration: float = 0.8
    turn_jerk: float = 2.4

    def __post_init__(self):
        faults = number_faults(self, above_0=[field.name for field in fields(self)])
        if faults:
            raise ConfigError(faults)

    def commanded(self, turn_slip: float) -> 'Profile':
        """The limits of commands to a chair that turns slower than it is told to by this factor (1 or more)."""
        return replace(
            self,
            max_turn=self.max_turn * turn_slip,
            max_lateral=self.max_lateral * turn_slip,
            turn_acceleration=self.turn_acceleration * turn_slip,
            turn_jerk=self.turn_jerk * turn_slip,
        )

    def shape(self, v: float, w: float) -> tuple[float, float]:
        """The command (m/s, rad/s) within the limits of speed, on the same curve."""
        factor = 1.0
        if v > self.max_forward:
            factor = self.max_forward / v
        elif -v > self.max_reverse:
            factor = self.max_reverse / -v
        if abs(w) * factor > self.max_turn:
            factor = self.max_turn / abs(w)
        if factor * factor * abs(v * w) > self.max_lateral:
            factor = math.sqrt(self.max_lateral / abs(v * w))
        return v * factor, w * factor


def read_profiles(params: dict) -> dict[str, Profile]:
    """{name: Profile} from a dictionary name -> limits. Raises ConfigError with every fault."""
    if not isinstance(params, dict) or not params:
        raise ConfigError(f'profiles is {params!r}, allowed is a mapping from names to limits')
    profiles, faults = {}, []
    known = Profile.__dataclass_fields__
    for name, limits in params.items():
        if not isinstance(limits, dict):
            faults.append(f'profiles/{name} is {limits!r}, allowed is a mapping of limits')
            continue
        faults += [
            f'profiles/{name}/{key} is {limits[key]!r}, but there is no such limit; allowed are {", ".join(known)}'
            for key in limits
            if key not in known
        ]
        try:
            profiles[name] = Profile(**{key: value for key, value in limits.items() if key in known})
        except ConfigError as error:
            faults += [f'profiles/{name}/{fault}' for fault in str(error).split('; ')]
    if faults:
        raise ConfigError(faults)
    return profiles


class AxisLimits(NamedTuple):
    """growing, shrinking: limits of the acceleration while the speed grows in size, and while it shrinks. jerk:
    limit.
    """

    growing: float
    shrinking: float
    jerk: float


class AxisState(NamedTuple):
    """speed and acceleration of an axis; target: the last one, and rate: how fast targets have changed."""

    speed: float
    acceleration: float
    target: float
    rate: float


class AxisLimiter:
    """One speed that follows a target. acceleration: limit while the speed grows in size; braking: while it shrinks;
    jerk: of both.

    `speed` and `acceleration`: of the last step. A target that goes on falling is followed as it falls: the braking is
    kept up when it is reached, where it would else stay behind by acceleration^2 / (2 jerk). A target of the other sign
    is approached by way of rest, unless both limits are equal.
    """

    def __init__(self, acceleration: float, braking: float, jerk: float) -> None:
        warm()
        self._limits = AxisLimits(float(acceleration), float(braking), float(jerk))
        self.speed = self.acceleration = 0.0
        self._target = self._rate = 0.0

    def set(self, speed: float) -> None:
        """Sets the speed, without an acceleration: another rule has changed it."""
        self.speed, self.acceleration = speed, 0.0

    def step(self, target: float, dt: float) -> float:
        """The speed after dt (s, above 0) on the way to target."""
        self.speed, self.acceleration, self._rate = self._next(target, dt)
        self._target = float(target)
        return self.speed

    def share(self, target: float, dt: float) -> float:
        """The share of target that it has after dt (s), at most 1; 1 where the speed does not grow towards it."""
        if not self._grows(target):
            return 1.0
        return min(max(self._next(target, dt)[0] / target, 0.0), 1.0)

    def held_to(self, share: float, target: float) -> float:
        """The target to go to while the other axis has a share of its own: as much of this one, so that the curve is
        kept, but no less than what is driven already.
        """
        if share >= TOGETHER or not self._grows(target):
            return target
        return math.copysign(max(share / TOGETHER * abs(target), abs(self.speed)), target)

    def _grows(self, target):
        """Whether the speed grows in size on the way to target."""
        return abs(self.speed) < abs(target) and not _opposed(self.speed, target)

    def _next(self, target, dt):
        state = AxisState(self.speed, self.acceleration, self._target, self._rate)
        return limited(float(target), dt, state, self._limits)


class Comfort:
    """The chair's two speeds under a profile: `v` (m/s) and `w` (rad/s) are what is commanded now."""

    def __init__(self, profile: Profile) -> None:
        self._waiting = None
        self._use(profile)

    def _use(self, profile):
        self.profile = profile
        self._forward = AxisLimiter(profile.acceleration, profile.braking, profile.jerk)
        self._turn = AxisLimiter(profile.turn_acceleration, profile.turn_acceleration, profile.turn_jerk)

    @property
    def v(self) -> float:
        """m/s."""
        return self._forward.speed

    @property
    def w(self) -> float:
        """rad/s."""
        return self._turn.speed

    @property
    def moving(self) -> bool:
        """Whether a speed is commanded that is not zero."""
        return self.v != 0.0 or self.w != 0.0

    def change(self, profile: Profile) -> None:
        """Another rider's limits, from the next rest on: a change on the way would break the limits of both."""
        self._waiting = profile

    def step(self, v: float, w: float, dt: float, together: bool = False) -> tuple[float, float]:
        """One step of dt (s) towards (v, w), gently; the new (v, w).

        together: while both grow, neither is ahead of the other, so that the chair sets out on the curve that it is to
        drive (nav2_velocity_smoother: scale_velocities).
        """
        if self._waiting is not None and not self.moving:
            self._use(self._waiting)
            self._waiting = None
        if dt >= SHORTEST_STEP:
            v, w = self.profile.shape(v, w)
            if together:
                share_v, share_w = self._forward.share(v, dt), self._turn.share(w, dt)
                v, w = self._forward.held_to(share_w, v), self._turn.held_to(share_v, w)
            self._forward.step(v, dt)
            self._turn.step(w, dt)
        return self.v, self.w

    def brake(self, dt: float, braking: float, turn_braking: float) -> tuple[float, float]:
        """One step of dt (s) towards rest on the same curve, at these decelerations (m/s2, rad/s2) and without a limit
        of jerk.
        """
        left = max(abs(self.v) / braking, abs(self.w) / turn_braking)
        factor = max(0.0, 1.0 - dt / left) if left > 0.0 else 0.0
        self._forward.set(self.v * factor)
        self._turn.set(self.w * factor)
        return self.v, self.w

    def rest(self) -> None:
        """Nothing is commanded any more, from now on."""
        self._forward.set(0.0)
        self._turn.set(0.0)


@kernel
def _opposed(one, other):
    """Whether two numbers have opposite signs; their product may be too small to tell."""
    return one < 0.0 < other or other < 0.0 < one


@kernel
def limited(target: float, dt: float, state: AxisState, limits: AxisLimits) -> tuple[float, float, float]:
    """(speed, acceleration, rate of the target) after dt (s) from an AxisState towards the target, within AxisLimits;
    see AxisLimiter.
    """
    v, a, rate = state.speed, state.acceleration, state.rate
    growing, shrinking, jerk = limits.growing, limits.shrinking, limits.jerk
    rate += ((target - state.target) / dt - rate) * (1.0 - math.exp(-dt / RATE_TIME))
    if _opposed(v, a) and _opposed(v, rate):
        kept_up = min(abs(a), abs(rate))
        target = math.copysign(max(abs(target) - 0.5 * kept_up**2 / jerk, 0.0), target)
    if growing != shrinking and _opposed(v, target):
        target = 0.0
    d = target - v
    least, most = a - jerk * dt, a + jerk * dt
    if abs(d) <= ARRIVED and least <= d / dt <= most:
        return target, d / dt, rate
    # -jerk dt + sqrt((jerk dt)^2 + 2 jerk d), without its cancellation
    wanted = 2.0 * jerk * d / (jerk * dt + math.sqrt((jerk * dt) ** 2 + 2.0 * jerk * abs(d)))
    up = shrinking if v < 0.0 else growing
    down = shrinking if v > 0.0 else growing
    a = min(max(wanted, -down, least), up, most)
    return v + a * dt, a, rate


@cache
def warm() -> None:
    """Compile, or load from the cache, the kernels for the types they are called with."""
    limited(1.0, 0.02, AxisState(0.5, 0.0, 1.0, 0.0), AxisLimits(0.4, 0.8, 0.8))
    _opposed(0.5, 1.0)
