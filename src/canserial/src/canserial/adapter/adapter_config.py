"""Settings of a CAN adapter, checked as a whole: what its interface cannot do is refused by name, what it does not use
is said.
"""

from __future__ import annotations

import inspect
import math
from dataclasses import dataclass
from importlib import import_module

import can
from can.interfaces import BACKENDS

from canserial.frame import EXTENDED_ID_MAX, STANDARD_ID_MAX
from sara_common.config import ConfigError, is_whole

# Lawicel's S0..S8. python-can calls S7 750 kbit/s, the CANUSB's manual 800 kbit/s: both names give S7.
LAWICEL_RATES = (10000, 20000, 50000, 100000, 125000, 250000, 500000, 800000, 1000000)
TTY_BAUDRATE = 115200
# Arguments that make python-can's interfaces listen only. The last two do not acknowledge frames anyway.
LISTEN_ONLY = {
    'slcan': {'listen_only': True},
    'vector': {'listen_only': True},
    'nixnet': {'listen_only': True},
    'cantact': {'monitor': True},
    'seeedstudio': {'operation_mode': 'silent'},
    'kvaser': {'driver_mode': False},
    'pcan': {'state': can.BusState.PASSIVE},
    'systec': {'state': can.BusState.PASSIVE},
    'udp_multicast': {},
    'virtual': {},
}
# Interfaces that cannot set a bit rate, and why.
NO_BITRATE = {
    'socketcan': 'set it with "ip link set CHANNEL type can bitrate RATE"',
    'socketcand': 'set it where socketcand runs',
    'serial': 'it has no CAN bus of its own',
    'udp_multicast': 'it has no bit rate',
    'virtual': 'it has no bit rate',
}
NAMED = {
    'interface': 'interface',
    'channel': 'port',
    'bitrate': 'bitrate',
    'tty_baudrate': 'tty_baudrate',
    'ttyBaudrate': 'tty_baudrate',
    'can_filters': 'filters',
    'listen_only': 'listen_only',
    'ignore_config': None,
    'config_context': None,
}


@dataclass(frozen=True)
class Filter:
    """Lets a frame through whose identifier agrees with can_id in the bits of can_mask; extended: None = both kinds."""

    can_id: int
    can_mask: int
    extended: bool | None = None


