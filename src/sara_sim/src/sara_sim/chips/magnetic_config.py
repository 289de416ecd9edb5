"""The numbers of the simulated magnetic field: the place on the earth, the chair's iron, steel in the world."""

from __future__ import annotations

import datetime
from dataclasses import dataclass, fields

from sara_common.config import fault, is_number
from sara_sim.config import Checked

CHIPS = ('HMC5883L', 'QMC5883L')


@dataclass(frozen=True)
class MagneticConfig(Checked):
    """`chip`: which one is on the bus. `latitude`, `longitude`, `date`: of the map (deg; year, month, day), whose x
    axis points to true east. Names ending in `_sigma` are standard deviations of what a seed draws.

    `hard_iron_sigma`: uT along each axis. `soft_iron_sigma`: of each element of the matrix beside 1. `turn_sigma`: deg
    that the chip is turned about the vertical in its box. `motor_sigma`: uT a motor adds along each axis for each A.
    `noise`: uT of a measurement. `steel`: (x, y) in the map, m, of door frames' posts, each a dipole in a drawn
    direction whose field is at most `steel_field` (uT) at `steel_distance` (m).
    """

    chip: str = 'QMC5883L'
    latitude: float = 40.51  # Alcala de Henares
    longitude: float = -3.35
    date: tuple = (2026, 1, 1)
    hard_iron_sigma: float = 25.0
    soft_iron_sigma: float = 0.04
    turn_sigma: float = 1.0
    motor_sigma: float = 0.12
    noise: float = 0.25
    steel: tuple = ()
    steel_field: float = 50.0
    steel_distance: float = 0.45

    def validate(self) -> list[str]:
        """One sentence for every fault found."""
        faults = []
        if self.chip not in CHIPS:
            faults.append(fault(self, 'chip', f'are {" and ".join(CHIPS)}'))
        try:
            datetime.date(*self.date)
        except (TypeError, ValueError):
            faults.append(fault(self, 'date', 'are year, month, day'))
        if not (isinstance(self.steel, tuple) and all(_is_place(place) for place in self.steel)):
            faults.append(fault(self, 'steel', 'are pairs (x, y), m'))
        for field in fields(self):
            if isinstance(field.default, float) and not is_number(getattr(self, field.name)):
                faults.append(fault(self, field.name, 'is a finite number'))
            elif field.name.endswith(('sigma', 'noise', 'steel_field')) and getattr(self, field.name) < 0.0:
                faults.append(fault(self, field.name, 'are numbers of 0 or more'))
        if is_number(self.steel_distance) and self.steel_distance <= 0.0:
            faults.append(fault(self, 'steel_distance', 'are numbers above 0'))
        return faults


def _is_place(value):
    return isinstance(value, (tuple, list)) and len(value) == 2 and all(map(is_number, value))
