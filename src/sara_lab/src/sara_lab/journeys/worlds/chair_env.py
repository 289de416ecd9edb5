"""The simulated chair as a gymnasium environment, for people who learn policies:

    env = gymnasium.make('sara_lab.journeys.worlds.chair_env:Wheelchair-v0')

Each episode is a task in a world made by a seed (made.py). An action is a command of the navigation, held for PERIOD;
it goes to the wheels through multiplexer, safety gate and bus, as move_base's does. The pose is the true one. The
package gymnasium is needed here alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.planar import wrap
from sara_common.platforms import chosen
from sara_lab.journeys.journeys import take_zones_off
from sara_lab.journeys.travel import PACE, PATIENCE_S
from sara_lab.journeys.worlds.made import DENSITIES, KINDS, PER_KIND, made
from sara_lab.journeys.worlds.task import Task
from sara_lab.journeys.worlds.trial import POSITION_M, YAW_DEG
from sara_sim.chair import STEP_S

PERIOD = 0.1  # s from one action to the next
FASTEST, ASTERN, TURN = 0.8, 0.2, 0.8  # m/s, m/s, rad/s: of actions of 1 and -1
FAR, NO_ECHO = 20.0, 6.0  # m: bounds of the goal's place; what a sensor reports that hears nothing
REACHED, TOUCHED = 10.0, -10.0  # rewards at the end, beside a metre's of progress, 1
AT_REST = 0.05  # m/s


class ChairEnv(gymnasium.Env):
    """`kinds`: of worlds (made.KINDS) that episodes are drawn from. `gated`: whether the safety gate's distance zones
    act.

    Observation: `ranges` (n,), m, of the ultrasonic sensors in the order of the platform's; `velocity` (2,), m/s and
    rad/s; `goal` (4,): x, y (m) in the chair's frame, at most FAR away, cosine and sine of the yaw that is left. Action
    (2,), from -1 to 1: shares of FASTEST or ASTERN and of TURN, as commanded. Reward: metres nearer to the goal, in a
    straight line, and REACHED or TOUCHED at the end. An episode terminates at the goal, at rest, or with a contact, and
    is truncated after travel's patience.
    """

    metadata = {'render_modes': []}

    def __init__(self, kinds: Sequence[str] = tuple(DENSITIES), gated: bool = True) -> None:
        unknown = [kind for kind in kinds if kind not in KINDS]
        if unknown or not kinds:
            raise ValueError(f'kinds are {list(kinds)}, allowed are some of {", ".join(KINDS)}')
        self._kinds, self._gated = tuple(kinds), gated
        sensors = len(chosen().sonars)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = spaces.Dict(
            {
                'ranges': spaces.Box(0.0, NO_ECHO, (sensors,), np.float32),
                'velocity': spaces.Box(-5.0, 5.0, (2,), np.float32),
                'goal': spaces.Box(np.float32([-FAR, -FAR, -1.0, -1.0]), np.float32([FAR, FAR, 1.0, 1.0])),
            }
        )
        self.task: Task | None = None
        self.lockstep: Lockstep | None = None
        self._command, self._until = (0.0, 0.0), 0.0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict, dict]:
        """Begin an episode: a world and a chair that the seed draws, or those of `options` {kind: of KINDS, number: of
        the world}. Returns (observation, info). Raises ValueError for an option that is none.
        """
        super().reset(seed=seed)
        options = options or {}
        if set(options) - {'kind', 'number'}:
            raise ValueError(f'options are {sorted(options)}, allowed are kind and number')
        kind = options.get('kind', self._kinds[int(self.np_random.integers(len(self._kinds)))])
        number = options.get('number', int(self.np_random.integers(PER_KIND)))
        self.task = made(kind, number)
        self.lockstep = lockstep = Lockstep(self.task.grid, self.task.start, number, localization='fake')
        if not self._gated:
            take_zones_off(lockstep)
        self._command = (0.0, 0.0)
        lockstep.pilot = lambda _now: self._command
        lockstep.start_up()
        self._until = lockstep.time + PATIENCE_S + self.task.way / PACE
        return self._observation(), {'world': self.task.name, 'way': self.task.way}

    def step(self, action: np.ndarray) -> tuple[dict, float, bool, bool, dict]:
        """Drive PERIOD with an action; see the class."""
        lockstep, before = self.lockstep, self._distance()
        speed, turn = (float(value) for value in np.clip(action, -1.0, 1.0))
        self._command = speed * (FASTEST if speed > 0.0 else ASTERN), turn * TURN
        touched = lockstep.chair.contacts
        for _ in range(round(PERIOD / STEP_S)):
            lockstep.step()
        hit, there = lockstep.chair.contacts > touched, self._there()
        reward = before - self._distance() + (TOUCHED if hit else REACHED if there else 0.0)
        info = {'contacts': lockstep.chair.contacts, 'gate': str(lockstep.wheels.decision.state.value)}
        late = lockstep.time >= self._until
        return self._observation(), float(reward), hit or there, late and not (hit or there), info

    def _distance(self):
        return math.dist(self.lockstep.chair.pose[:2], self.task.goal[:2])

    def _there(self):
        """Whether the chair is at rest on the goal."""
        chair = self.lockstep.chair
        off = abs(math.degrees(wrap(self.task.goal[2] - chair.pose[2])))
        return self._distance() <= POSITION_M and off <= YAW_DEG and max(map(abs, chair.velocity)) < AT_REST

    def _observation(self):
        lockstep, (x, y, yaw) = self.lockstep, self.lockstep.chair.pose
        heard = [lockstep.last_ranges.get(name, math.inf) for name in chosen().sonars]
        dx, dy = self.task.goal[0] - x, self.task.goal[1] - y
        c, s = math.cos(yaw), math.sin(yaw)
        left = self.task.goal[2] - yaw
        goal = np.float32([c * dx + s * dy, c * dy - s * dx, math.cos(left), math.sin(left)])
        limits = self.observation_space['goal']
        return {
            'ranges': np.clip(np.float32(heard), 0.0, NO_ECHO),
            'velocity': np.clip(np.float32(lockstep.chair.velocity), -5.0, 5.0),
            'goal': np.clip(goal, limits.low, limits.high),
        }


gymnasium.register('Wheelchair-v0', entry_point=ChairEnv)
