"""What a chair can do besides the reference chair: castors that swing, a payload, collisions that shake it, counters
near their wrap.

All of it is off by default: published figures rest on the reference chair. The model is described in docs/simulator.md.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from sara_common.config import is_number
from sara_sim.config import Checked


@dataclass(frozen=True)
class ChairOptions(Checked):
    """Frozen; raises ConfigError that names every fault."""

    castor_swing: float = 0.0  # rad that the chair turns with each rad that its castors swivel, 0..0.2
    castor_x: float = 0.40  # m, the castors' pivots ahead of the drive axle
    castor_trail: float = 0.06  # m, wheel behind pivot
    payload: float = 0.0  # kg, on top of the chair and rider that the reference figures were measured with
    payload_x: float = 0.0  # m, where the payload sits in base_link
    payload_y: float = 0.0
    mass: float = 150.0  # kg, chair and rider without the payload
    tyre_stiffness: float = 50000.0  # N/m, each of four wheels
    wheelbase: float = 0.50  # m, front to rear wheels
    collision_shake: bool = False  # a collision makes the frame ring
    shake_frequency: float = 9.0  # Hz
    shake_decay: float = 0.15  # s, time constant
    right_steps: int = 0  # encoder counters at the start, e.g. 2**32 - 1000
    left_steps: int = 0
    scan: bool = False  # a laser scanner at the front (chips/scanner.py)

    def validate(self) -> list[str]:
        """One sentence for every fault found."""
        faults = []
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(field.default, bool):
                if not isinstance(value, bool):
                    faults.append(f'{field.name} is {value!r}, allowed are true and false')
            elif isinstance(field.default, int):
                if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**32:
                    faults.append(f'{field.name} is {value!r}, allowed are whole numbers from 0 to 2^32 - 1')
            elif not is_number(value):
                faults.append(f'{field.name} is {value!r}, allowed is a finite number')
            elif field.name == 'castor_swing' and not 0.0 <= value <= 0.2:
                faults.append(f'castor_swing is {value!r}, allowed are numbers from 0 to 0.2')
            elif field.name == 'payload' and value < 0.0:
                faults.append(f'payload is {value!r}, allowed are numbers of 0 or more')
            elif field.name not in ('castor_swing', 'payload', 'payload_x', 'payload_y', 'castor_x') and value <= 0.0:
                faults.append(f'{field.name} is {value!r}, allowed are numbers above 0')
            elif field.name == 'castor_x' and value == 0.0:
                faults.append(
                    'castor_x is 0, allowed is any other number: castors under the drive axle cannot swing the chair'
                )
        return faults
