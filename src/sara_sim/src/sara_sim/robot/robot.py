"""Any differential robot on a map: commands in, true motion, drifting odometry and scans out. It has neither sensors'
registers nor a bus; those are the chair's (`chair.py`).

In each step of STEP_S the velocity goes towards the command within the limits of acceleration, and the robot drives the
arc of that velocity. Where its footprint would meet a wall or an obstacle it stays and its speed is 0, as Stage's
robots stall; the wheels stand still as well.
"""

from __future__ import annotations

from math import inf, isfinite

from sara_common.planar import advanced, compose
from sara_sim.chips.scanner import Scan, Scanner
from sara_sim.motion.drive import CONTACT_RELEASE_S
from sara_sim.robot.robot_config import STEP_S, STEPS_PER_S, RobotConfig
from sara_sim.robot.wheel_odometry import WheelOdometry
from sara_sim.world import luck
from sara_sim.world.obstacles import Body
from sara_sim.world.world import World, WorldError


class SimulatedRobot:
    """The same seed and the same commands give the same robot, to the last bit.

    `time`: s since the start. `pose`: true (x, y, yaw) of base_link in the map, m, rad. `velocity`: true (m/s, rad/s).
    `odometry`: WheelOdometry. `stalls`: how often something stopped it.
    `scans`: [(number of the scanner, Scan)] that ended in the last step. `bad_commands`: how many were no numbers.
    """

    def __init__(
        self,
        world: World,
        config: RobotConfig = RobotConfig(),
        seed: int = 0,
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """`start`: (x, y, yaw) of base_link in the map, m, rad. Raises WorldError where it has no room there."""
        world.obstacles.move_to(0.0)
        self.world, self.config, self.start = world, config, tuple(start)
        self._tick, self.time = 0, 0.0
        self._target, self._commanded = (0.0, 0.0), 0.0
        self.bad_commands = self.stalls = 0
        self.place(*start)
        self.odometry = WheelOdometry(config, luck.stream(seed, 'odometry'))
        self.scanners = [
            Scanner(world, luck.stream(seed, 'scan', number), self.pose, STEP_S, one.optics)
            for number, one in enumerate(config.scanners)
        ]
        self.scans: list[tuple[int, Scan]] = []

    def place(self, x: float, y: float, yaw: float) -> None:
        """Lift the robot to a pose, m, rad: it stands there, and its odometry knows nothing of it. Raises WorldError
        where it has no room.
        """
        if not all(map(isfinite, (x, y, yaw))):
            raise WorldError(f'the pose is {(x, y, yaw)!r}, allowed are finite numbers')
        if not self.world.has_room(*self._middle((x, y, yaw)), *self.config.size):
            raise WorldError(f'the pose is {(x, y, yaw)!r} but the robot would stand in a wall or an obstacle there')
        self.pose = (float(x), float(y), float(yaw))
        self.velocity, self._stalled = (0.0, 0.0), -inf
        self._target = (0.0, 0.0)

    def reset(self) -> None:
        """Back to the start, standing. Raises WorldError where an obstacle has gone there."""
        self.place(*self.start)

    def command(self, v: float, w: float) -> bool:
        """Drive at v (m/s) and w (rad/s), from now on. Whether it is obeyed: what is no number stops the robot."""
        self._commanded = self.time
        if not (isfinite(v) and isfinite(w)):
            self.bad_commands += 1
            self._target = (0.0, 0.0)
            return False
        config = self.config
        self._target = (
            min(max(v, config.min_vel_x), config.max_vel_x),
            min(max(w, -config.max_vel_theta), config.max_vel_theta),
        )
        return True

    def step(self) -> None:
        """STEP_S on."""
        self._tick += 1
        self.time = self._tick / STEPS_PER_S
        config, world = self.config, self.world
        if world.obstacles.all:
            world.obstacles.step(self.time, self.body)
        timeout = config.base_watchdog_timeout
        if timeout > 0.0 and self.time - self._commanded >= timeout - 1e-9:
            self._target = (0.0, 0.0)
        v = _towards(self.velocity[0], self._target[0], config.acc_lim_x * STEP_S)
        w = _towards(self.velocity[1], self._target[1], config.acc_lim_theta * STEP_S)
        self._move(v, w)
        self.scans = []
        for number, scanner in enumerate(self.scanners):
            scanner.step(self.pose)
            if scanner.scan is not None:
                self.scans.append((number, scanner.scan))

    @property
    def measured(self) -> tuple[float, float]:
        """The velocity (m/s, rad/s) as wheel odometry has it, without noise."""
        return self.odometry.share[0] * self.velocity[0], self.odometry.share[1] * self.velocity[1]

    @property
    def stalled(self) -> bool:
        """Whether something stopped it a moment ago: pressing on, it creeps up to it again and again."""
        return self.time - self._stalled < CONTACT_RELEASE_S

    @property
    def body(self) -> Body:
        """Where pedestrians see it."""
        length, width = self.config.size
        return Body(*self._middle(self.pose), 0.5 * length, 0.5 * width, *self.velocity)

    def _move(self, v, w):
        """Drive an arc, or stall."""
        if not (v or w):
            self.velocity = (0.0, 0.0)
            return
        after = advanced(*self.pose, v, w, STEP_S)
        if not self.world.may_move(self._middle(self.pose), self._middle(after), *self.config.size):
            self.stalls += not self.stalled
            self.velocity, self._stalled = (0.0, 0.0), self.time
            return
        self.pose, self.velocity = after, (v, w)
        self.odometry.move(v * STEP_S, w * STEP_S)

    def _middle(self, pose):
        """The footprint's middle in the map, for a pose of base_link."""
        x, y = self.config.centre
        return pose if x == y == 0.0 else compose(pose, (x, y, 0.0))


def _towards(value, target, step):
    return min(max(target, value - step), value + step)
