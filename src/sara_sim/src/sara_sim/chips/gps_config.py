"""The numbers of the simulated GPS receiver."""

from __future__ import annotations

from dataclasses import dataclass

from sara_common.config import fault, number_faults
from sara_sim.config import Checked

STEPS_PER_S = 100


@dataclass(frozen=True)
class GpsConfig(Checked):
    """`rate`: fixes per second. `sigma`: standard deviation (m) of the position along east and along north; twice that
    in height. It wanders as a first-order Gauss-Markov process with `correlation_time` (s). `speed_sigma`: m/s of the
    velocity (Doppler) along each axis, which wanders with `speed_correlation_time` (s; 0: white).

    Multipath: on average every `jump_interval` s (0: never) all fixes are `jump` m off in a drawn direction and all
    velocities `jump_speed` m/s in another, for `jump_duration` s on average, both exponentially distributed. Outages:
    `outage_duration` s without a fix, the next one `outage_interval` s after the end of the last (0: never).
    """

    rate: float = 2.5
    sigma: float = 1.5
    correlation_time: float = 60.0
    speed_sigma: float = 0.05
    speed_correlation_time: float = 1.0
    jump: float = 10.0
    jump_speed: float = 0.5
    jump_interval: float = 60.0
    jump_duration: float = 5.0
    outage_interval: float = 0.0
    outage_duration: float = 60.0

    def validate(self) -> list[str]:
        """One sentence for every fault found."""
        faults = number_faults(
            self,
            above_0=('rate', 'sigma', 'correlation_time', 'jump_duration', 'outage_duration'),
            from_0=('speed_sigma', 'speed_correlation_time', 'jump', 'jump_speed', 'jump_interval', 'outage_interval'),
        )
        if not faults and abs(self.steps * self.rate - STEPS_PER_S) > 1e-6:
            faults.append(fault(self, 'rate', 'are rates of which 100 is a multiple, such as 1, 2.5, 5, 10'))
        return faults

    @property
    def steps(self) -> int:
        """Steps of 10 ms from fix to fix."""
        return max(round(STEPS_PER_S / self.rate), 1)
