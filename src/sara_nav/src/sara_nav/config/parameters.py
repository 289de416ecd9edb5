"""From a tree of ROS parameters to frozen configurations, with every fault said at once and nothing ignored.

Reading never stops at the first fault: they are collected, and told together. What was set but never read is told
too, either as a parameter of the C++ peer that is not built here yet, or as unknown, with the nearest known name.
"""

import dataclasses
import difflib
from collections.abc import Callable, Iterable
from typing import Any

from sara_common.config import ConfigError

VOXELS = 'the voxel layer (costmap_2d::ObstacleLayer is here)'
NOT_BUILT = {
    # name, or group ending in '/': (value at which it makes no difference, what it belongs to that is not here)
    **{
        costmap + name: (None, VOXELS)
        for costmap in ('global_costmap/', 'local_costmap/')
        for name in ('origin_z', 'z_resolution', 'z_voxels', 'mark_threshold', 'unknown_threshold', 'publish_voxel_map')
    },
    'CarrotPlanner/': (None, 'carrot_planner/CarrotPlanner'),
}
"""Parameters of the C++ stack for what is not here, on purpose."""


class Parameters:
    """A tree of parameters (nested dicts, as rospy.get_param gives a namespace), remembering what was read.

    above: values by name that a search found in the namespaces above the tree, for ``search``. ``faults`` and
    ``warnings`` are lists of sentences; whoever reads parameters adds to them. ``moved``: new path by old one.
    """

    def __init__(self, tree: dict, above: dict | None = None):
        self._values = dict(_flatten(tree))
        self.above = dict(above or {})
        self._known = set()
        self.faults = []
        self.warnings = []
        self.moved = {}

    def has(self, path: str) -> bool:
        """True when somebody set ``path`` ('a/b')."""
        return path in self._values

    def has_any(self, group: str) -> bool:
        """True when somebody set anything below ``group`` (ending in '/')."""
        return any(path.startswith(group) for path in self._values)

    def take(self, path: str, default: Any) -> Any:
        """Return the value at ``path``, of the default's type, or the default; a wrong type becomes a fault.

        A default of None accepts anything; a tuple is read from a list.
        """
        self._known.add(path)
        if path not in self._values:
            return default
        return self._typed(path, self._values[path], default)

    def search(self, prefix: str, name: str, default: Any) -> Any:
        """Return the value of ``name`` in the namespace ``prefix`` ('' or ending in '/'), or else in the nearest above
        it.

        As ``take`` otherwise. Names that were found nearer hide those further up; these count as read all the same.
        """
        found = None
        for path in self._upward(prefix, name):
            self._known.add(path)
            if found is None and path in self._values:
                found = path
        if found is not None:
            return self._typed(found, self._values[found], default)
        return self._typed(name, self.above[name], default) if name in self.above else default

    def found(self, prefix: str, name: str) -> bool:
        """Return True when ``search`` would find somebody's value."""
        return name in self.above or any(path in self._values for path in self._upward(prefix, name))

    @staticmethod
    def _upward(prefix, name):
        parts = [part for part in prefix.split('/') if part]
        return ['/'.join(parts[:depth] + [name]) for depth in range(len(parts), -1, -1)]

    def ignore(self, group: str, harmless: dict | None = None) -> list[str]:
        """Count all below ``group`` (ending in '/') as read, for somebody says what becomes of it; return what was not
        yet.

        harmless: {name: value} that need not be spoken of, for nothing would be another way with them.
        """
        paths = sorted(path for path in set(self._values) - self._known if path.startswith(group))
        self._known.update(paths)
        harmless = harmless or {}
        return [
            path
            for path in paths
            if path[len(group) :] not in harmless or harmless[path[len(group) :]] != self._values[path]
        ]

    def unowned(self, prefix: str, owners: Iterable[str], what: str) -> None:
        """Warn of each group of parameters below a prefix that belongs to none of the owners, and count it as read.

        what: what an owner is, 'layer'.
        """
        depth, owners = len(prefix), list(owners)
        below = [path[depth:] for path in self._values if path.startswith(prefix)]
        groups = {path.split('/')[0] for path in below if '/' in path}
        for group in sorted(groups - set(owners)):
            paths = self.ignore(f'{prefix}{group}/')
            if paths:
                names = ', '.join(path[depth + len(group) + 1 :] for path in paths)
                near = difflib.get_close_matches(group, owners, 1)
                self.warnings.append(
                    f'the parameters under {prefix}{group}/ ({names}) have no effect: there is no {what} of that name'
                    + (f' (is {near[0]} meant?)' if near else '')
                )

    def unsearched(self, prefix: str, names: Iterable[str], why: str) -> None:
        """Warn of those names in the namespace ``prefix`` that no search has come upon, and count them as read."""
        for path in (prefix + name for name in names):
            if path in self._values and path not in self._known:
                self._known.add(path)
                self.warnings.append(f'parameter {path} has no effect: {why}')

    def rename(self, prefix: str, old: str, new: str) -> None:
        """Take the value of an old name for that of the new one, which goes first where both are set."""
        if prefix + old not in self._values:
            return
        value = self._values.pop(prefix + old)
        if self._values.get(prefix + new, value) != value:
            self.warnings.append(
                f'parameter {prefix}{old} has no effect: it is the old name of {new}, which is set too'
            )
            return
        self._values[prefix + new] = value
        self.warnings.append(f'parameter {prefix}{old} should be called {new}')

    def move(self, old: str, new: str) -> None:
        """Read the value at the path ``old`` at ``new``, whatever was set there; a node moves it on the server, too."""
        self._known.add(old)
        self._values[new] = self._values.pop(old)
        self.moved[old] = new

    def adapt(self, path: str, change: Callable[[Any], Any]) -> None:
        """Put ``change(value)`` in the place of the value at ``path``, if there is one."""
        if path in self._values:
            self._values[path] = change(self._values[path])

    def _typed(self, path, value, default):
        kind = type(default)
        if default is None:
            return value
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            return float(value)
        if kind is int and isinstance(value, float) and value.is_integer():
            return int(value)
        if kind is tuple and isinstance(value, list):
            return tuple(value)
        if type(value) is not kind:
            self.faults.append(
                '{} is {!r}, allowed is {}'.format(
                    path,
                    value,
                    {
                        float: 'a number',
                        int: 'a whole number',
                        bool: 'true or false',
                        str: 'a string',
                        tuple: 'a list',
                        list: 'a list',
                    }.get(kind, kind.__name__),
                )
            )
            return default
        return value

    def config(self, cls: type, *prefixes: str) -> Any:
        """Return a ``cls`` (frozen dataclass with ``faults()``) read from the first prefix that sets each field.

        A prefix is '' or ends in '/'. Faults of the finished configuration are added to ``faults``.
        """
        values = {}
        for entry in dataclasses.fields(cls):
            name = entry.name
            default = entry.default if entry.default is not dataclasses.MISSING else entry.default_factory()
            values[name] = default
            for prefix in reversed(prefixes):
                values[name] = self.take(prefix + name, default) if self.has(prefix + name) else values[name]
                self._known.add(prefix + name)
        result = cls(**values)
        self.faults += [prefixes[0] + fault for fault in result.faults()]
        return result

    def check(self) -> None:
        """Raise ConfigError with all faults, if there are any."""
        if self.faults:
            raise ConfigError(self.faults)

    def left_over(self) -> list[str]:
        """Return sentences about what was set but not read: not built, or not known."""
        result = []
        for path in sorted(set(self._values) - self._known):
            entry = NOT_BUILT.get(path) or next(
                (e for group, e in NOT_BUILT.items() if group.endswith('/') and path.startswith(group)), None
            )
            if path.split('/')[-1] == 'restore_defaults':  # left by dynamic_reconfigure
                if self._values[path] is not False:
                    result.append(f'parameter {path} has no effect at start')
            elif entry is None:
                near = difflib.get_close_matches(path, sorted(self._known | set(NOT_BUILT)), 1)
                result.append(
                    'parameter {} is not known and has no effect{}'.format(
                        path, f' (is {near[0]} meant?)' if near else ''
                    )
                )
            elif entry[0] is None or self._values[path] != entry[0]:
                result.append(f'parameter {path} has no effect: it belongs to {entry[1]}, which is not here')
        return result


def _flatten(tree, prefix=''):
    if not isinstance(tree, dict):
        return
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _flatten(value, prefix + name + '/')
        else:
            yield prefix + name, value
