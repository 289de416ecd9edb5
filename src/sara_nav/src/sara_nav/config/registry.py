"""Finds planners, layers and recovery behaviours by the names that users write into parameters."""

import importlib
from collections.abc import Callable, Sequence


class UnknownPlanner(ValueError):
    """A planner was asked for by a name that nothing answers to."""


class Registry:
    """Planners, layers, behaviours by the name users write into ``parameter``.

    modules: those that register some, imported when the first name is asked for; or {name: the module that registers
    it}, each imported when its own name is. refused: {name: what to use instead} of those users may know that are not
    here.
    """

    def __init__(
        self, parameter: str, modules: Sequence[str] | dict[str, str] = (), refused: dict[str, str] | None = None
    ):
        self.parameter = parameter
        self._modules = dict(modules) if isinstance(modules, dict) else tuple(modules)
        self.refused = dict(refused or {})
        self._classes = {}

    def register(self, name: str) -> Callable[[type], type]:
        """Return a class decorator that enters a planner under ``name``."""

        def enter(cls):
            self._classes[name] = cls
            cls.plugin_name = name
            return cls

        return enter

    def names(self) -> list[str]:
        """Return the names that can be asked for, sorted."""
        if isinstance(self._modules, dict):
            return sorted({*self._modules, *self._classes})
        for module in self._modules:
            importlib.import_module(module)
        return sorted(self._classes)

    def find(self, name: str) -> type:
        """Return the class of that name; raises UnknownPlanner, whose text says what there is."""
        names = self.names()
        try:
            if name not in self._classes and isinstance(self._modules, dict):
                importlib.import_module(self._modules[name])
            return self._classes[name]
        except (KeyError, TypeError):
            pass
        if isinstance(name, str) and name in self.refused:
            raise UnknownPlanner(f'{self.parameter} is {name!r}, which is not here: use {self.refused[name]}')
        raise UnknownPlanner('{} is {!r}, allowed are {}'.format(self.parameter, name, ', '.join(names)))
