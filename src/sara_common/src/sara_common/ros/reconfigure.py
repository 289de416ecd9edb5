"""dynamic_reconfigure from a frozen dataclass: its fields are the parameters, its ``faults()`` the judge of new values.

No generated code: the description that clients such as rqt_reconfigure ask for is built from the dataclass. The values
in force are written to the parameter server at start and after each change, as the C++ servers do; unlike theirs, a
start changes no value.
"""

import dataclasses
import math
import threading
from collections.abc import Callable, Iterable
from typing import Any

import rospy
from dynamic_reconfigure.server import Server

RESTORE = 'restore_defaults'
KINDS = {bool: 'bool', int: 'int', float: 'double', str: 'str'}
UNLIMITED = {bool: (False, True), int: (-(2**31), 2**31 - 1), float: (-math.inf, math.inf), str: ('', '')}


class Description:
    """What dynamic_reconfigure's Server wants a generated module for: fields, types, limits and defaults.

    config: dataclass instance. limits: (low, high) by field name; a field without is unlimited. names: the fields that
    may be changed, all of them when None; fields of other types than bool, int, float and str never are. whole: the
    float fields that clients see as whole numbers.
    """

    all_level = 1

    def __init__(self, config: Any, limits: dict = None, names: Iterable[str] | None = None, whole: Iterable[str] = ()):
        wanted = [f.name for f in dataclasses.fields(config) if names is None or f.name in names]
        values = {name: getattr(config, name) for name in wanted if type(getattr(config, name)) in KINDS}
        defaults = {name: int(value) if name in whole else value for name, value in values.items()}
        defaults[RESTORE] = False
        bounds = {name: (limits or {}).get(name, UNLIMITED[type(value)]) for name, value in defaults.items()}
        self.defaults = defaults
        self.min = {name: type(defaults[name])(low) for name, (low, _) in bounds.items()}
        self.max = {name: type(defaults[name])(high) for name, (_, high) in bounds.items()}
        self.level = dict.fromkeys(defaults, 1)
        self.config_description = {
            'name': 'Default',
            'type': '',
            'id': 0,
            'parent': 0,
            'state': True,
            'groups': [],
            'upper': 'DEFAULT',
            'lower': 'groups',
            'cstate': 'true',
            'parameters': [
                {
                    'name': name,
                    'type': KINDS[type(value)],
                    'level': 1,
                    'edit_method': '',
                    'ctype': '',
                    'cconsttype': '',
                    'description': 'Go back to the values of the start' if name == RESTORE else self._range(name),
                    'default': value,
                    'min': self.min[name],
                    'max': self.max[name],
                }
                for name, value in defaults.items()
            ],
        }

    def _range(self, name):
        low, high = self.min[name], self.max[name]
        if isinstance(low, (bool, str)) or (low, high) == UNLIMITED[type(low)]:
            return ''
        return f'{low:g} .. {high:g}'

    def clamp(self, name: str, value: Any) -> Any:
        """Return the value as the Server clamps it."""
        if self.min[name] == '':
            return value
        return min(max(value, self.min[name]), self.max[name])


class _Server(Server):
    """A Server that leaves it to ``write`` what goes to the parameter server: the values in force, not those that
    clients see, of which some are rounded.
    """

    def __init__(self, write: Callable[[], None], *args: Any):
        self._write = write
        super().__init__(*args)

    def _copy_to_parameter_server(self):
        self._write()


class Reconfigure:
    """A dynamic_reconfigure server for one configuration.

    namespace: '' for the node's own, or a name below it ('global_costmap/inflation_layer'). config: frozen dataclass
    with ``faults()``. limits, names, whole: see Description. callback: called with the new configuration, from a
    service's thread; returns '' when it is in force, or the sentence why it is not. elsewhere: fields that are not set
    in this namespace; they are written to it once they are changed, for before that they would hide from the next start
    what is set in a namespace above. ``config`` is the one in force.
    """

    def __init__(
        self,
        namespace: str,
        config: Any,
        limits: dict,
        callback: Callable[[Any], str],
        names: Iterable[str] | None = None,
        whole: Iterable[str] = (),
        elsewhere: Iterable[str] = (),
    ):
        self.config = self._at_start = config
        self._namespace = namespace
        self._callback = callback
        self._description = Description(config, limits, names, whole)
        self._offered = None
        self._lock = threading.RLock()
        self._elsewhere = frozenset(elsewhere)
        self._write()
        self._server = _Server(self._write, self._description, self._on_wanted, namespace)

    def close(self) -> None:
        """Take the server down."""
        self._server.set_service.shutdown()
        self._server.descr_topic.unregister()
        self._server.update_topic.unregister()

    def _write(self):
        """Put the values in force on the parameter server."""
        at = f'~{self._namespace}/' if self._namespace else '~'
        for name, default in self._description.defaults.items():
            value = getattr(self.config, name, default)
            if name not in self._elsewhere or value != getattr(self._at_start, name):
                rospy.set_param(at + name, value)

    def _on_wanted(self, wanted, _level):
        """Take what was changed: the Server clamps all fields, and values at start may lie outside; those stay."""
        with self._lock:
            fields = [name for name in self._description.defaults if name != RESTORE]
            if self._offered is not None:
                self._change(wanted, fields)
            kinds = {name: type(self._description.defaults[name]) for name in fields}
            self._offered = {name: kinds[name](getattr(self.config, name)) for name in fields}
            wanted.update(self._offered, **{RESTORE: False})
        return wanted

    def _change(self, wanted, fields):
        if wanted.get(RESTORE):
            new = self._at_start
        else:
            changed = {
                name: type(getattr(self.config, name))(wanted[name])
                for name in fields
                if wanted[name] != self._description.clamp(name, self._offered[name])
            }
            new = dataclasses.replace(self.config, **changed)
        if new == self.config:
            return
        problem = '; '.join(new.faults()) or self._callback(new)
        if problem:
            rospy.logwarn('%s is not reconfigured: %s', self._namespace or rospy.get_name(), problem)
        else:
            self.config = new
