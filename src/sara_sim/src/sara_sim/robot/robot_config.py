"""What a simulated robot is like: its size, limits, odometry and laser scanners."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi

from sara_common.config import fault, is_number, is_whole, number_faults, range_faults
from sara_common.planar import Pose2D
from sara_sim.chips.scanner import Optics
from sara_sim.config import Checked

STEPS_PER_S = 100
STEP_S = 0.01
MOST_SAMPLES = 10_000


def rate_faults(config: object, name: str) -> list[str]:
    """A sentence where an attribute is no rate that steps of STEP_S keep exactly."""
    value = getattr(config, name)
    if is_whole(value, 1, STEPS_PER_S) and STEPS_PER_S % value == 0:
        return []
    return [fault(config, name, f'are whole numbers that divide {STEPS_PER_S} (per s)')]


@dataclass(frozen=True)
class ScannerConfig(Checked):
    """A laser scanner. Raises ConfigError that names every fault.

    x, y, z (m), yaw (rad): where it sits in base_link. fov: rad between its first ray and its last, about its x axis.
    samples: rays. rate: sweeps per s. sweep: s from the first ray of a sweep to the last; 0: all are cast at once, as
    Stage does. range_min, range_max: m. sigma: standard deviation of a range, m.
    """

    x: float = 0.05
    y: float = 0.0
    z: float = 0.25
    yaw: float = 0.0
    fov: float = 1.5 * pi
    samples: int = 541
    rate: int = 10
    sweep: float = 0.0
    range_min: float = 0.05
    range_max: float = 30.0
    sigma: float = 0.01

    def validate(self) -> list[str]:
        """One sentence for every fault found."""
        faults = [fault(self, name, 'is a finite number') for name in ('x', 'y', 'z', 'yaw') if self._no_number(name)]
        faults += range_faults(self, {'fov': (0.0, 2.0 * pi, True)})
        faults += number_faults(self, ('range_max',), ('sweep', 'range_min', 'sigma'))
        if not is_whole(self.samples, 2, MOST_SAMPLES):
            faults.append(fault(self, 'samples', f'are whole numbers from 2 to {MOST_SAMPLES}'))
        faults += rate_faults(self, 'rate')
        if not faults and self.range_min >= self.range_max:
            faults.append(fault(self, 'range_min', f'are numbers below range_max, {self.range_max:g}'))
        if not faults and self.sweep * self.rate > 1.0:
            faults.append(fault(self, 'sweep', f'are numbers up to the time between two sweeps, {1 / self.rate:g}'))
        return faults

    def _no_number(self, name):
        return not is_number(getattr(self, name))

    @property
    def optics(self) -> Optics:
        """For `chips.scanner.Scanner`, stepped STEPS_PER_S times a second."""
        return Optics(
            mount=Pose2D(self.x, self.y, self.yaw),
            rays=self.samples,
            angle_min=-0.5 * self.fov,
            angle_increment=self.fov / (self.samples - 1),
            period_steps=STEPS_PER_S // self.rate,
            time_increment=self.sweep / (self.samples - 1),
            range_min=self.range_min,
            range_max=self.range_max,
            sigma=self.sigma,
        )


@dataclass(frozen=True)
class RobotConfig(Checked):
    """A robot on two driven wheels. Raises ConfigError that names every fault.

    size: length and width of its footprint, m. centre: the footprint's middle in base_link, x and y, m. max_vel_x,
    min_vel_x (below 0: backwards), max_vel_theta: m/s, rad/s. acc_lim_x, acc_lim_theta: m/s2, rad/s2.
    base_watchdog_timeout: s after which a command is no longer obeyed; 0: it is for ever.

    odom_error: by how much wheel odometry misjudges every distance and every turn: each robot's share is drawn evenly
    from +-half of it. odom_noise: what it misjudges besides, at random: standard deviation of the distance in m per
    square root of a metre driven and of a radian turned, and of the heading in rad likewise.

    scanners: ScannerConfig, any number of them.
    """

    size: tuple = (0.44, 0.38)
    centre: tuple = (0.0, 0.0)
    max_vel_x: float = 1.0
    min_vel_x: float = -0.5
    max_vel_theta: float = 1.5
    acc_lim_x: float = 1.0
    acc_lim_theta: float = 3.0
    base_watchdog_timeout: float = 0.2
    odom_error: tuple = (0.03, 0.05)
    odom_noise: tuple = (0.01, 0.01, 0.01, 0.02)
    scanners: tuple = (ScannerConfig(),)

    def validate(self) -> list[str]:
        """One sentence for every fault found."""
        faults = number_faults(
            self,
            ('max_vel_x', 'max_vel_theta', 'acc_lim_x', 'acc_lim_theta'),
            ('base_watchdog_timeout',),
        )
        if not is_number(self.min_vel_x) or self.min_vel_x > 0.0:
            faults.append(fault(self, 'min_vel_x', 'are numbers of 0 or less'))
        for name, count, least, allowed in (
            ('size', 2, 1e-3, 'are two lengths above 0 m'),
            ('centre', 2, -inf, 'are two finite numbers'),
            ('odom_error', 2, 0.0, 'are two numbers of 0 or more'),
            ('odom_noise', 4, 0.0, 'are four numbers of 0 or more'),
        ):
            value = getattr(self, name)
            numbers = isinstance(value, tuple) and len(value) == count and all(map(is_number, value))
            if not numbers or min(value) < least:
                faults.append(fault(self, name, allowed))
        if not isinstance(self.scanners, tuple) or not all(isinstance(one, ScannerConfig) for one in self.scanners):
            faults.append(fault(self, 'scanners', 'is a list of scanners'))
        return faults
