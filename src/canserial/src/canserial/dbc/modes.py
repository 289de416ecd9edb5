"""Who drives, as the bus says it: `modo` of the joystick node (its switch) and `modoPC` of the motor node.

The mode ASSISTED is there only where the bus description declares it, as a DBC file with three more names of values
does: the joystick is a wish then, and the PC drives.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:  # who only wants the numbers need not load cantools
    from canserial.dbc.bus import BusDescription

OFF, MANUAL, ASSISTED, PC = 0, 1, 2, 3
PC_DRIVES = frozenset((ASSISTED, PC))  # modoPC at which the chair takes commands from the PC
DRIVE, STOP, HELP = ord('C'), ord('A'), ord('H')  # `mode` of a wheel command; STOP and HELP ask for control, too


def has_assisted(bus: BusDescription) -> bool:
    """Whether the bus has the mode ASSISTED."""
    return (
        bus.declares('JOYSTICK', 'modo', ASSISTED)
        and bus.declares('MODO_PC', 'modoPC', ASSISTED)
        and bus.declares('WHEEL_COMMAND', 'mode', HELP)
    )


def modes_of(bus: BusDescription) -> frozenset[int]:
    """What `modo` and `modoPC` may be; anything else is a fault."""
    return frozenset((OFF, MANUAL, PC, *((ASSISTED,) if has_assisted(bus) else ())))