@dataclass(frozen=True)
class AdapterConfig:
    """interface: a name python-can knows; port: its channel; bitrate: bit/s; tty_baudrate: of the serial port (slcan
    only; None = 115200).

    filters: Filters (or mappings of their fields) of which a received frame must pass one; none = everything passes.
    listen_only: nothing is sent, acknowledgements neither. transmit_queue: frames that may wait to be sent,
    transmit_max_age: s that each may wait. options: further keyword arguments of python-can's interface. Raises
    ConfigError with every fault.
    """

    interface: str = 'slcan'
    port: str = '/dev/ttyUSB0'
    bitrate: int = 500000
    tty_baudrate: int | None = None
    filters: tuple = ()
    listen_only: bool = False
    transmit_queue: int = 100
    transmit_max_age: float = 0.2
    options: dict | None = None

    def __post_init__(self):
        faults = []
        if is_whole(self.port):  # YAML's 0 is the name of a channel, too
            object.__setattr__(self, 'port', str(self.port))
        if self.interface not in can.VALID_INTERFACES:
            faults.append(f'interface is {self.interface!r}, allowed are {", ".join(sorted(can.VALID_INTERFACES))}')
        if not isinstance(self.port, str) or not self.port:
            faults.append(f'port is {self.port!r}, allowed is the name of a port, such as /dev/ttyUSB0')
        for name in ('bitrate', 'transmit_queue') + (() if self.tty_baudrate is None else ('tty_baudrate',)):
            value = getattr(self, name)
            if not is_whole(value) or value <= 0:
                faults.append(f'{name} is {value!r}, allowed are whole numbers above 0')
        age = self.transmit_max_age
        if not isinstance(age, (int, float)) or isinstance(age, bool) or not (math.isfinite(age) and age > 0.0):
            faults.append(f'transmit_max_age is {age!r}, allowed are seconds above 0')
        if not isinstance(self.listen_only, bool):
            faults.append(f'listen_only is {self.listen_only!r}, allowed are true and false')
        filters, more = _filters(self.filters)
        object.__setattr__(self, 'filters', filters)
        faults += more
        if not faults:
            faults = self._of_the_interface()
        if faults:
            raise ConfigError(faults)

    def _of_the_interface(self):
        faults = []
        name = self.interface
        if name == 'slcan' and self.bitrate not in (*LAWICEL_RATES, 750000):
            faults.append(f'bitrate is {self.bitrate}, allowed with slcan are {", ".join(map(str, LAWICEL_RATES))}')
        if name != 'slcan' and self.tty_baudrate is not None:
            faults.append(
                f'tty_baudrate is {self.tty_baudrate}, allowed with slcan only, not with {name} (see options)'
            )
        if self.listen_only and name not in LISTEN_ONLY:
            how = ': set it with "ip link set CHANNEL type can listen-only on"' if name == 'socketcan' else ''
            faults.append(f'listen_only is True, allowed with {", ".join(sorted(LISTEN_ONLY))}, not with {name}{how}')
        return faults + _option_faults(name, self.options)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences about what the interface does otherwise than the others."""
        remarks = []
        if self.interface in NO_BITRATE:
            remarks.append(
                f'bitrate is {self.bitrate}, which {self.interface} does not set ({NO_BITRATE[self.interface]}): '
                'only the bus load is reckoned with it'
            )
        if self.interface == 'udp_multicast' and not self.listen_only:
            remarks.append('interface is udp_multicast, which gives back what it sends, too')
        return tuple(remarks)

    def keywords(self) -> dict[str, object]:
        """The keyword arguments of can.Bus."""
        keywords = {'interface': self.interface, 'channel': self.port, 'ignore_config': True}
        if self.interface not in NO_BITRATE:
            keywords['bitrate'] = self.bitrate
        if self.interface == 'slcan':
            keywords.update(
                bitrate=750000 if self.bitrate == 800000 else self.bitrate,
                tty_baudrate=self.tty_baudrate or TTY_BAUDRATE,
                sleep_after_open=0,
                timeout=0.05,
            )
        if self.filters:
            keywords['can_filters'] = [
                {'can_id': f.can_id, 'can_mask': f.can_mask} | ({} if f.extended is None else {'extended': f.extended})
                for f in self.filters
            ]
        if self.listen_only:
            keywords.update(LISTEN_ONLY[self.interface])
        keywords.update(self.options or {})
        return keywords


def _filters(given):
    """(tuple of Filters, faults)."""
    if not isinstance(given, (list, tuple)):
        return (), [f'filters is {given!r}, allowed is a list of can_id, can_mask and, if wanted, extended']
    filters, faults = [], []
    for number, entry in enumerate(given):
        try:
            entry = entry if isinstance(entry, Filter) else Filter(**entry)
        except TypeError:
            faults.append(f'filters[{number}] is {entry!r}, allowed are can_id, can_mask and, if wanted, extended')
            continue
        if entry.extended not in (None, True, False):
            faults.append(f'filters[{number}].extended is {entry.extended!r}, allowed are true and false')
        most = STANDARD_ID_MAX if entry.extended is False else EXTENDED_ID_MAX
        for name in ('can_id', 'can_mask'):
            value = getattr(entry, name)
            if not is_whole(value) or not 0 <= value <= most:
                faults.append(f'filters[{number}].{name} is {value!r}, allowed are whole numbers of 0 to 0x{most:X}')
        filters.append(entry)
    return tuple(filters), faults


def _option_faults(interface, options):
    """python-can swallows keyword arguments that it does not know: look them up in the signatures of the interface's
    class.
    """
    if options is None or options == {}:
        return []
    if not isinstance(options, dict) or not all(isinstance(key, str) for key in options):
        return [f"options is {options!r}, allowed are keyword arguments of python-can's {interface}"]
    faults = [
        f'options holds {key!r}, allowed is '
        + (f'the parameter {NAMED[key]} instead' if NAMED[key] else 'nothing of this name')
        for key in options
        if key in NAMED
    ]
    module, name = BACKENDS[interface]
    try:
        bus_class = getattr(import_module(module), name)
    except Exception as error:  # whatever a maker's library raises where it is missing
        return [*faults, f'interface is {interface!r}, whose driver cannot be loaded here: {error}']
    known = {
        parameter
        for ancestor in inspect.getmro(bus_class)
        if '__init__' in vars(ancestor)
        for parameter, detail in inspect.signature(ancestor.__init__).parameters.items()
        if detail.kind in (detail.POSITIONAL_OR_KEYWORD, detail.KEYWORD_ONLY)
    } - {'self', *NAMED}
    return faults + [
        f'options holds {key!r}, allowed with {interface} are {", ".join(sorted(known))}'
        for key in options
        if key not in known and key not in NAMED
    ]
