"""Where the machine code is: an index beside it, looked for along sys.path, says what was compiled of which sources.

The index is JSON: {"machine": what `machine` returned, "packages": {name: {"object": file, "modules": {name:
{"sources": {path: [mtime_ns, size]}, "kernels": {function: [[types, symbol, class, ...], ...]}}}}}}. `types` is a
letter per argument, as dispatch.c reads them; the classes are those of NamedTuples among them,
"module.Name:field,field".
"""

import importlib.machinery
import importlib.util
import json
import os
import sys
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from types import ModuleType

INDEX = 'ahead_of_time.index.json'
DISPATCH = '_ahead_of_time'  # the extension module made of dispatch.c

recorder = None  # set by build.py: takes every kernel in


def machine(portable: bool = False) -> list[str]:
    """What machine code depends on: the interpreter and the architecture, and unless it is portable the processor with
    all it can do.
    """
    if portable:
        return [sys.implementation.cache_tag, os.uname().machine]
    try:
        lines = Path('/proc/cpuinfo').read_text().split('\n\n', 1)[0].splitlines()
    except OSError:
        lines = []
    abilities = [
        line for line in lines if line.split(':')[0].strip() in ('model name', 'flags', 'Features', 'CPU part')
    ]
    return [*machine(portable=True), *abilities]


def stamp(path: str) -> list[int] | None:
    """[mtime_ns, size] of a file, as the index holds it; None where it is not there."""
    try:
        status = os.stat(path)
    except OSError:
        return None
    return [status.st_mtime_ns, status.st_size]


@lru_cache(None)
def _index():
    """(folder, packages) of the index that is found first, or (None, {}). AHEAD_OF_TIME=off: as if there were none."""
    if os.environ.get('AHEAD_OF_TIME') != 'off':
        for entry in sys.path:
            path = os.path.join(entry, INDEX)
            if os.path.isfile(path):
                index = json.loads(Path(path).read_text())
                known = index['machine']
                return (entry, index['packages']) if machine()[: len(known)] == known else (None, {})
    return None, {}


def fresh(module: dict, stamp: Callable = stamp) -> bool:
    """Whether a module's entry in the index belongs to the sources as they are. `stamp` gives a source's stamp."""
    return all(stamp(path) == was for path, was in module['sources'].items())


_stamp_at_import = lru_cache(None)(stamp)  # modules have most of their sources in common
_place = lru_cache(None)(os.path.realpath)


def variants(function: Callable) -> list[tuple] | None:
    """[(types, machine code, class, ...)] of a function; None where it is not known or its sources have changed."""
    name = function.__module__
    package = name.split('.')[0]
    known = _kernels_of(package, name, _place(function.__code__.co_filename)).get(function.__name__)
    if known is None:
        return None
    folder, packages = _index()
    code = load(object_name(package), os.path.join(folder, packages[package]['object']))
    return [(types, getattr(code, symbol), *classes) for types, symbol, *classes in known]


@lru_cache(None)
def _kernels_of(package, name, path):
    """The index's {function: ...} of a module in a file."""
    module = _index()[1].get(package, {}).get('modules', {}).get(name)
    return module['kernels'] if module and path in module['sources'] and fresh(module, _stamp_at_import) else {}


@lru_cache(None)
def load(name: str, path: str) -> ModuleType:
    """The extension module in a file."""
    spec = importlib.util.spec_from_file_location(
        name, path, loader=importlib.machinery.ExtensionFileLoader(name, path)
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def object_name(package: str) -> str:
    """Name of the extension module with a package's machine code."""
    return f'_ahead_of_{package}'


@lru_cache(None)
def has_index() -> bool:
    """Whether anything was compiled at build time for this machine."""
    return _index()[0] is not None


def dispatch() -> ModuleType:
    """The extension module of dispatch.c."""
    return load(DISPATCH, os.path.join(_index()[0], DISPATCH + importlib.machinery.EXTENSION_SUFFIXES[0]))
