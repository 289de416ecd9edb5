"""Something goes wrong while the simulated chair drives: how soon it stands, how far it went, and whether it stays
there.

Every hazard of docs/safety.md that has a time, on the whole stack in lockstep, at a moment drawn from the seed. Either
move_base drives towards a goal, which must be given up; or somebody commands 0.8 m/s in a hall and goes on commanding
it whatever happens, which must not move the chair again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_common.planar import Pose2D
from sara_sim.world.obstacles import Obstacle

START, GOAL = (1.0, 1.0, 0.0), (5.0, 1.0, 0.0)
HALL_START, FAST = (1.0, 4.0, 0.0), 0.8  # m/s
OBSTACLE_M = 1.5  # ahead of the front edge
AFTER_S = (2.5, 6.0)  # s after the goal was given: when it happens
AT_REST = 0.05  # m/s
HARD_BRAKING = 1.5  # m/s2
LASTS_S = 4.0  # a fault is over then
WATCHED_S = 8.0  # and the chair is looked at for so long in all
MOVED_M = 0.02  # less than this at rest is no motion
STEPS_PER_S = 100


@dataclass(frozen=True)
class Hazard:
    """What happens, and the time T (s) it may take until the chair begins to brake hard; None where it need not stop.

    `make`: called with the Lockstep. `undo`: called after LASTS_S.
    """

    make: object
    time: float = None
    undo: object = lambda lockstep: None


def _fault(time, name, **arguments):
    """A fault of the simulator that ends by itself."""
    return Hazard(lambda lockstep: lockstep.chair.faults.add(name, duration=LASTS_S, **arguments), time)


def _silence_rear_left(lockstep):
    chair = lockstep.chair
    sensor = min(
        chair.platform.sonars, key=lambda name: (chair.platform.sonars[name].x, -chair.platform.sonars[name].y)
    )
    chair.faults.add('sonar_silent', duration=LASTS_S, sensor=sensor)


def _press(lockstep):
    lockstep.wheels.guard.on_emergency_stop(True)


def _release(lockstep):
    lockstep.wheels.guard.on_emergency_stop(False)


def _kill_navigation(lockstep):
    lockstep.navigation_runs = False


def _restart_navigation(lockstep):
    if lockstep.pilot is None:  # one that was killed has no goal; a pilot that came back would be a fresh command
        lockstep.move_base.cancel(lockstep.time, 'killed')
        lockstep.navigation_runs = True


def _kill_localization(lockstep):
    lockstep.localization_runs = False


def _restart_localization(lockstep):
    lockstep.localization_runs = True


def _obstacle(lockstep):
    x, y, yaw = lockstep.chair.pose
    ahead = 0.5 * lockstep.chair.config.length + OBSTACLE_M + 0.3
    box = Obstacle('box', size=(0.6, 0.6), at=(x + ahead * math.cos(yaw), y + ahead * math.sin(yaw)), yaw=yaw)
    lockstep.chair.world.obstacles.add(box)


# The times are issue limits: docs/safety.md.
HAZARDS = {
    'emergency_stop': Hazard(_press, 0.05, _release),
    'impact': Hazard(lambda lockstep: lockstep.chair.faults.add('push', left=0.4, duration=0.3), 0.2),
    'adapter_unplugged': _fault(0.25, 'adapter_unplugged'),
    'encoders_silent': _fault(0.3, 'frames_dropped', ids=['ENCODER_RIGHT', 'ENCODER_LEFT']),
    'right_encoder_silent': _fault(0.3, 'frames_dropped', ids=['ENCODER_RIGHT']),
    'encoders_frozen': _fault(0.3, 'encoder_frozen', wheel='both'),
    'left_encoder_frozen': _fault(0.3, 'encoder_frozen', wheel='left'),
    'motor_node_silent': _fault(0.3, 'node_silent', node='motor'),
    'imu_silent': _fault(0.5, 'imu_silent'),
    'imu_frozen': _fault(0.8, 'imu_stuck'),
    'sensor_node_silent': _fault(0.5, 'node_silent', node='sensor'),
    'ranges_silent': _fault(0.6, 'frames_dropped', ids=['RANGES_1']),
    'one_sonar_silent': Hazard(_silence_rear_left, 0.6),
    'navigation_killed': Hazard(_kill_navigation, 0.5, _restart_navigation),
    'localization_killed': Hazard(_kill_localization, 0.6, _restart_localization),
    'joystick_node_silent': _fault(0.5 + 0.2, 'node_silent', node='joystick'),
}


def too_late(stopped_after: float, speed: float, allowed: float) -> list[str]:
    """The sentence about a chair that was not at rest in time (s, from `speed`, m/s), in a list; [] where it was."""
    if stopped_after <= allowed + 1e-9:
        return []
    return [f'at rest after {stopped_after:.2f} s from {speed:.2f} m/s, allowed are {allowed:.2f}']


@dataclass(frozen=True)
class Outcome:
    """`speed`: m/s when it happened. `stopped_after`, `way`: s, m to rest (inf where it never came). `drifted`: m moved
    at rest before a fresh command. `resumed`: whether a fresh goal moved it. `text`: how the goal ended. `contacts`:
    with anything.
    """

    hazard: str
    seed: int
    speed: float
    stopped_after: float
    way: float
    drifted: float
    resumed: bool
    text: str
    contacts: int

    @property
    def allowed(self) -> float:
        """s to rest."""
        return HAZARDS[self.hazard].time + self.speed / HARD_BRAKING + 0.25

    @property
    def faults(self) -> list[str]:
        """What does not hold, a sentence each."""
        found = too_late(self.stopped_after, self.speed, self.allowed)
        if self.drifted > MOVED_M:
            found.append(f'moved {self.drifted:.3f} m by itself afterwards')
        if not self.resumed:
            found.append('a fresh goal did not move it')
        if self.contacts:
            found.append(f'{self.contacts} contacts')
        if not self.text:
            found.append('the goal was not given up')
        return found


def driving(seed: int) -> Lockstep:
    """A Lockstep whose move_base drives towards GOAL, at a moment drawn from the seed."""
    lockstep = Lockstep(share() / 'maps' / 'room.yaml', START, seed)
    lockstep.start_up()
    lockstep.move_base.set_goal(Pose2D(*GOAL), lockstep.time)
    run(lockstep, _moment(seed))
    return lockstep


def cruising(seed: int) -> Lockstep:
    """A Lockstep that is told to drive FAST in the hall, and goes on being told, at a moment drawn from the seed."""
    lockstep = Lockstep(share() / 'maps' / 'hall.yaml', HALL_START, seed)
    lockstep.start_up()
    lockstep.pilot = lambda now: (FAST, 0.0)
    run(lockstep, 3.0 + _moment(seed))
    return lockstep


def _moment(seed):
    return np.random.default_rng((seed, 4)).uniform(*AFTER_S)


def run(lockstep: Lockstep, seconds: float) -> None:
    """Step for so long."""
    for _ in range(round(seconds * STEPS_PER_S)):
        lockstep.step()


def happen(name: str, seed: int, cruise: bool = False) -> Outcome:
    """Let the hazard happen on the chair `seed`, on its way to a goal or cruising; the Outcome."""
    hazard, lockstep = HAZARDS[name], cruising(seed) if cruise else driving(seed)
    chair, speed, where = lockstep.chair, lockstep.chair.velocity[0], lockstep.chair.pose
    hazard.make(lockstep)
    stopped, way, drifted = _watch(lockstep, hazard.undo)
    text = 'commands were ignored' if cruise else lockstep.result.text if lockstep.result else ''
    return Outcome(name, seed, speed, stopped, way, drifted, _resumes(lockstep, where[2]), text, chair.contacts)


def _watch(lockstep, undo):
    """(s until rest, m until rest, m moved afterwards) in WATCHED_S; `undo` is called after LASTS_S."""
    chair, began, where = lockstep.chair, lockstep.time, lockstep.chair.pose
    stopped, rest, drifted, undone = math.inf, where, 0.0, False
    while lockstep.time < began + WATCHED_S:
        lockstep.step()
        if not undone and lockstep.time >= began + LASTS_S:
            undo(lockstep)
            undone = True
        if stopped == math.inf and abs(chair.velocity[0]) < AT_REST:
            stopped = lockstep.time - began
            run(lockstep, 0.3)  # the last of the braking
            rest = chair.pose
        elif stopped < math.inf:
            drifted = max(drifted, math.dist(chair.pose[:2], rest[:2]))
    return stopped, math.dist(rest[:2], where[:2]), drifted


def _resumes(lockstep, heading):
    """Whether a fresh command moves the chair: a new goal, or silence and then a word; the emergency stop needs its
    reset first.
    """
    pilot, lockstep.pilot = lockstep.pilot, None
    run(lockstep, 1.5)
    lockstep.wheels.guard.reset()
    run(lockstep, 0.1)
    before = lockstep.chair.pose
    if pilot:
        lockstep.pilot, lockstep.navigation_runs = (lambda now: (0.2, 0.0)), True
        run(lockstep, 3.0)
    else:
        x, y, _ = lockstep.fused
        lockstep.move_base.set_goal(Pose2D(x + 0.4, y, heading), lockstep.time)
        run(lockstep, 8.0)
    return math.dist(lockstep.chair.pose[:2], before[:2]) > 0.1


def obstacle_ahead(seed: int) -> tuple[float, float, float, int]:
    """Something the map does not know appears OBSTACLE_M ahead of the chair that drives FAST. Returns (speed m/s, s to
    rest, gap m, contacts).
    """
    lockstep = cruising(seed)
    chair, speed = lockstep.chair, lockstep.chair.velocity[0]
    x, y, _ = chair.pose
    _obstacle(lockstep)
    stopped, _, _ = _watch(lockstep, lambda _: None)
    return speed, stopped, OBSTACLE_M - math.dist(chair.pose[:2], (x, y)), chair.contacts
